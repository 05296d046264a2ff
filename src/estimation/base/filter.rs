//! Error-state Kalman filter of the base's IMU.
//!
//! The attitude error is a small rotation in world axes, `R = exp(theta) R^`; all other errors are additive. Strapdown
//! integration over an interval `h` with mean angular rate `w` and specific force `f` (biases `b`, `c`; `R` at mid-interval)
//! propagates the errors as
//!
//! ```text
//! theta' = theta - R h b        v' = v - [R f h]x theta - R h c - h [g]x tilt        p' = p + h v'(mean)
//! l'     = l + h l_rate
//! ```
//!
//! A fix, interpolated at `u - l` for the IMU time `u`, measures `theta + omega l` and `p + v l`.

use super::fixes::FixSigmas;
use crate::EstimatorSpec;
use crate::clock::RATE_WALK_PER_SQRT_S;
use crate::strapdown::{Biases, Interval, State};
use nalgebra::{Matrix3, SMatrix, SVector};
use zsim_base::geometry::{Pose, Rotation, Vector, gravity_in_world, skew};
use zsim_base::measurement::ImuNoise;

/// Time between two updates of the filter, s: the averaging time of [`FixSigmas`].
pub(super) const EPOCH_S: f64 = 0.05;

/// Dimension of the error state: attitude, position, velocity, two biases (3 each), clock offset, clock rate, gravity tilt (2).
const STATES: usize = 19;
const ATTITUDE: usize = 0;
const POSITION: usize = 3;
const VELOCITY: usize = 6;
const GYRO_BIAS: usize = 9;
const ACCEL_BIAS: usize = 12;
const CLOCK_OFFSET: usize = 15;
const CLOCK_RATE: usize = 16;
const TILT: usize = 17;

/// Initial standard deviation of the velocity, m/s: error of the difference quotient of two fixes.
const START_VELOCITY: f64 = 0.5;
/// Initial standard deviation of the clock offset, s: the accuracy of the search.
const START_OFFSET_S: f64 = 5e-3;
/// Initial standard deviation of the direction of gravity in the world, rad: levelling error of the map.
const START_TILT: f64 = 5e-3;
/// Huber threshold on the Mahalanobis norm of the six-dimensional innovation.
const HUBER_THRESHOLD: f64 = 5.0;

pub(super) type ErrorState = SVector<f64, STATES>;
pub(super) type ErrorMatrix = SMatrix<f64, STATES, STATES>;
type MeasurementMatrix = SMatrix<f64, 6, STATES>;

/// Estimated state at one time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Estimate {
    pub(super) state: State,
    pub(super) biases: Biases,
    /// Clock offset: IMU stamp minus fix stamp of the same event, s.
    pub(super) offset_s: f64,
    /// Rate of the clock offset, s/s.
    pub(super) rate: f64,
    /// Rotation of gravity from -z about the x and y axes of the world, rad; the z component is zero.
    pub(super) tilt: Vector,
}

impl Estimate {
    /// Adds an error state.
    pub(super) fn plus(&self, errors: &ErrorState) -> Self {
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
            offset_s: self.offset_s + errors[CLOCK_OFFSET],
            rate: self.rate + errors[CLOCK_RATE],
            tilt: self.tilt + Vector::new(errors[TILT], errors[TILT + 1], 0.0),
        }
    }

    /// Error state of `self` relative to `other`.
    pub(super) fn minus(&self, other: &Self) -> ErrorState {
        let mut errors = ErrorState::zeros();
        let rotation = (self.state.rotation * other.state.rotation.inverse()).scaled_axis();
        errors.fixed_rows_mut::<3>(ATTITUDE).copy_from(&rotation);
        errors.fixed_rows_mut::<3>(POSITION).copy_from(&(self.state.position - other.state.position));
        errors.fixed_rows_mut::<3>(VELOCITY).copy_from(&(self.state.velocity - other.state.velocity));
        errors.fixed_rows_mut::<3>(GYRO_BIAS).copy_from(&(self.biases.gyro - other.biases.gyro));
        errors.fixed_rows_mut::<3>(ACCEL_BIAS).copy_from(&(self.biases.accel - other.biases.accel));
        (errors[CLOCK_OFFSET], errors[CLOCK_RATE]) = (self.offset_s - other.offset_s, self.rate - other.rate);
        (errors[TILT], errors[TILT + 1]) = (self.tilt.x - other.tilt.x, self.tilt.y - other.tilt.y);
        errors
    }

    /// Gravity in the world, m/s^2.
    pub(super) fn gravity(&self) -> Vector {
        Rotation::from_scaled_axis(self.tilt) * gravity_in_world()
    }

    /// Propagates the state by one interval.
    pub(super) fn propagated(&self, interval: &Interval) -> Self {
        let state = self.state.after(interval, &self.biases, &self.gravity());
        Self { state, offset_s: self.offset_s + self.rate * interval.h, ..*self }
    }
}

/// Mean innovation of the fixes of one epoch: rotation (rad) and translation (m) in world axes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Innovation {
    pub(super) rotation: Vector,
    pub(super) translation: Vector,
    /// Angular velocity in the world, rad/s.
    pub(super) angular_velocity: Vector,
    /// Time from the mean fix to the end of the epoch, s.
    pub(super) ago_s: f64,
    pub(super) sigmas: FixSigmas,
}

/// Filter state at one time.
#[derive(Debug, Clone)]
pub(super) struct Filter {
    pub(super) estimate: Estimate,
    pub(super) covariance: ErrorMatrix,
    gyro_walk: f64,
    accel_walk: f64,
}

impl Filter {
    /// Initialises the filter at the fix `pose`, with the given velocity (m/s) and clock offset.
    pub(super) fn starting_at(
        pose: Pose,
        sigmas: FixSigmas,
        velocity: Vector,
        offset_s: f64,
        noise: &ImuNoise,
        spec: &EstimatorSpec,
    ) -> Self {
        let state = State { rotation: pose.rotation, position: pose.translation.vector, velocity };
        let biases = Biases { gyro: Vector::zeros(), accel: Vector::zeros() };
        let mut deviations = ErrorState::zeros();
        let parts = [
            (ATTITUDE, 3.0 * sigmas.rotation_rad),
            (POSITION, 3.0 * sigmas.position_m),
            (VELOCITY, START_VELOCITY),
            (GYRO_BIAS, noise.gyro_turn_on_bias_rad_per_s.max(1e-6)),
            (ACCEL_BIAS, noise.accel_turn_on_bias_m_per_s2.max(1e-4)),
        ];
        parts.iter().for_each(|(at, sigma)| deviations.fixed_rows_mut::<3>(*at).fill(*sigma));
        deviations.fixed_rows_mut::<2>(TILT).fill(START_TILT);
        (deviations[CLOCK_OFFSET], deviations[CLOCK_RATE]) = (START_OFFSET_S, (spec.clock.drift_ppm * 1e-6).max(1e-9));
        Self {
            estimate: Estimate { state, biases, offset_s, rate: 0.0, tilt: Vector::zeros() },
            covariance: ErrorMatrix::from_diagonal(&deviations.map(|sigma| sigma * sigma)),
            gyro_walk: noise.gyro_bias_walk_rad_per_s_per_sqrt_s.max(1e-9),
            accel_walk: noise.accel_bias_walk_m_per_s2_per_sqrt_s.max(1e-9),
        }
    }

    /// Propagates the filter by one interval; returns the transition matrix of the errors.
    pub(super) fn predict(&mut self, interval: &Interval) -> ErrorMatrix {
        let (h, biases) = (interval.h, self.estimate.biases);
        let middle = self.estimate.state.rotation * Rotation::from_scaled_axis(interval.turn(&biases) * 0.5);
        let axes = middle.to_rotation_matrix().into_inner();
        let mut transition = ErrorMatrix::identity();
        transition.fixed_view_mut::<3, 3>(ATTITUDE, GYRO_BIAS).copy_from(&(axes * -h));
        transition.fixed_view_mut::<3, 3>(POSITION, VELOCITY).copy_from(&(Matrix3::identity() * h));
        if !interval.bridged {
            let by_force = skew(&(middle * interval.force_in_middle(&biases))) * -h;
            transition.fixed_view_mut::<3, 3>(VELOCITY, ATTITUDE).copy_from(&by_force);
            transition.fixed_view_mut::<3, 3>(VELOCITY, ACCEL_BIAS).copy_from(&(axes * -h));
            let by_gravity = skew(&self.estimate.gravity()).fixed_columns::<2>(0) * -h;
            transition.fixed_view_mut::<3, 2>(VELOCITY, TILT).copy_from(&by_gravity);
            transition.fixed_view_mut::<3, 2>(POSITION, TILT).copy_from(&(by_gravity * (0.5 * h)));
            transition.fixed_view_mut::<3, 3>(POSITION, ATTITUDE).copy_from(&(by_force * (0.5 * h)));
            transition.fixed_view_mut::<3, 3>(POSITION, ACCEL_BIAS).copy_from(&(axes * (-0.5 * h * h)));
        }
        transition[(CLOCK_OFFSET, CLOCK_RATE)] = h;
        self.covariance = transition * self.covariance * transition.transpose();
        let process_noise = [
            (ATTITUDE, (interval.gyro_sigma * h).powi(2)),
            (POSITION, (0.5 * interval.accel_sigma * h * h).powi(2)),
            (VELOCITY, (interval.accel_sigma * h).powi(2)),
            (GYRO_BIAS, self.gyro_walk.powi(2) * h),
            (ACCEL_BIAS, self.accel_walk.powi(2) * h),
        ];
        for (at, variance) in process_noise {
            (at..at + 3).for_each(|k| self.covariance[(k, k)] += variance);
        }
        self.covariance[(CLOCK_RATE, CLOCK_RATE)] += RATE_WALK_PER_SQRT_S * RATE_WALK_PER_SQRT_S * h;
        self.estimate = self.estimate.propagated(interval);
        transition
    }

    /// Updates the filter with an innovation; outliers get a larger variance (Huber weight).
    pub(super) fn correct(&mut self, innovation: &Innovation) {
        let mut jacobian = MeasurementMatrix::zeros();
        jacobian.fixed_view_mut::<3, 3>(0, ATTITUDE).copy_from(&Matrix3::identity());
        jacobian.fixed_view_mut::<3, 3>(3, POSITION).copy_from(&Matrix3::identity());
        jacobian.fixed_view_mut::<3, 3>(3, VELOCITY).copy_from(&(Matrix3::identity() * -innovation.ago_s));
        jacobian.fixed_view_mut::<3, 1>(0, CLOCK_OFFSET).copy_from(&innovation.angular_velocity);
        jacobian.fixed_view_mut::<3, 1>(3, CLOCK_OFFSET).copy_from(&self.estimate.state.velocity);
        let mut residual = SVector::<f64, 6>::zeros();
        residual.fixed_rows_mut::<3>(0).copy_from(&innovation.rotation);
        residual.fixed_rows_mut::<3>(3).copy_from(&innovation.translation);
        let FixSigmas { position_m, rotation_rad } = innovation.sigmas;
        let mut noise = SMatrix::<f64, 6, 6>::zeros();
        for k in 0..3 {
            (noise[(k, k)], noise[(k + 3, k + 3)]) = (rotation_rad * rotation_rad, position_m * position_m);
        }
        let expected = jacobian * self.covariance * jacobian.transpose();
        let Some(cholesky) = (expected + noise).cholesky() else { return };
        let mahalanobis_ratio = (residual.dot(&cholesky.solve(&residual))).sqrt() / HUBER_THRESHOLD;
        let noise = noise * mahalanobis_ratio.max(1.0);
        let Some(cholesky) = (expected + noise).cholesky() else { return };
        let gain = cholesky.solve(&(jacobian * self.covariance)).transpose();
        self.estimate = self.estimate.plus(&(gain * residual));
        // The Joseph form keeps the covariance positive definite.
        let remaining = ErrorMatrix::identity() - gain * jacobian;
        self.covariance = remaining * self.covariance * remaining.transpose() + gain * noise * gain.transpose();
    }

    /// Standard deviation of the clock offset, s.
    pub(super) fn offset_sigma_s(&self) -> f64 {
        self.covariance[(CLOCK_OFFSET, CLOCK_OFFSET)].sqrt()
    }
}
