//! Prior on the border unknowns (biases, gravity, clock, calibration), carried from window to window.

use super::clock::RATE_WALK_PER_SQRT_S;
use super::consider::{IMU_OFFSET, IMU_STATES, StartMatrix};
use super::normal_equations::{Factor, NormalEquations};
use super::residual::prior::add_border;
use crate::layout::{ACCEL_BIAS, BORDER, CLOCK, CLOCK_RATE, GRAVITY, GYRO_BIAS, Layout};
use nalgebra::{SMatrix, SVector};
use zsim_base::measurement::ImuNoise;

/// Random walk of the clock offset in addition to the rate, s per square root of a second.
const CLOCK_WALK_S_PER_SQRT_S: f64 = 5e-6;

/// Fraction of the information of a window that counts as independent: match errors are correlated, in the window and
/// with those of the next windows.
const INDEPENDENT_FRACTION: f64 = 0.1;

/// Prior and posterior of the border unknowns.
///
/// Windows overlap, so the next window measures most of the information of a window again. Therefore only a fraction,
/// that of the segment that leaves the window, is added to the prior, in mean and information. The random walks of
/// biases and clock reduce it.
#[derive(Debug, Clone)]
pub(super) struct Border {
    prior: SMatrix<f64, BORDER, BORDER>,
    /// Difference from the values at the start of the window's solution to the prior mean.
    to_mean: SVector<f64, BORDER>,
    /// Information of the posterior, the mean of which is the solution; none without a solution.
    posterior: Option<SMatrix<f64, BORDER, BORDER>>,
    /// Sum of the steps in this window.
    step: SVector<f64, BORDER>,
    /// Random walks, unit of the unknown per square root of a second.
    random_walks: [f64; BORDER],
}

impl Border {
    /// Starts with the information `prior`; without `clock_wanders`, the clock has no random walk.
    pub(super) fn new(prior: SMatrix<f64, BORDER, BORDER>, noise: &ImuNoise, clock_wanders: bool) -> Self {
        let mut random_walks = [0.0; BORDER];
        random_walks[GYRO_BIAS..GYRO_BIAS + 3].fill(noise.gyro_bias_walk_rad_per_s_per_sqrt_s);
        random_walks[ACCEL_BIAS..ACCEL_BIAS + 3].fill(noise.accel_bias_walk_m_per_s2_per_sqrt_s);
        random_walks[GRAVITY..GRAVITY + 2].fill(1e-6);
        if clock_wanders {
            random_walks[CLOCK] = CLOCK_WALK_S_PER_SQRT_S;
            random_walks[CLOCK_RATE] = RATE_WALK_PER_SQRT_S;
        }
        Self { prior, to_mean: SVector::zeros(), posterior: None, step: SVector::zeros(), random_walks }
    }

    /// Starts a window with the current values.
    pub(super) fn start_window(&mut self) {
        self.to_mean -= self.step;
        self.reset_to_window_start();
    }

    /// Discards the steps of the window: the values are reset to those at the start of the window.
    pub(super) fn reset_to_window_start(&mut self) {
        self.step = SVector::zeros();
        self.posterior = None;
    }

    /// Adds the step `by` of a solution; `factor` is the factor of the equations.
    pub(super) fn add_step(&mut self, by: &[f64], factor: &Factor) {
        self.step += SVector::from_column_slice(by);
        self.posterior = Some(factor.information_of_last::<BORDER>());
    }

    /// Prior information on the IMU states, with all other unknowns marginalised.
    pub(super) fn imu_information(&self) -> Option<SMatrix<f64, IMU_STATES, IMU_STATES>> {
        self.prior.try_inverse()?.fixed_view::<IMU_STATES, IMU_STATES>(0, 0).try_inverse()
    }

    /// Covariance of the random walk of the IMU states in `seconds`.
    pub(super) fn imu_random_walk(&self, seconds: f64) -> StartMatrix {
        let mut by = StartMatrix::zeros();
        (0..IMU_STATES).for_each(|k| by[(IMU_OFFSET + k, IMU_OFFSET + k)] = self.random_walks[k].powi(2) * seconds);
        by
    }

    /// Sum of the steps in this window.
    pub(super) fn total_step(&self) -> &SVector<f64, BORDER> {
        &self.step
    }

    /// Adds the prior to the equations.
    pub(super) fn add_to(&self, equations: &mut NormalEquations, layout: &Layout) {
        add_border(equations, layout, &self.prior, &(self.step - self.to_mean));
    }

    /// Updates the prior when a segment, a `fraction` of the window, leaves.
    ///
    /// That fraction of the information of the window is added to the prior; then the random walks over `seconds` are
    /// applied.
    pub(super) fn carry_over(&mut self, fraction: f64, seconds: f64) {
        let fraction = fraction * INDEPENDENT_FRACTION;
        let vector = self.prior * (self.to_mean - self.step);
        let (information, vector) = match self.posterior {
            // The information-weighted mean; the posterior mean is at the current values.
            Some(posterior) => (self.prior + (posterior - self.prior) * fraction, vector * (1.0 - fraction)),
            None => (self.prior, vector),
        };
        let Some(mut covariance) = information.try_inverse() else { return };
        (self.to_mean, self.step) = (covariance * vector, SVector::zeros());
        for (k, walk) in self.random_walks.iter().enumerate() {
            covariance[(k, k)] += walk * walk * seconds;
        }
        if let Some(information) = covariance.try_inverse() {
            self.prior = (information + information.transpose()) * 0.5;
        }
    }

    /// Moves the reference time of the clock offset by `later_s`: the offset changes by the rate times `later_s`.
    pub(super) fn shift_clock_reference(&mut self, later_s: f64) {
        // offset_new = offset + rate * later_s; the information transforms with the inverse.
        let mut back = SMatrix::<f64, BORDER, BORDER>::identity();
        back[(CLOCK, CLOCK_RATE)] = -later_s;
        self.prior = back.transpose() * self.prior * back;
        for values in [&mut self.to_mean, &mut self.step] {
            values[CLOCK] += values[CLOCK_RATE] * later_s;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    type Information = SMatrix<f64, BORDER, BORDER>;
    type Values = SVector<f64, BORDER>;
    const LAYOUT: Layout = Layout { first_knot: 0, knots: 0 };

    /// An information matrix of full rank.
    fn wave(seed: usize) -> Information {
        let root = Information::from_fn(|r, c| ((seed * 7 + r * 5 + c * 3 + r * c) as f64 * 0.61).sin());
        root * root.transpose() + Information::identity()
    }

    fn known(prior: Information) -> Border {
        let noise = ImuNoise {
            gyro_density_rad_per_s_per_sqrt_hz: 0.0,
            accel_density_m_per_s2_per_sqrt_hz: 0.0,
            gyro_bias_walk_rad_per_s_per_sqrt_s: 0.0,
            accel_bias_walk_m_per_s2_per_sqrt_s: 0.0,
            gyro_turn_on_bias_rad_per_s: 0.0,
            accel_turn_on_bias_m_per_s2: 0.0,
            gyro_scale_error: 0.0,
            gyro_misalignment_rad: 0.0,
            accel_scale_error: 0.0,
            accel_misalignment_rad: 0.0,
            gyro_limit_rad_per_s: 1.0,
            accel_limit_m_per_s2: 1.0,
        };
        Border::new(prior, &noise, false)
    }

    /// Solves a window with a direct measurement of the border and returns the values after it.
    fn solved(border: &mut Border, values: Values, measured: &Values, information: &Information) -> Values {
        let mut equations = NormalEquations::new(LAYOUT.size());
        border.start_window();
        border.add_to(&mut equations, &LAYOUT);
        add_border(&mut equations, &LAYOUT, information, &(values - measured));
        let mut factor = Factor::default();
        equations.factor(&mut factor).unwrap();
        let x = equations.solve(&factor);
        border.add_step(&x, &factor);
        values + Values::from_vec(x)
    }

    #[test]
    fn a_repeated_measurement_does_not_change_the_values() {
        let (prior, by) = (wave(1), wave(2));
        let measured = Values::from_fn(|k, _| 0.1 * (k as f64 + 1.0));
        let mut border = known(prior);
        let once = solved(&mut border, Values::zeros(), &measured, &by);
        assert_relative_eq!(once, (prior + by).lu().solve(&(by * measured)).unwrap(), epsilon = 1e-9);
        assert_relative_eq!(solved(&mut border, once, &measured, &by), once, epsilon = 1e-9);
    }

    /// Compares with a measurement that has only the information carried over.
    #[test]
    fn the_fraction_of_mean_and_information_is_carried_over() {
        let (prior, by) = (wave(1), wave(2));
        let measured = Values::from_fn(|k, _| 0.1 * (k as f64 + 1.0));
        let mut border = known(prior);
        let values = solved(&mut border, Values::zeros(), &measured, &by);
        border.carry_over(0.25, 0.5);
        let carried_over = by * (0.25 * INDEPENDENT_FRACTION);
        let mean = (prior + carried_over).lu().solve(&(carried_over * measured)).unwrap();
        let after = solved(&mut border, values, &Values::zeros(), &Information::zeros());
        assert_relative_eq!(after, mean, epsilon = 1e-6);
        // Only the random walk of gravity reduces it.
        assert_relative_eq!(border.prior, prior + carried_over, epsilon = 1e-6, max_relative = 1e-6);
    }

    #[test]
    fn a_rejected_solution_does_not_change_the_prior() {
        let (prior, measured) = (wave(1), Values::repeat(0.1));
        let mut border = known(prior);
        let values = solved(&mut border, Values::zeros(), &measured, &wave(2));
        solved(&mut border, values, &Values::repeat(7.0), &wave(3));
        border.reset_to_window_start();
        border.carry_over(0.25, 0.0);
        assert_relative_eq!(border.prior, prior, max_relative = 1e-6);
        let after = solved(&mut border, values, &Values::zeros(), &Information::zeros());
        assert_relative_eq!(after, Values::zeros(), epsilon = 1e-6);
    }

    #[test]
    fn a_later_reference_time_changes_the_clock_offset_by_the_rate() {
        let (prior, measured) = (wave(1), Values::from_fn(|k, _| 0.1 * k as f64));
        let shifted = |later_s: f64| {
            let mut border = known(prior);
            let mut values = solved(&mut border, Values::zeros(), &measured, &wave(2));
            border.carry_over(0.5, 0.0);
            border.shift_clock_reference(later_s);
            values[CLOCK] += values[CLOCK_RATE] * later_s;
            solved(&mut border, values, &Values::zeros(), &Information::zeros())
        };
        let (before, after) = (shifted(0.0), shifted(3.0));
        assert_relative_eq!(after[CLOCK], before[CLOCK] + 3.0 * before[CLOCK_RATE], epsilon = 1e-6);
        assert_relative_eq!(after[CLOCK_RATE], before[CLOCK_RATE], epsilon = 1e-6);
    }
}
