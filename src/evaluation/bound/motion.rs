//! How errors move from one epoch to the next.

use super::epoch::Epoch;
use super::state::{
    ACCEL_BIAS, ACCEL_MATRIX, ATTITUDE, CLOCK, CLOCK_RATE, GYRO_BIAS, GYRO_MATRIX, N, POSITION, SUMS, State, VELOCITY,
};
use super::{BoundModel, EPOCH};
use crate::geometry::{Matrix, Vector, skew};
use nalgebra::SMatrix;

/// The part of the state that is reported: attitude and position of the head, in lidar time.
pub(super) type Told = SMatrix<f64, 3, N>;

/// Noise of a missing IMU relative to a working one.
const SILENT: f64 = 1e4;

/// From one epoch to the next.
pub(super) struct Step {
    /// Propagation of the errors.
    pub transition: State,
    /// The covariance of the process noise.
    pub noise: State,
}

impl Step {
    /// The step between two epochs, `middle_in_world` being that of the trajectory, `since_start_s` the first one's
    /// time.
    pub(super) fn between(
        model: &BoundModel,
        (from, to): (&Epoch, &Epoch),
        middle_in_world: &Vector,
        since_start_s: f64,
    ) -> Self {
        let h = EPOCH.seconds();
        let heard = match (from.heard(), to.heard()) {
            (Some(a), Some(b)) => Some((0.5 * (a.0 + b.0), 0.5 * (a.1 + b.1))),
            (a, b) => a.or(b),
        };
        let worse = if heard.is_some() { 1.0 } else { SILENT };
        let (rate, force) = heard.unwrap_or_default();
        let halfway = from.world_from_imu.slerp(&to.world_from_imu, 0.5);
        let turned = *halfway.to_rotation_matrix().matrix();
        let pull = skew(&(turned * force));

        let mut transition = State::identity();
        let mut put = |row: usize, column: usize, block: Matrix| {
            transition.fixed_view_mut::<3, 3>(row, column).copy_from(&block);
        };
        // The force's lever: attitude bends velocity and position.
        put(VELOCITY, ATTITUDE, -pull * h);
        put(POSITION, ATTITUDE, -pull * (h * h / 2.0));
        put(POSITION, VELOCITY, Matrix::identity() * h);
        // Errors of the gyroscope by way of attitude, of the accelerometer directly.
        let by_gyro = [(ATTITUDE, -turned * h), (VELOCITY, pull * turned * (h * h / 2.0))];
        let by_gyro = [by_gyro[0], by_gyro[1], (POSITION, pull * turned * (h * h * h / 6.0))];
        let by_accel = [(VELOCITY, -turned * h), (POSITION, -turned * (h * h / 2.0))];
        by_gyro.iter().for_each(|(row, block)| put(*row, GYRO_BIAS, *block));
        by_accel.iter().for_each(|(row, block)| put(*row, ACCEL_BIAS, *block));
        for axis in 0..3 {
            // (M w)_i = sum_j M_ij w_j: row i of the matrix acts through column i of the block.
            let through = |block: &Matrix, reading: &Vector| block.column(axis) * reading.transpose();
            by_gyro.iter().for_each(|(row, block)| put(*row, GYRO_MATRIX + 3 * axis, through(block, &rate)));
            by_accel.iter().for_each(|(row, block)| put(*row, ACCEL_MATRIX + 3 * axis, through(block, &force)));
        }
        let told = position_told(model, from, since_start_s);
        let (sum, moment) = (told, skew(&(head_in_world(model, from) - middle_in_world)) * told);
        let mut sums = transition.fixed_view_mut::<3, N>(SUMS, 0);
        sums += sum;
        let mut moments = transition.fixed_view_mut::<3, N>(SUMS + 3, 0);
        moments += moment;
        Self { transition, noise: noise(model, &pull, worse) }
    }
}

/// Where the head is at an epoch.
pub(super) fn head_in_world(model: &BoundModel, epoch: &Epoch) -> Vector {
    epoch.position_in_world - arm_in_world(model, epoch)
}

/// From the head to the IMU.
fn arm_in_world(model: &BoundModel, epoch: &Epoch) -> Vector {
    let world_from_head = epoch.world_from_imu * model.head_from_imu.rotation.inverse();
    world_from_head * model.head_from_imu.translation.vector
}

/// The error of the head's position at an epoch, in lidar time.
pub(super) fn position_told(model: &BoundModel, epoch: &Epoch, since_start_s: f64) -> Told {
    let arm = arm_in_world(model, epoch);
    let rate = epoch.heard().map_or(Vector::zeros(), |(rate, _)| epoch.world_from_imu * rate);
    let mut told = Told::zeros();
    // The head is at -arm from the IMU: dtheta x (-arm).
    told.fixed_view_mut::<3, 3>(0, ATTITUDE).copy_from(&skew(&arm));
    told.fixed_view_mut::<3, 3>(0, POSITION).copy_from(&Matrix::identity());
    with_clock(told, &(epoch.velocity_in_world - rate.cross(&arm)), since_start_s)
}

/// The error of the head's attitude at an epoch, in lidar time.
pub(super) fn attitude_told(epoch: &Epoch, since_start_s: f64) -> Told {
    let rate = epoch.heard().map_or(Vector::zeros(), |(rate, _)| epoch.world_from_imu * rate);
    let mut told = Told::zeros();
    told.fixed_view_mut::<3, 3>(0, ATTITUDE).copy_from(&Matrix::identity());
    with_clock(told, &rate, since_start_s)
}

fn with_clock(mut told: Told, velocity: &Vector, since_start_s: f64) -> Told {
    told.column_mut(CLOCK).copy_from(velocity);
    told.column_mut(CLOCK_RATE).copy_from(&(velocity * since_start_s));
    told
}

/// The covariance of the process noise of a step: white noise `r` before the end has moved attitude by
/// itself, velocity by `-[Rf]x r` and position by `-[Rf]x r^2 / 2` of it (gyroscope), or velocity by itself and
/// position by `r` (accelerometer). Integrated over `r` by Gauss' rule of three points, exact to the fifth order.
fn noise(model: &BoundModel, pull: &Matrix, worse: f64) -> State {
    let h = EPOCH.seconds();
    let imu = &model.imu;
    let gyro = worse * imu.gyro_density_rad_per_s_per_sqrt_hz;
    let accel = worse * imu.accel_density_m_per_s2_per_sqrt_hz;
    let mut moved = SMatrix::<f64, 9, 9>::zeros();
    let beside = 0.5 * 0.6_f64.sqrt();
    for (place, weight) in [(0.5 - beside, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.5 + beside, 5.0 / 18.0)] {
        let r = place * h;
        let mut into = SMatrix::<f64, 9, 6>::zeros();
        into.fixed_view_mut::<3, 3>(ATTITUDE, 0).copy_from(&(Matrix::identity() * gyro));
        into.fixed_view_mut::<3, 3>(VELOCITY, 0).copy_from(&(-pull * (r * gyro)));
        into.fixed_view_mut::<3, 3>(POSITION, 0).copy_from(&(-pull * (0.5 * r * r * gyro)));
        into.fixed_view_mut::<3, 3>(VELOCITY, 3).copy_from(&(Matrix::identity() * accel));
        into.fixed_view_mut::<3, 3>(POSITION, 3).copy_from(&(Matrix::identity() * (r * accel)));
        moved += into * into.transpose() * (weight * h);
    }
    let mut noise = State::zeros();
    noise.fixed_view_mut::<9, 9>(0, 0).copy_from(&moved);
    for (at, walk) in
        [(GYRO_BIAS, imu.gyro_bias_walk_rad_per_s_per_sqrt_s), (ACCEL_BIAS, imu.accel_bias_walk_m_per_s2_per_sqrt_s)]
    {
        (at..at + 3).for_each(|axis| noise[(axis, axis)] = walk * walk * h);
    }
    noise
}
