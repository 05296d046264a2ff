//! Where an estimate begins: level, biases, and whether the head rested.

use super::clock::Clock;
use super::residual::{
    ACCEL_BIAS, ACCEL_MATRIX, BORDER, CLOCK, CLOCK_RATE, GRAVITY, GYRO_BIAS, GYRO_MATRIX, LIDAR_SHIFT, LIDAR_TURN,
    RANGE,
};
use super::spec::EstimatorSpec;
use super::strapdown::{Biases, Exaggerates, Interval, State};
use crate::geometry::{Pose, Rotation, Vector, gravity_in_world, roll_pitch_yaw};
use crate::measurement::{ImuNoise, LidarCorrection};
use nalgebra::{SMatrix, SVector};

/// Standard deviations of offset (s) and rate of a clock that is not estimated: nothing moves them.
const HELD_CLOCK: (f64, f64) = (1e-9, 1e-12);

/// How exactly poses stand along the gyroscope's axes when the lidar's attitude is estimated, rad.
const GYRO_AXES_SIGMA: f64 = 1e-6;

/// For so long a head goes on as it went before the IMU fell silent, s.
const ON_ITS_WAY_S: f64 = 2.0;

/// A sample's deviation from the mean, as a multiple of its noise, up to which the head is at rest.
const REST_SIGMAS: f64 = 6.0;
/// No IMU at rest is noisier than it was told by more than this factor: what scatters more moves.
const MOST_NOISIER: f64 = 20.0;

/// The state at the first instant, and what is believed of it.
#[derive(Debug, Clone)]
pub(super) struct Beginning {
    pub(super) state: State,
    pub(super) biases: Biases,
    /// Standard deviation of the velocity, m/s.
    pub(super) velocity_sigma: f64,
    /// What is known of the border.
    pub(super) information: SMatrix<f64, BORDER, BORDER>,
    /// What the IMU says while the head rests, if it does.
    pub(super) rest: Option<Rest>,
    /// How many times noisier than it was told the IMU is at rest; 1 of one that is not.
    pub(super) noisier: Noisier,
}

/// By how much the noise of gyroscope and accelerometer exceeds what was told of it: factors, 1 or more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Noisier {
    pub(super) gyro: f64,
    pub(super) accel: f64,
}

/// The head at rest: what the IMU says then, by which the end of the rest is seen.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rest {
    gyro: Vector,
    force: Vector,
}

/// What an estimate knew when the IMU fell silent, from which it begins again.
#[derive(Debug, Clone)]
pub(super) struct Carried {
    /// When it fell silent, IMU time, s.
    pub(super) until_s: f64,
    pub(super) state: State,
    /// Velocity of the window's whole way, m/s: a head that rocks goes where its mean velocity takes it.
    pub(super) mean_velocity: Vector,
    pub(super) biases: Biases,
    pub(super) gravity: Vector,
    pub(super) clock: Clock,
    /// By how much the IMU exaggerates.
    pub(super) exaggerates: Exaggerates,
    /// What is known of the lidar beyond its calibration.
    pub(super) lidar: LidarCorrection,
}

impl Beginning {
    /// The same beginning at `start_s`, IMU time, where an estimate had stopped: level as the force says now, the
    /// heading as it was, and the place to which it was on its way.
    pub(super) fn going_on_from(mut self, carried: &Carried, start_s: f64) -> Self {
        let yaw = |rotation: &Rotation| roll_pitch_yaw(rotation).2;
        let turn = yaw(&carried.state.rotation) - yaw(&self.state.rotation);
        self.state.rotation = Rotation::from_axis_angle(&Vector::z_axis(), turn) * self.state.rotation;
        let seconds = (start_s - carried.until_s).clamp(0.0, ON_ITS_WAY_S);
        self.state.position = carried.state.position + carried.mean_velocity * seconds;
        if self.rest.is_none() {
            self.state.velocity = carried.mean_velocity;
        }
        self.biases = carried.biases;
        self
    }
}

impl Noisier {
    /// As it was told.
    pub(super) const NOT: Self = Self { gyro: 1.0, accel: 1.0 };

    /// By the differences of successive intervals, which motion hardly changes (von Neumann's estimate of the
    /// variance).
    fn seen_in(intervals: &[Interval]) -> Self {
        let factor = |of: fn(&Interval) -> (Vector, f64)| {
            let square = |pair: &[Interval]| {
                let ((a, a_sigma), (b, b_sigma)) = (of(&pair[0]), of(&pair[1]));
                (b - a).norm_squared() / (3.0 * (a_sigma.powi(2) + b_sigma.powi(2)))
            };
            let mean = intervals.windows(2).map(square).sum::<f64>() / (intervals.len() as f64 - 1.0).max(1.0);
            mean.sqrt().clamp(1.0, MOST_NOISIER)
        };
        Self { gyro: factor(|i| (i.gyro, i.gyro_sigma)), accel: factor(|i| (i.accel, i.accel_sigma)) }
    }

    /// The noise of an IMU that is so much noisier.
    pub(super) fn raise(self, noise: &mut ImuNoise) {
        noise.gyro_density_rad_per_s_per_sqrt_hz *= self.gyro;
        noise.accel_density_m_per_s2_per_sqrt_hz *= self.accel;
    }

    /// An interval of an IMU that is so much noisier.
    pub(super) fn of(self, interval: Interval) -> Interval {
        let (gyro_sigma, accel_sigma) = (interval.gyro_sigma * self.gyro, interval.accel_sigma * self.accel);
        Interval { gyro_sigma, accel_sigma, ..interval }
    }
}

impl Rest {
    /// A head that rests from `interval` on, if it does.
    pub(super) fn from(interval: &Interval) -> Self {
        Self { gyro: interval.gyro, force: interval.accel }
    }

    /// Whether an interval says the same, within its noise.
    pub(super) fn goes_on(&self, interval: &Interval) -> bool {
        (interval.gyro - self.gyro).norm() < REST_SIGMAS * interval.gyro_sigma
            && (interval.accel - self.force).norm() < REST_SIGMAS * interval.accel_sigma
    }
}

/// Looks at the first intervals: at rest their mean is the gyroscope's bias and the way up. In motion the mean force is
/// taken for the way up all the same, turned back by the gyroscope to where the head began (over a second or more a
/// hand's accelerations cancel), with little trust.
///
/// The map's origin is the head's first position, and its x axis points where the head's does.
///
/// `may_rest` is whether the lidar lets the head rest: one that moves evenly feels the same.
pub(super) fn begin(
    (intervals, may_rest): (&[Interval], bool),
    head_from_imu: &Pose,
    noise: &ImuNoise,
    spec: &EstimatorSpec,
) -> Beginning {
    let duration: f64 = intervals.iter().map(|i| i.h).sum();
    let mean = |of: fn(&Interval) -> Vector| intervals.iter().map(|i| of(i) * i.h).sum::<Vector>() / duration;
    let (gyro, force) = (mean(|i| i.gyro), mean(|i| i.accel));
    let rest = Rest { gyro, force };
    let seen = Noisier::seen_in(intervals);
    let feels_rest = intervals.iter().all(|interval| rest.goes_on(&seen.of(*interval)))
        && gyro.norm() < 5.0 * noise.gyro_turn_on_bias_rad_per_s.max(1e-3);
    let at_rest = may_rest && feels_rest;
    let upward = if at_rest { force } else { mean_force_at_start(intervals) };
    let up = Rotation::rotation_between(&upward, &Vector::z()).unwrap_or_else(Rotation::identity);
    let (_, _, yaw) = roll_pitch_yaw(&(up * head_from_imu.rotation.inverse()));
    let rotation = Rotation::from_axis_angle(&Vector::z_axis(), -yaw) * up;
    let head_in_imu = head_from_imu.inverse().translation.vector;
    let state = State { rotation, position: -(rotation * head_in_imu), velocity: Vector::zeros() };
    let gyro_bias = if at_rest { gyro } else { Vector::zeros() };
    // At rest, what the force is more than gravity is bias; the rest of the bias hides in the level.
    let excess = force.norm() - gravity_in_world().norm();
    let accel_bias = if at_rest { force.normalize() * excess } else { Vector::zeros() };
    let noisier = if at_rest { seen } else { Noisier::NOT };
    let gyro_sigma = if at_rest {
        3.0 * noisier.gyro * noise.gyro_density_rad_per_s_per_sqrt_hz / duration.sqrt()
    } else {
        noise.gyro_turn_on_bias_rad_per_s
    };
    Beginning {
        state,
        biases: Biases { gyro: gyro_bias, accel: accel_bias },
        rest: at_rest.then_some(rest),
        noisier,
        velocity_sigma: match (at_rest, feels_rest) {
            (true, _) => 0.01,
            (false, false) => 2.0,
            // A vehicle under way.
            (false, true) => 10.0,
        },
        information: information(gyro_sigma, at_rest, noise, spec),
    }
}

/// The mean force over `intervals` in the body as it stood at their start: the gyroscope turns it back, so a nod of the
/// head does not tilt it; what is left beside gravity is the change of velocity by the time it took.
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

fn information(
    gyro_sigma: f64,
    at_rest: bool,
    noise: &ImuNoise,
    EstimatorSpec { inertial, clock, surfels, extrinsics, .. }: &EstimatorSpec,
) -> SMatrix<f64, BORDER, BORDER> {
    // A level found in motion is off by the mean acceleration over g, one found at rest by the bias over g.
    let tilt_sigma = if at_rest { 0.02 } else { 0.2 };
    let mut sigmas = [0.0; BORDER];
    sigmas[GYRO_BIAS..GYRO_BIAS + 3].fill(gyro_sigma);
    sigmas[ACCEL_BIAS..ACCEL_BIAS + 3].fill(noise.accel_turn_on_bias_m_per_s2.max(1e-4));
    sigmas[GRAVITY..GRAVITY + 2].fill(tilt_sigma);
    (sigmas[CLOCK], sigmas[CLOCK_RATE]) =
        if clock.estimated { (clock.start_sigma_s, (clock.drift_ppm * 1e-6).max(1e-9)) } else { HELD_CLOCK };
    // What is left at zero is held there.
    sigmas[RANGE] = surfels.range_offset_sigma_m.max(1e-9);
    let (turn, shift) = extrinsics.sigmas();
    sigmas[LIDAR_TURN..LIDAR_TURN + 3].fill(turn.max(1e-9));
    sigmas[LIDAR_SHIFT..LIDAR_SHIFT + 3].fill(shift.max(1e-9));
    sigmas[GYRO_MATRIX..GYRO_MATRIX + 9].fill(inertial.gyro_matrix_sigma.max(1e-9));
    sigmas[ACCEL_MATRIX..ACCEL_MATRIX + 9].fill(inertial.accel_matrix_sigma.max(1e-9));
    let mut information = SMatrix::from_diagonal(&SVector::from(sigmas.map(|sigma| sigma.powi(-2))));
    if extrinsics.estimated {
        // Against what is the lidar turned? Poses then stand along the axes about which the gyroscope measures.
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            let mut turn = SVector::<f64, BORDER>::zeros();
            (turn[GYRO_MATRIX + 3 * i + j], turn[GYRO_MATRIX + 3 * j + i]) = (1.0, -1.0);
            information += turn * turn.transpose() * GYRO_AXES_SIGMA.powi(-2);
        }
    }
    information
}
