//! What is remembered of biases, gravity and clock from window to window.

use super::consider::{IMU_OFFSET, IMU_STATES, StartMatrix};
use super::normal_equations::{Factor, NormalEquations};
use super::residual::prior::add_border;
use super::residual::{ACCEL_BIAS, BORDER, CLOCK, CLOCK_RATE, GRAVITY, GYRO_BIAS, Layout};
use crate::measurement::ImuNoise;
use nalgebra::{SMatrix, SVector};

/// Wander of the clock offset that its rate does not explain, s per square root of a second.
const CLOCK_WALK_S_PER_SQRT_S: f64 = 5e-6;
/// Wander of the clock's rate, 1 per square root of a second.
const CLOCK_RATE_WALK_PER_SQRT_S: f64 = 2e-7;

/// So much of what a window adds is believed for good: what its matches err they err together, and in the next windows
/// again.
const INDEPENDENT_FRACTION: f64 = 0.1;

/// What is known of the border before a window, and by it.
///
/// Windows overlap: what a window adds to the prior is mostly measured again by the next one. So only the leaving
/// stretch's share of it is remembered, of mean and of information, and the random_walks of biases and clock wear it down.
#[derive(Debug, Clone)]
pub(super) struct Border {
    prior: SMatrix<f64, BORDER, BORDER>,
    /// From the values with which the window began to the prior's mean.
    to_mean: SVector<f64, BORDER>,
    /// The window's information, whose mean its solution is, where it has one.
    posterior: Option<SMatrix<f64, BORDER, BORDER>>,
    step: SVector<f64, BORDER>,
    random_walks: [f64; BORDER],
}

impl Border {
    /// Knows `prior` at first; a clock that is not estimated does not wander.
    pub(super) fn new(prior: SMatrix<f64, BORDER, BORDER>, noise: &ImuNoise, clock_wanders: bool) -> Self {
        let mut random_walks = [0.0; BORDER];
        random_walks[GYRO_BIAS..GYRO_BIAS + 3].fill(noise.gyro_bias_walk_rad_per_s_per_sqrt_s);
        random_walks[ACCEL_BIAS..ACCEL_BIAS + 3].fill(noise.accel_bias_walk_m_per_s2_per_sqrt_s);
        random_walks[GRAVITY..GRAVITY + 2].fill(1e-6);
        if clock_wanders {
            random_walks[CLOCK] = CLOCK_WALK_S_PER_SQRT_S;
            random_walks[CLOCK_RATE] = CLOCK_RATE_WALK_PER_SQRT_S;
        }
        Self { prior, to_mean: SVector::zeros(), posterior: None, step: SVector::zeros(), random_walks }
    }

    /// A window begins from the values as they are.
    pub(super) fn start_window(&mut self) {
        self.to_mean -= self.step;
        self.reset_to_window_start();
    }

    /// The values are again those with which the window began.
    pub(super) fn reset_to_window_start(&mut self) {
        self.step = SVector::zeros();
        self.posterior = None;
    }

    /// A solve moved the border by `by`; `factor` is that of its equations.
    pub(super) fn add_step(&mut self, by: &[f64], factor: &Factor) {
        self.step += SVector::from_column_slice(by);
        self.posterior = Some(factor.information_of_last::<BORDER>());
    }

    /// What the window knew before of the IMU's part, all else being unknown.
    pub(super) fn imu_information(&self) -> Option<SMatrix<f64, IMU_STATES, IMU_STATES>> {
        self.prior.try_inverse()?.fixed_view::<IMU_STATES, IMU_STATES>(0, 0).try_inverse()
    }

    /// By how much the IMU's part of what a window begins with wanders in `seconds`.
    pub(super) fn imu_random_walk(&self, seconds: f64) -> StartMatrix {
        let mut by = StartMatrix::zeros();
        (0..IMU_STATES).for_each(|k| by[(IMU_OFFSET + k, IMU_OFFSET + k)] = self.random_walks[k].powi(2) * seconds);
        by
    }

    /// How far it has moved in this window.
    pub(super) fn total_step(&self) -> &SVector<f64, BORDER> {
        &self.step
    }

    pub(super) fn add_to(&self, equations: &mut NormalEquations, layout: &Layout) {
        add_border(equations, layout, &self.prior, &(self.step - self.to_mean));
    }

    /// A stretch leaves that was `share` of the window: its share of what the window added becomes prior knowledge, and
    /// the random_walks of `seconds` wear it.
    pub(super) fn carry_over(&mut self, share: f64, seconds: f64) {
        let share = share * INDEPENDENT_FRACTION;
        let pull = self.prior * (self.to_mean - self.step);
        let (information, pull) = match self.posterior {
            // Of two means, weighed by their information, the posterior's is where the values are.
            Some(posterior) => (self.prior + (posterior - self.prior) * share, pull * (1.0 - share)),
            None => (self.prior, pull),
        };
        let Some(mut covariance) = information.try_inverse() else { return };
        (self.to_mean, self.step) = (covariance * pull, SVector::zeros());
        for (k, walk) in self.random_walks.iter().enumerate() {
            covariance[(k, k)] += walk * walk * seconds;
        }
        if let Some(information) = covariance.try_inverse() {
            self.prior = (information + information.transpose()) * 0.5;
        }
    }

    /// The clock's offset is told from an instant `later_s` later: the offset's error gets the rate's share.
    pub(super) fn shift_clock_reference(&mut self, later_s: f64) {
        // offset_new = offset + rate later, so for information the columns change by the inverse map.
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

    /// Some information of full rank.
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
            gyro_limit_rad_per_s: 1.0,
            accel_limit_m_per_s2: 1.0,
        };
        Border::new(prior, &noise, false)
    }

    /// Solves a window that measures the border itself, to be `measured` with `information`; the values behind it,
    /// which were `values`.
    fn solved(border: &mut Border, values: Values, (measured, information): (&Values, &Information)) -> Values {
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
    fn what_a_window_measures_again_moves_nothing() {
        let (prior, by) = (wave(1), wave(2));
        let measured = Values::from_fn(|k, _| 0.1 * (k as f64 + 1.0));
        let mut border = known(prior);
        let once = solved(&mut border, Values::zeros(), (&measured, &by));
        assert_relative_eq!(once, (prior + by).lu().solve(&(by * measured)).unwrap(), epsilon = 1e-9);
        assert_relative_eq!(solved(&mut border, once, (&measured, &by)), once, epsilon = 1e-9);
    }

    /// As if what is believed of the leaving stretch had been all that was measured.
    #[test]
    fn what_is_remembered_is_the_share_of_mean_and_information() {
        let (prior, by) = (wave(1), wave(2));
        let measured = Values::from_fn(|k, _| 0.1 * (k as f64 + 1.0));
        let mut border = known(prior);
        let values = solved(&mut border, Values::zeros(), (&measured, &by));
        border.carry_over(0.25, 0.5);
        let remembered = by * (0.25 * INDEPENDENT_FRACTION);
        let mean = (prior + remembered).lu().solve(&(remembered * measured)).unwrap();
        let nothing = (&Values::zeros(), &Information::zeros());
        assert_relative_eq!(solved(&mut border, values, nothing), mean, epsilon = 1e-6);
        // Worn by the walk of gravity alone.
        assert_relative_eq!(border.prior, prior + remembered, epsilon = 1e-6, max_relative = 1e-6);
    }

    #[test]
    fn a_window_that_came_to_nothing_teaches_nothing() {
        let (prior, measured) = (wave(1), Values::repeat(0.1));
        let mut border = known(prior);
        let values = solved(&mut border, Values::zeros(), (&measured, &wave(2)));
        solved(&mut border, values, (&Values::repeat(7.0), &wave(3)));
        border.reset_to_window_start();
        border.carry_over(0.25, 0.0);
        assert_relative_eq!(border.prior, prior, max_relative = 1e-6);
        let nothing = (&Values::zeros(), &Information::zeros());
        assert_relative_eq!(solved(&mut border, values, nothing), Values::zeros(), epsilon = 1e-6);
    }

    #[test]
    fn a_clock_told_from_later_is_off_by_its_rates_share_more() {
        let (prior, measured) = (wave(1), Values::from_fn(|k, _| 0.1 * k as f64));
        let told = |later_s: f64| {
            let mut border = known(prior);
            let mut values = solved(&mut border, Values::zeros(), (&measured, &wave(2)));
            border.carry_over(0.5, 0.0);
            border.shift_clock_reference(later_s);
            values[CLOCK] += values[CLOCK_RATE] * later_s;
            solved(&mut border, values, (&Values::zeros(), &Information::zeros()))
        };
        let (before, after) = (told(0.0), told(3.0));
        assert_relative_eq!(after[CLOCK], before[CLOCK] + 3.0 * before[CLOCK_RATE], epsilon = 1e-6);
        assert_relative_eq!(after[CLOCK_RATE], before[CLOCK_RATE], epsilon = 1e-6);
    }
}
