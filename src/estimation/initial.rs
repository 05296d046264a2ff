//! Initial state: attitude, biases, and detection of an initial rest.

use super::coasting::Coasting;
use super::spec::EstimatorSpec;
use super::strapdown::{Biases, ImuScaleMisalignment, Interval, State};
use super::unknowns::Unknowns;
use crate::layout::{
    ACCEL_BIAS, ACCEL_MATRIX, BORDER, CLOCK, CLOCK_RATE, GRAVITY, GYRO_BIAS, GYRO_MATRIX, LIDAR_ROTATION,
    LIDAR_TRANSLATION, RANGE,
};
use nalgebra::{SMatrix, SVector};
use zsim_base::geometry::{Pose, Rotation, Vector, gravity_in_world, roll_pitch_yaw};
use zsim_base::measurement::ImuNoise;

/// Standard deviations of offset (s) and rate (s/s) if the clock is not estimated: small enough to fix both.
const FIXED_CLOCK_SIGMA: (f64, f64) = (1e-9, 1e-12);

/// If the lidar attitude is estimated, the IMU frame is that of the gyroscope axes, to this standard deviation, rad.
const GYRO_AXES_SIGMA: f64 = 1e-6;

/// The mean velocity from before an IMU gap is extrapolated for at most this long, s.
const MAX_COASTING_S: f64 = 2.0;

/// At rest, a sample deviates from the mean by less than this multiple of the noise.
const REST_SIGMAS: f64 = 6.0;
/// Upper limit of the factor between measured noise at rest and specified noise; more scatter is motion.
const MAX_NOISE_FACTOR: f64 = 20.0;

/// The initial state and the prior on it.
#[derive(Debug, Clone)]
pub(super) struct InitialState {
    pub(super) state: State,
    pub(super) biases: Biases,
    /// Standard deviation of the velocity, m/s.
    pub(super) velocity_sigma: f64,
    /// Prior information on the border unknowns.
    pub(super) information: SMatrix<f64, BORDER, BORDER>,
    /// IMU readings at rest, if the head rests at the start.
    pub(super) rest: Option<RestReadings>,
    /// Measured noise at rest relative to the specification; 1 if the head does not rest.
    pub(super) noise_factors: NoiseFactors,
}

/// Ratio of the measured to the specified noise of gyroscope and accelerometer, at least 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NoiseFactors {
    pub(super) gyro: f64,
    pub(super) accel: f64,
}

/// Mean IMU readings at rest, with which the end of the rest is detected.
#[derive(Debug, Clone, Copy)]
pub(super) struct RestReadings {
    gyro: Vector,
    force: Vector,
}

/// The states at the start of an IMU gap, which initialise the estimate after it.
#[derive(Debug, Clone)]
pub(super) struct StateBeforeGap {
    /// Start of the gap, IMU time, s.
    pub(super) until_s: f64,
    pub(super) state: State,
    /// Mean velocity over the window, m/s: it predicts the position of a rocking head better than the last velocity.
    pub(super) mean_velocity: Vector,
    pub(super) unknowns: Unknowns,
}

impl InitialState {
    /// Combines this state at `start_s`, IMU time, with the state before a gap.
    ///
    /// Roll and pitch are from the accelerometer after the gap, the heading is that before it, and the position is
    /// extrapolated with the mean velocity.
    pub(super) fn continued_from(mut self, carried: &StateBeforeGap, start_s: f64) -> Self {
        let yaw = |rotation: &Rotation| roll_pitch_yaw(rotation).2;
        let turn = yaw(&carried.state.rotation) - yaw(&self.state.rotation);
        self.state.rotation = Rotation::from_axis_angle(&Vector::z_axis(), turn) * self.state.rotation;
        let seconds = (start_s - carried.until_s).clamp(0.0, MAX_COASTING_S);
        self.state.position = carried.state.position + carried.mean_velocity * seconds;
        if self.rest.is_none() {
            self.state.velocity = carried.mean_velocity;
        }
        self.biases = carried.unknowns.biases;
        self
    }

    /// Replaces this state by that before a lidar gap, propagated through the gap with the IMU.
    pub(super) fn after_coasting(mut self, carried: &StateBeforeGap, coasting: &Coasting) -> Self {
        let Unknowns { biases, gravity, scale_misalignment, .. } = &carried.unknowns;
        let propagate = |state: State, interval: &Interval| {
            state.after(&interval.corrected_by(scale_misalignment), biases, gravity)
        };
        let predicted = coasting.intervals().iter().fold(carried.state, propagate);
        let velocity = if self.rest.is_some() { self.state.velocity } else { predicted.velocity };
        self.state = State { velocity, ..predicted };
        self.biases = *biases;
        self
    }
}

impl NoiseFactors {
    /// Noise as specified.
    pub(super) const ONE: Self = Self { gyro: 1.0, accel: 1.0 };

    /// Estimates the factors from differences of successive intervals, on which slow motion has little effect (von
    /// Neumann's variance estimate).
    fn estimated_from(intervals: &[Interval]) -> Self {
        let factor = |of: fn(&Interval) -> (Vector, f64)| {
            let square = |pair: &[Interval]| {
                let ((a, a_sigma), (b, b_sigma)) = (of(&pair[0]), of(&pair[1]));
                (b - a).norm_squared() / (3.0 * (a_sigma.powi(2) + b_sigma.powi(2)))
            };
            let mean = intervals.windows(2).map(square).sum::<f64>() / (intervals.len() as f64 - 1.0).max(1.0);
            mean.sqrt().clamp(1.0, MAX_NOISE_FACTOR)
        };
        Self { gyro: factor(|i| (i.gyro, i.gyro_sigma)), accel: factor(|i| (i.accel, i.accel_sigma)) }
    }

    /// Multiplies the noise densities by the factors.
    pub(super) fn scale_noise(self, noise: &mut ImuNoise) {
        noise.gyro_density_rad_per_s_per_sqrt_hz *= self.gyro;
        noise.accel_density_m_per_s2_per_sqrt_hz *= self.accel;
    }

    /// The interval with the standard deviations multiplied by the factors.
    pub(super) fn scale(self, interval: Interval) -> Interval {
        let (gyro_sigma, accel_sigma) = (interval.gyro_sigma * self.gyro, interval.accel_sigma * self.accel);
        Interval { gyro_sigma, accel_sigma, ..interval }
    }
}

impl RestReadings {
    /// The readings of a possible rest that starts with `interval`.
    pub(super) fn from(interval: &Interval) -> Self {
        Self { gyro: interval.gyro, force: interval.accel }
    }

    /// Whether an interval agrees with the readings at rest, within the noise.
    pub(super) fn agrees_with(&self, interval: &Interval) -> bool {
        (interval.gyro - self.gyro).norm() < REST_SIGMAS * interval.gyro_sigma
            && (interval.accel - self.force).norm() < REST_SIGMAS * interval.accel_sigma
    }
}

/// Estimates the initial state from the first intervals.
///
/// At rest, the mean rate is the gyroscope bias and the mean specific force points up. In motion the mean specific force,
/// rotated to the initial attitude with the gyroscope, also gives the vertical, with a large standard deviation: the
/// accelerations of a hand cancel over a second or more.
///
/// The origin of the map is the first position of the head; the x axis is the initial heading.
///
/// `may_rest`: the lidar does not exclude a rest. To the IMU, constant velocity looks like rest.
pub(super) fn estimate(
    intervals: &[Interval],
    may_rest: bool,
    head_from_imu: &Pose,
    noise: &ImuNoise,
    spec: &EstimatorSpec,
) -> InitialState {
    let duration: f64 = intervals.iter().map(|i| i.h).sum();
    let mean = |of: fn(&Interval) -> Vector| intervals.iter().map(|i| of(i) * i.h).sum::<Vector>() / duration;
    let (gyro, force) = (mean(|i| i.gyro), mean(|i| i.accel));
    let rest = RestReadings { gyro, force };
    let measured_factors = NoiseFactors::estimated_from(intervals);
    let imu_rests = intervals.iter().all(|interval| rest.agrees_with(&measured_factors.scale(*interval)))
        && gyro.norm() < 5.0 * noise.gyro_turn_on_bias_rad_per_s.max(1e-3);
    let at_rest = may_rest && imu_rests;
    let upward = if at_rest { force } else { mean_force_at_start(intervals) };
    let up = Rotation::rotation_between(&upward, &Vector::z()).unwrap_or_else(Rotation::identity);
    let (_, _, yaw) = roll_pitch_yaw(&(up * head_from_imu.rotation.inverse()));
    let rotation = Rotation::from_axis_angle(&Vector::z_axis(), -yaw) * up;
    let head_in_imu = head_from_imu.inverse().translation.vector;
    let state = State { rotation, position: -(rotation * head_in_imu), velocity: Vector::zeros() };
    let gyro_bias = if at_rest { gyro } else { Vector::zeros() };
    // At rest, the specific force in excess of gravity is bias; the horizontal bias is not separable from the tilt.
    let excess = force.norm() - gravity_in_world().norm();
    let accel_bias = if at_rest { force.normalize() * excess } else { Vector::zeros() };
    let noise_factors = if at_rest { measured_factors } else { NoiseFactors::ONE };
    let gyro_sigma = if at_rest {
        3.0 * noise_factors.gyro * noise.gyro_density_rad_per_s_per_sqrt_hz / duration.sqrt()
    } else {
        noise.gyro_turn_on_bias_rad_per_s
    };
    InitialState {
        state,
        biases: Biases { gyro: gyro_bias, accel: accel_bias },
        rest: at_rest.then_some(rest),
        noise_factors,
        velocity_sigma: match (at_rest, imu_rests) {
            (true, _) => 0.01,
            (false, false) => 2.0,
            // Constant velocity, as of a vehicle.
            (false, true) => 10.0,
        },
        information: information(gyro_sigma, at_rest, noise, spec),
    }
}

/// Mean specific force over `intervals`, in the body frame at the start.
///
/// The gyroscope rotates each reading into that frame, so a nod of the head causes no tilt. The remaining error is the
/// change of velocity divided by the duration.
fn mean_force_at_start(intervals: &[Interval]) -> Vector {
    let mut start_from_body = Rotation::identity();
    let mut impulse = Vector::zeros();
    for interval in intervals {
        let half_turn = Rotation::from_scaled_axis(interval.gyro * (0.5 * interval.h));
        impulse += start_from_body * (half_turn * interval.accel) * interval.h;
        start_from_body *= half_turn * half_turn;
    }
    impulse / intervals.iter().map(|interval| interval.h).sum::<f64>()
}

/// Prior information on the border unknowns.
fn information(
    gyro_sigma: f64,
    at_rest: bool,
    noise: &ImuNoise,
    EstimatorSpec { inertial, clock, surfels, extrinsics, .. }: &EstimatorSpec,
) -> SMatrix<f64, BORDER, BORDER> {
    // The tilt error is the mean acceleration over g in motion, and the accelerometer bias over g at rest.
    let tilt_sigma = if at_rest { 0.02 } else { 0.2 };
    let mut sigmas = [0.0; BORDER];
    sigmas[GYRO_BIAS..GYRO_BIAS + 3].fill(gyro_sigma);
    sigmas[ACCEL_BIAS..ACCEL_BIAS + 3].fill(noise.accel_turn_on_bias_m_per_s2.max(1e-4));
    sigmas[GRAVITY..GRAVITY + 2].fill(tilt_sigma);
    (sigmas[CLOCK], sigmas[CLOCK_RATE]) =
        if clock.estimated { (clock.start_sigma_s, (clock.drift_ppm * 1e-6).max(1e-9)) } else { FIXED_CLOCK_SIGMA };
    // An unknown with a sigma of zero is fixed.
    sigmas[RANGE] = surfels.range_offset_sigma_m.max(1e-9);
    let (turn, shift) = extrinsics.sigmas();
    sigmas[LIDAR_ROTATION..LIDAR_ROTATION + 3].fill(turn.max(1e-9));
    sigmas[LIDAR_TRANSLATION..LIDAR_TRANSLATION + 3].fill(shift.max(1e-9));
    let of_model = ImuScaleMisalignment::sigmas_of(noise);
    let least = inertial.matrix_sigma;
    for (start, of_model) in [(GYRO_MATRIX, of_model.gyro), (ACCEL_MATRIX, of_model.accel)] {
        let sigma = |of_model: f64| if least > 0.0 { of_model.max(least) } else { 1e-9 };
        // The entries are in the order of rows.
        of_model.transpose().iter().zip(&mut sigmas[start..start + 9]).for_each(|(model, into)| *into = sigma(*model));
    }
    let mut information = SMatrix::from_diagonal(&SVector::from(sigmas.map(|sigma| sigma.powi(-2))));
    if extrinsics.estimated {
        // The lidar attitude needs a reference: the IMU frame is that of the gyroscope axes.
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            let mut turn = SVector::<f64, BORDER>::zeros();
            (turn[GYRO_MATRIX + 3 * i + j], turn[GYRO_MATRIX + 3 * j + i]) = (1.0, -1.0);
            information += turn * turn.transpose() * GYRO_AXES_SIGMA.powi(-2);
        }
    }
    information
}
