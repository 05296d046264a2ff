//! Residuals between the trajectory and the IMU measurements over an interval between two nodes.
//!
//! ```text
//! e_w = log(exp(phi(b_w))^-1 R_k^-1 R_(k+1)) / h
//! e_a = R_mid^T ((v_(k+1) - v_k) / h - g) - (f_mid - b_a)
//! ```
//!
//! Both compare means over the interval, so the rate belongs to the middle and no second difference of positions is
//! needed: `v` is the integrated velocity, corrected by the exact derivative of the spline. With `R' = exp(dr) R`, `t'
//! = t + dt`, in the map's axes:
//!
//! ```text
//! d R_(k+1) e_w / d(dr_(k+1) - dr_k) = 1 / h      d R_(k+1) e_w / db_w = R_(k+1)
//! d R_mid e_a / d(dv_(k+1) - dv_k) = 1 / h        d R_mid e_a / d dr_mid = [x]x,  x = (v_(k+1) - v_k) / h - g
//! d R_(k+1) e_w / dM = R_(k+1) w^T, row by row, M the gyroscope's scale errors and misalignments, of which [`FastMotion`]
//!     takes the part that is too fast for the spline
//! d R_mid e_a / dM = R_mid f^T, row by row, M the accelerometer's
//! d R_mid e_a / db_a = R_mid                      d R_mid e_a / dgamma = [g]x (e_x, e_y),  g' = exp(gamma) g
//! ```
//!
//! The equations use residuals summed over a knot spacing ([`add_inertial`]), which is the resolution at which the
//! correction can follow the effect of a bias.

use super::fast_motion::FastMotion;
use super::imu_residual::{AccelResidual, GyroResidual, Inertial};
use super::nodes::Nodes;
use super::rows::ResidualSums;
use crate::layout::Layout;
use crate::normal_equations::NormalEquations;
use crate::strapdown::{Biases, Interval};
use zsim_base::geometry::Vector;

/// Factor on the sigma of a single accelerometer sample, because the correction cannot follow it within a knot span.
/// Without the single samples the correction could oscillate between the ends of the sums.
const SINGLE_SAMPLE_FACTOR: f64 = 3.0;

/// IMU gaps up to this length, s, cause no significant velocity step, and the predicted pose stays within the match
/// gate.
pub(crate) const SHORT_GAP_S: f64 = 0.05;
/// An interval with larger sigmas than these, rad/s and m/s^2, is weakly measured.
const WEAK: (f64, f64) = (0.3, 1.0);
/// Uncertainty after a run of weakly measured intervals above which the correction may have a step, rad and m/s.
const STEP: (f64, f64) = (0.03, 0.08);
/// Time on both sides of a gap over which the correction absorbs the step, s.
const STEP_MARGIN_S: f64 = 0.3;
/// Sigmas added to the samples within this time, rad/s and m/s^2.
const STEP_MARGIN_SIGMA: (f64, f64) = (0.5, 3.0);

/// Adds the residuals of the intervals between `nodes` to the equations.
///
/// If the head rocks, a change of the accelerometer bias becomes a changing acceleration in the map. The second
/// derivative of the correction is linear between knots, so it follows this acceleration on average over a knot spacing
/// but not from sample to sample. With full weight on single samples, the difference would count as information and
/// freeze the bias at any value. Therefore velocities have full weight when summed from the middle of one knot span to
/// the next, and single samples have less ([`SINGLE_SAMPLE_FACTOR`]). Where sigmas change, for example at a dropout, a new sum
/// starts, so that the accurate samples retain their weight.
pub(crate) fn add_inertial(
    equations: &mut NormalEquations,
    layout: &Layout,
    nodes: &Nodes<'_>,
    fast_motion: &FastMotion,
    biases: &Biases,
    gravity: &Vector,
) {
    let Nodes { states, bases, intervals } = *nodes;
    let (mut each, mut whole) = (ResidualSums::none(), ResidualSums::none());
    let mut sum: Option<AccelResidual> = None;
    let near_steps = near_steps(intervals);
    for (k, interval) in intervals.iter().enumerate() {
        let interval = &if near_steps[k] { with_step_margin(interval) } else { *interval };
        let terms = Inertial::between(&states[k], &states[k + 1], interval, biases, gravity);
        let (start, end) = (&bases[k], &bases[k + 1]);
        let gyro = GyroResidual::of(&terms, start, end, interval);
        gyro.with_fast_motion(fast_motion.turn_residual(k)).add_to(&mut each, equations, layout);
        let single = AccelResidual::of(&terms, start, end, interval, gravity);
        let single = single.with_fast_motion(fast_motion.velocity_residual(k));
        single.add_to(SINGLE_SAMPLE_FACTOR, &mut each, equations, layout);
        if let Some(sum) = sum.as_mut().filter(|sum| sum.can_be_summed_with(&single)) {
            sum.append(&single);
        } else if let Some(done) = sum.replace(single) {
            done.add_to(1.0, &mut whole, equations, layout);
        }
    }
    if let Some(last) = sum {
        last.add_to(1.0, &mut whole, equations, layout);
    }
    each.flush_to(equations, layout);
    whole.flush_to(equations, layout);
}

/// Marks intervals close to a run of weakly measured ones (a bridged gap, clipped readings).
///
/// After such a run velocity or attitude are uncertain by more than [`STEP`], so the correction needs a step. The
/// correction is smooth over some knot spacings and spreads the step to both sides of the run, where it contradicts
/// valid samples. With their nominal sigmas these samples would move the biases instead.
pub(super) fn near_steps(intervals: &[Interval]) -> Vec<bool> {
    let mut near = vec![false; intervals.len()];
    let (mut step2, mut since_s) = ((0.0, 0.0), f64::INFINITY);
    for (k, interval) in intervals.iter().enumerate() {
        let is_weak = interval.gyro_sigma > WEAK.0 || interval.accel_sigma > WEAK.1;
        let add = |sum: f64, sigma: f64| if is_weak { sum + (sigma * interval.h).powi(2) } else { 0.0 };
        step2 = (add(step2.0, interval.gyro_sigma), add(step2.1, interval.accel_sigma));
        let is_step = step2.0.sqrt() > STEP.0 || step2.1.sqrt() > STEP.1;
        since_s = if is_step { 0.0 } else { since_s + interval.h };
        near[k] = since_s < STEP_MARGIN_S;
        if is_step {
            let mut before_s = 0.0;
            for (earlier, near) in intervals[..k].iter().zip(&mut near).rev() {
                before_s += earlier.h;
                if *near || before_s > STEP_MARGIN_S {
                    break;
                }
                *near = true;
            }
        }
    }
    near
}

/// The same interval with [`STEP_MARGIN_SIGMA`] added to the sigmas.
pub(super) fn with_step_margin(interval: &Interval) -> Interval {
    let (gyro_sigma, accel_sigma) =
        (interval.gyro_sigma.hypot(STEP_MARGIN_SIGMA.0), interval.accel_sigma.hypot(STEP_MARGIN_SIGMA.1));
    Interval { gyro_sigma, accel_sigma, ..*interval }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::{ACCEL_BIAS, ACCEL_MATRIX, BORDER, GRAVITY, GYRO_BIAS, GYRO_MATRIX};
    use crate::nominal::Correction;
    use crate::normal_equations::Factor;
    use crate::residual::prior::Start;
    use crate::spline::Basis;
    use crate::strapdown::ImuScaleMisalignment;
    use crate::strapdown::State;
    use approx::assert_relative_eq;
    use nalgebra::{DMatrix, DVector, SVector};
    use std::f64::consts::TAU;
    use zsim_base::geometry::{Matrix, Rotation, from_roll_pitch_yaw, gravity_in_world};

    const SPACING_S: f64 = 0.2;
    const H_S: f64 = 0.01;

    struct Case {
        states: Vec<State>,
        intervals: Vec<Interval>,
        biases: Biases,
        gravity: Vector,
        start_s: f64,
    }

    impl Case {
        fn bases(&self) -> Vec<Basis> {
            (0..self.states.len()).map(|k| Basis::at(self.start_s + k as f64 * H_S, SPACING_S)).collect()
        }

        fn equations(&self, layout: &Layout) -> NormalEquations {
            let mut equations = NormalEquations::new(layout.size());
            let nodes = Nodes { states: &self.states, bases: &self.bases(), intervals: &self.intervals };
            let fast_motion = FastMotion::of(&nodes, layout);
            add_inertial(&mut equations, layout, &nodes, &fast_motion, &self.biases, &self.gravity);
            equations
        }

        /// The whitened residuals: rotation and velocity sample by sample, and velocity over all intervals.
        fn whitened(&self) -> Vec<f64> {
            let (mut whole, mut variance) = (Vector::zeros(), 0.0);
            let mut each = Vec::new();
            for (states, interval) in self.states.windows(2).zip(&self.intervals) {
                let terms = Inertial::between(&states[0], &states[1], interval, &self.biases, &self.gravity);
                let speed = terms.map_from_middle * terms.force;
                whole += speed * interval.h;
                variance += (interval.accel_sigma * interval.h).powi(2);
                each.push(terms.map_from_end * terms.rate / interval.gyro_sigma);
                each.push(speed / (interval.accel_sigma * SINGLE_SAMPLE_FACTOR));
            }
            each.push(whole / variance.sqrt());
            each.iter().flatten().copied().collect()
        }
    }

    /// A head that pitches by 40 degrees at 1.2 Hz, starting at `start_s`.
    fn rocking(start_s: f64, count: usize) -> Case {
        let w = 1.2 * TAU;
        let biases = Biases { gyro: Vector::new(0.01, -0.02, 0.005), accel: Vector::new(0.03, 0.01, -0.02) };
        let gravity = gravity_in_world();
        let rotation = from_roll_pitch_yaw(0.2, 0.7 * (w * start_s).sin(), 1.4);
        let mut states =
            vec![State { rotation, position: Vector::new(1.0, 2.0, 3.0), velocity: Vector::new(0.3, -0.2, 0.1) }];
        let mut intervals = Vec::new();
        for k in 0..count {
            let phase = w * (start_s + (k as f64 + 0.5) * H_S);
            let interval = Interval {
                h: H_S,
                gyro: Vector::new(0.5, 0.7 * w * phase.cos(), -1.0),
                gyro_slope: Vector::new(0.0, -0.7 * w * w * phase.sin(), 0.0),
                accel: Vector::new(2.0, -1.0 + phase.sin(), 9.0),
                accel_slope: Vector::new(0.0, w * phase.cos(), 0.0),
                uncompensated: 1.0,
                gyro_sigma: 0.006,
                accel_sigma: 0.01,
                bridged: false,
            };
            states.push(states[k].after(&interval, &biases, &gravity));
            intervals.push(interval);
        }
        Case { states, intervals, biases, gravity, start_s }
    }

    /// 200 ms from the middle of one span to the next, which form one sum, with states that do not fit exactly.
    fn misfit() -> Case {
        let mut case = rocking(0.505, 20);
        for (k, state) in case.states.iter_mut().enumerate() {
            let off = 1e-4 * (k as f64).sin();
            state.rotation = Rotation::from_scaled_axis(Vector::new(1.0, -2.0, 1.0) * off) * state.rotation;
            state.velocity += Vector::new(10.0, 20.0, -10.0) * off;
        }
        case
    }

    fn layout() -> Layout {
        Layout { first_knot: 2, knots: 5 }
    }

    /// Residuals of `case`, whitened, after a step `x` of the window's unknowns.
    fn whitened(case: &Case, x: &DVector<f64>) -> DVector<f64> {
        let border = layout().border();
        let three = |at: usize| Vector::new(x[border + at], x[border + at + 1], x[border + at + 2]);
        let bases = case.bases();
        let nodes = Nodes { states: &case.states, bases: &bases, intervals: &case.intervals };
        let fast_motion = FastMotion::of(&nodes, &layout());
        let moved = |(k, (state, basis)): (usize, (&State, &Basis))| {
            let correction = Correction::of_spline(basis, 2, x.as_slice());
            let fast = fast_motion.at(k, &x.as_slice()[border..]);
            State {
                rotation: Rotation::from_scaled_axis(correction.rotation + fast.rotation) * state.rotation,
                position: state.position + correction.translation + fast.translation,
                velocity: state.velocity + correction.velocity + fast.velocity,
            }
        };
        let matrix = |at: usize| Matrix::from_fn(|r, c| x[border + at + 3 * r + c]);
        let scale_misalignment = ImuScaleMisalignment { gyro: matrix(GYRO_MATRIX), accel: matrix(ACCEL_MATRIX) };
        let tilt = Vector::new(x[border + GRAVITY], x[border + GRAVITY + 1], 0.0);
        let moved = Case {
            states: case.states.iter().zip(&bases).enumerate().map(moved).collect(),
            intervals: case.intervals.iter().map(|interval| interval.corrected_by(&scale_misalignment)).collect(),
            biases: Biases { gyro: case.biases.gyro + three(GYRO_BIAS), accel: case.biases.accel + three(ACCEL_BIAS) },
            gravity: Rotation::from_scaled_axis(tilt) * case.gravity,
            start_s: case.start_s,
        };
        DVector::from_vec(moved.whitened())
    }

    #[test]
    fn the_derivatives_are_those_of_the_residuals() {
        let (case, layout) = (misfit(), layout());
        let zero = DVector::zeros(layout.size());
        let residual = whitened(&case, &zero);
        let mut jacobian = DMatrix::zeros(residual.len(), layout.size());
        let step = 1e-6;
        for k in 0..layout.size() {
            let mut x = zero.clone();
            x[k] = step;
            let forward = whitened(&case, &x);
            x[k] = -step;
            jacobian.set_column(k, &((forward - whitened(&case, &x)) / (2.0 * step)));
        }
        let equations = case.equations(&layout);
        // Neglected on purpose: the effect of the biases through terms of order h (a rotation of 0.05 rad in the
        // interval).
        let (dense, numeric) = (equations.dense(), jacobian.transpose() * &jacobian);
        let scale = numeric.amax();
        assert_relative_eq!(dense, numeric, epsilon = 1e-2 * scale, max_relative = 2e-2);
        let knots = layout.border();
        let block = |m: &DMatrix<f64>| m.view((0, 0), (knots, knots)).into_owned();
        assert_relative_eq!(block(&dense), block(&numeric), epsilon = 2e-4 * block(&numeric).amax());
        let right = -jacobian.transpose() * residual;
        assert_relative_eq!(equations.right(), right, epsilon = 5e-3 * right.amax());
    }

    #[test]
    fn integration_leaves_no_residual() {
        // Rounding and the coning term of order h^3: the residual takes the middle from the rotation, integration from
        // the rate.
        let largest = rocking(0.0, 100).whitened().into_iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        assert!(largest < 0.1, "{largest}");
    }

    #[test]
    fn the_imu_without_other_sensors_does_not_observe_the_accelerometer_bias() {
        // Any accelerometer bias is consistent with some trajectory with the same initial state. Four seconds of
        // rocking would determine a constant to 10 mm/s^2 / sqrt(400); the bias sigma stays above 25 times that.
        let case = rocking(0.013, 400);
        let layout = Layout { first_knot: 0, knots: 24 };
        let mut equations = case.equations(&layout);
        Start::continuing(0.013).add_to(
            &mut equations,
            &layout,
            &vec![0.0; layout.border()],
            &SVector::zeros(),
            SPACING_S,
        );
        (0..layout.size()).for_each(|unknown| equations.add_entry(unknown, unknown, 1e-3));
        let mut factor = Factor::default();
        equations.factor(&mut factor).unwrap();
        let information = factor.information_of_last::<BORDER>();
        for unknown in ACCEL_BIAS..ACCEL_BIAS + 3 {
            let sigma = information[(unknown, unknown)].recip().sqrt();
            assert!(sigma > 25.0 * 0.01 / 400_f64.sqrt(), "{unknown}: {sigma}");
        }
    }
}
