//! The error-state Kalman filter.
//!
//! The error of the attitude is a small turn in the world's axes, `R = exp(theta) R^`; all other errors are
//! differences. Strapdown integration over an interval `h` with mean rate `w` and force `f` (biases `b`, `c`; `R` in
//! its middle) gives
//!
//! ```text
//! theta' = theta - R h b        v' = v - [R f h]x theta - R h c - h [g]x tilt        p' = p + h v'(mean)
//! l'     = l + h l_rate
//! ```
//!
//! and a fix, looked up at `u - l` for the IMU's time `u`, shows `theta + omega l` and `p + v l`.

use super::FixSigmas;
use crate::estimation::EstimatorSpec;
use crate::estimation::strapdown::{Biases, Interval, State};
use crate::geometry::{Pose, Rotation, Vector, gravity_in_world, skew};
use crate::measurement::ImuNoise;
use nalgebra::{Matrix3, SMatrix, SVector};

/// Numbers of the error: attitude, position, velocity, the two biases, offset of the clock and its rate, tilt of
/// gravity.
const STATES: usize = 19;
const ATTITUDE: usize = 0;
const POSITION: usize = 3;
const VELOCITY: usize = 6;
const GYRO_BIAS: usize = 9;
const ACCEL_BIAS: usize = 12;
const OFFSET: usize = 15;
const RATE: usize = 16;
const TILT: usize = 17;

/// Standard deviations of the start: velocity, m/s, the clock's offset, s, and gravity's direction in the world, rad.
const START_VELOCITY: f64 = 0.5;
const START_OFFSET_S: f64 = 5e-3;
const START_TILT: f64 = 5e-3;
/// Wander of the clock's rate per square root of a second: 0.2 ppm, a quartz in a room.
const RATE_WALK: f64 = 2e-7;
/// Beyond so many standard deviations, over six numbers at once, a correction is believed less.
const BELIEVED: f64 = 5.0;

pub(super) type Errors = SVector<f64, STATES>;
pub(super) type Square = SMatrix<f64, STATES, STATES>;
type Shown = SMatrix<f64, 6, STATES>;

/// All that is estimated at an instant.
#[derive(Debug, Clone, Copy)]
pub(super) struct Estimate {
    pub(super) state: State,
    pub(super) biases: Biases,
    /// How much later the IMU stamps an instant than the fixes do, s.
    pub(super) offset_s: f64,
    /// How fast that grows, s/s.
    pub(super) rate: f64,
    /// The turn of gravity from -z, about x and y of the world, rad; the third number is zero.
    pub(super) tilt: Vector,
}

impl Estimate {
    /// The estimate that is off by `errors` from this one.
    pub(super) fn plus(&self, errors: &Errors) -> Self {
        let part = |at: usize| Vector::from(errors.fixed_rows::<3>(at));
        let mut rotation = Rotation::from_scaled_axis(part(ATTITUDE)) * self.state.rotation;
        rotation.renormalize_fast();
        Self {
            state: State {
                rotation,
                position: self.state.position + part(POSITION),
                velocity: self.state.velocity + part(VELOCITY),
            },
            biases: Biases { gyro: self.biases.gyro + part(GYRO_BIAS), accel: self.biases.accel + part(ACCEL_BIAS) },
            offset_s: self.offset_s + errors[OFFSET],
            rate: self.rate + errors[RATE],
            tilt: self.tilt + Vector::new(errors[TILT], errors[TILT + 1], 0.0),
        }
    }

    /// By what this one is off from `other`.
    pub(super) fn minus(&self, other: &Self) -> Errors {
        let mut errors = Errors::zeros();
        let turn = (self.state.rotation * other.state.rotation.inverse()).scaled_axis();
        errors.fixed_rows_mut::<3>(ATTITUDE).copy_from(&turn);
        errors.fixed_rows_mut::<3>(POSITION).copy_from(&(self.state.position - other.state.position));
        errors.fixed_rows_mut::<3>(VELOCITY).copy_from(&(self.state.velocity - other.state.velocity));
        errors.fixed_rows_mut::<3>(GYRO_BIAS).copy_from(&(self.biases.gyro - other.biases.gyro));
        errors.fixed_rows_mut::<3>(ACCEL_BIAS).copy_from(&(self.biases.accel - other.biases.accel));
        (errors[OFFSET], errors[RATE]) = (self.offset_s - other.offset_s, self.rate - other.rate);
        (errors[TILT], errors[TILT + 1]) = (self.tilt.x - other.tilt.x, self.tilt.y - other.tilt.y);
        errors
    }

    /// Gravity in the world, m/s^2.
    pub(super) fn gravity(&self) -> Vector {
        Rotation::from_scaled_axis(self.tilt) * gravity_in_world()
    }

    /// The IMU's state, one interval later.
    pub(super) fn after(&self, interval: &Interval) -> Self {
        let state = self.state.after(interval, &self.biases, &self.gravity());
        Self { state, offset_s: self.offset_s + self.rate * interval.h, ..*self }
    }
}

/// What fixes say of an epoch, against what the filter expects: the mean of the differences, turn (rad) and shift (m)
/// in the world's axes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Difference {
    pub(super) turn: Vector,
    pub(super) shift: Vector,
    /// Angular velocity in the world, rad/s.
    pub(super) turning: Vector,
    /// How long before the epoch's end the mean's instant is, s.
    pub(super) ago_s: f64,
    pub(super) sigmas: FixSigmas,
}

/// The filter at an instant.
#[derive(Debug, Clone)]
pub(super) struct Filter {
    pub(super) estimate: Estimate,
    pub(super) covariance: Square,
    gyro_walk: f64,
    accel_walk: f64,
}

impl Filter {
    /// Starts at a fix, moving with `velocity`, and with `offset_s` between the clocks.
    pub(super) fn beginning(
        (pose, sigmas): (Pose, FixSigmas),
        velocity: Vector,
        offset_s: f64,
        noise: &ImuNoise,
        spec: &EstimatorSpec,
    ) -> Self {
        let state = State { rotation: pose.rotation, position: pose.translation.vector, velocity };
        let biases = Biases { gyro: Vector::zeros(), accel: Vector::zeros() };
        let mut deviations = Errors::zeros();
        let parts = [
            (ATTITUDE, 3.0 * sigmas.rotation_rad),
            (POSITION, 3.0 * sigmas.position_m),
            (VELOCITY, START_VELOCITY),
            (GYRO_BIAS, noise.gyro_turn_on_bias_rad_per_s.max(1e-6)),
            (ACCEL_BIAS, noise.accel_turn_on_bias_m_per_s2.max(1e-4)),
        ];
        parts.iter().for_each(|(at, sigma)| deviations.fixed_rows_mut::<3>(*at).fill(*sigma));
        deviations.fixed_rows_mut::<2>(TILT).fill(START_TILT);
        (deviations[OFFSET], deviations[RATE]) = (START_OFFSET_S, (spec.clock.drift_ppm * 1e-6).max(1e-9));
        Self {
            estimate: Estimate { state, biases, offset_s, rate: 0.0, tilt: Vector::zeros() },
            covariance: Square::from_diagonal(&deviations.map(|sigma| sigma * sigma)),
            gyro_walk: noise.gyro_bias_walk_rad_per_s_per_sqrt_s.max(1e-9),
            accel_walk: noise.accel_bias_walk_m_per_s2_per_sqrt_s.max(1e-9),
        }
    }

    /// Goes one interval further, and tells how the errors went along.
    pub(super) fn predict(&mut self, interval: &Interval) -> Square {
        let (h, biases) = (interval.h, self.estimate.biases);
        let middle = self.estimate.state.rotation * Rotation::from_scaled_axis(interval.turn_to_middle(&biases));
        let axes = middle.to_rotation_matrix().into_inner();
        let mut along = Square::identity();
        along.fixed_view_mut::<3, 3>(ATTITUDE, GYRO_BIAS).copy_from(&(axes * -h));
        along.fixed_view_mut::<3, 3>(POSITION, VELOCITY).copy_from(&(Matrix3::identity() * h));
        if !interval.bridged {
            let push = skew(&(middle * interval.force_in_middle(&biases))) * -h;
            along.fixed_view_mut::<3, 3>(VELOCITY, ATTITUDE).copy_from(&push);
            along.fixed_view_mut::<3, 3>(VELOCITY, ACCEL_BIAS).copy_from(&(axes * -h));
            let falls = skew(&self.estimate.gravity()).fixed_columns::<2>(0) * -h;
            along.fixed_view_mut::<3, 2>(VELOCITY, TILT).copy_from(&falls);
            along.fixed_view_mut::<3, 2>(POSITION, TILT).copy_from(&(falls * (0.5 * h)));
            along.fixed_view_mut::<3, 3>(POSITION, ATTITUDE).copy_from(&(push * (0.5 * h)));
            along.fixed_view_mut::<3, 3>(POSITION, ACCEL_BIAS).copy_from(&(axes * (-0.5 * h * h)));
        }
        along[(OFFSET, RATE)] = h;
        self.covariance = along * self.covariance * along.transpose();
        let comes = [
            (ATTITUDE, (interval.gyro_sigma * h).powi(2)),
            (POSITION, (0.5 * interval.accel_sigma * h * h).powi(2)),
            (VELOCITY, (interval.accel_sigma * h).powi(2)),
            (GYRO_BIAS, self.gyro_walk.powi(2) * h),
            (ACCEL_BIAS, self.accel_walk.powi(2) * h),
        ];
        for (at, variance) in comes {
            (at..at + 3).for_each(|k| self.covariance[(k, k)] += variance);
        }
        self.covariance[(RATE, RATE)] += RATE_WALK * RATE_WALK * h;
        self.estimate = self.estimate.after(interval);
        along
    }

    /// Is corrected by what the fixes say. One far beyond what is expected counts as less certain, by Huber's weight.
    pub(super) fn correct(&mut self, difference: &Difference) {
        let mut shown = Shown::zeros();
        shown.fixed_view_mut::<3, 3>(0, ATTITUDE).copy_from(&Matrix3::identity());
        shown.fixed_view_mut::<3, 3>(3, POSITION).copy_from(&Matrix3::identity());
        shown.fixed_view_mut::<3, 3>(3, VELOCITY).copy_from(&(Matrix3::identity() * -difference.ago_s));
        shown.fixed_view_mut::<3, 1>(0, OFFSET).copy_from(&difference.turning);
        shown.fixed_view_mut::<3, 1>(3, OFFSET).copy_from(&self.estimate.state.velocity);
        let mut seen = SVector::<f64, 6>::zeros();
        seen.fixed_rows_mut::<3>(0).copy_from(&difference.turn);
        seen.fixed_rows_mut::<3>(3).copy_from(&difference.shift);
        let FixSigmas { position_m, rotation_rad } = difference.sigmas;
        let mut noise = SMatrix::<f64, 6, 6>::zeros();
        for k in 0..3 {
            (noise[(k, k)], noise[(k + 3, k + 3)]) = (rotation_rad * rotation_rad, position_m * position_m);
        }
        let expected = shown * self.covariance * shown.transpose();
        let Some(whole) = (expected + noise).cholesky() else { return };
        let far = (seen.dot(&whole.solve(&seen))).sqrt() / BELIEVED;
        let noise = noise * far.max(1.0);
        let Some(whole) = (expected + noise).cholesky() else { return };
        let gain = whole.solve(&(shown * self.covariance)).transpose();
        self.estimate = self.estimate.plus(&(gain * seen));
        // Joseph's form stays positive.
        let kept = Square::identity() - gain * shown;
        self.covariance = kept * self.covariance * kept.transpose() + gain * noise * gain.transpose();
    }

    /// Standard deviation of the clock's offset, s.
    pub(super) fn offset_sigma_s(&self) -> f64 {
        self.covariance[(OFFSET, OFFSET)].sqrt()
    }
}
