//! Propagation of the errors between epochs.

use super::epoch::Epoch;
use super::model::{BoundModel, EPOCH};
use super::state::{
    ACCEL_BIAS, ACCEL_MATRIX, ATTITUDE, CHANGING, CLOCK, CLOCK_RATE, CONSTANT, GYRO_BIAS, GYRO_MATRIX, N, POSITION,
    SUMS, State, VELOCITY,
};
use nalgebra::SMatrix;
use zsim_base::geometry::{Matrix, Vector, skew};

/// Jacobian of a reported error (attitude or position of the head, in lidar time) with respect to the state.
pub(super) type OutputJacobian = SMatrix<f64, 3, N>;

/// Factor on the IMU noise in an epoch without IMU samples: large enough that the IMU gives no information.
const MISSING_IMU_FACTOR: f64 = 1e4;

/// Propagation from one epoch to the next.
pub(super) struct Step {
    /// `F`, the propagation of the errors: the rows from [`CHANGING`] on are those of the identity.
    pub transition: State,
    /// `Q`, the covariance of the process noise.
    pub noise: State,
}

impl Step {
    /// The step between two epochs.
    ///
    /// `middle_in_world` is the centre of the trajectory, `since_start_s` the time of the first epoch.
    pub(super) fn between(
        model: &BoundModel,
        from: &Epoch,
        to: &Epoch,
        middle_in_world: &Vector,
        since_start_s: f64,
    ) -> Self {
        let h = EPOCH.seconds();
        let imu = match (from.mean_imu(), to.mean_imu()) {
            (Some(a), Some(b)) => Some((0.5 * (a.0 + b.0), 0.5 * (a.1 + b.1))),
            (a, b) => a.or(b),
        };
        let noise_factor = if imu.is_some() { 1.0 } else { MISSING_IMU_FACTOR };
        let (rate, force) = imu.unwrap_or_default();
        let halfway = from.world_from_imu.slerp(&to.world_from_imu, 0.5);
        let turned = *halfway.to_rotation_matrix().matrix();
        let pull = skew(&(turned * force));

        let mut transition = State::identity();
        let mut put = |row: usize, column: usize, block: Matrix| {
            transition.fixed_view_mut::<3, 3>(row, column).copy_from(&block);
        };
        // An attitude error rotates the specific force, which changes velocity and position.
        put(VELOCITY, ATTITUDE, -pull * h);
        put(POSITION, ATTITUDE, -pull * (h * h / 2.0));
        put(POSITION, VELOCITY, Matrix::identity() * h);
        // Gyroscope errors act through the attitude, accelerometer errors directly.
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
        let jacobian = position_jacobian(model, from, since_start_s);
        let (sum, moment) = (jacobian, skew(&(head_in_world(model, from) - middle_in_world)) * jacobian);
        let mut sums = transition.fixed_view_mut::<3, N>(SUMS, 0);
        sums += sum;
        let mut moments = transition.fixed_view_mut::<3, N>(SUMS + 3, 0);
        moments += moment;
        Self { transition, noise: noise(model, &pull, noise_factor) }
    }

    /// The covariance `P` of the errors after the step: `F P F^T + Q`.
    pub(super) fn propagate(&self, covariance: &State) -> State {
        let changing = self.transition.fixed_rows::<CHANGING>(0);
        let of_changing = changing * covariance;
        let mut propagated = *covariance;
        propagated.fixed_rows_mut::<CHANGING>(0).copy_from(&of_changing);
        propagated.fixed_columns_mut::<CHANGING>(0).copy_from(&of_changing.transpose());
        propagated.fixed_view_mut::<CHANGING, CHANGING>(0, 0).copy_from(&(of_changing * changing.transpose()));
        propagated + self.noise
    }

    /// `F^T L F`.
    pub(super) fn propagate_back(&self, adjoint: &State) -> State {
        let changing = self.transition.fixed_rows::<CHANGING>(0);
        let mut after = adjoint.fixed_columns::<CHANGING>(0) * changing;
        let mut of_constant = after.fixed_columns_mut::<CONSTANT>(CHANGING);
        of_constant += adjoint.fixed_columns::<CONSTANT>(CHANGING);
        let mut back = changing.transpose() * after.fixed_rows::<CHANGING>(0);
        let mut of_constant = back.fixed_rows_mut::<CONSTANT>(CHANGING);
        of_constant += after.fixed_rows::<CONSTANT>(CHANGING);
        back
    }
}

/// Position of the head at an epoch.
pub(super) fn head_in_world(model: &BoundModel, epoch: &Epoch) -> Vector {
    epoch.position_in_world - arm_in_world(model, epoch)
}

/// Vector from the head to the IMU.
fn arm_in_world(model: &BoundModel, epoch: &Epoch) -> Vector {
    let world_from_head = epoch.world_from_imu * model.head_from_imu.rotation.inverse();
    world_from_head * model.head_from_imu.translation.vector
}

/// Jacobian of the head position error at an epoch, in lidar time.
pub(super) fn position_jacobian(model: &BoundModel, epoch: &Epoch, since_start_s: f64) -> OutputJacobian {
    let arm = arm_in_world(model, epoch);
    let rate = epoch.mean_imu().map_or(Vector::zeros(), |(rate, _)| epoch.world_from_imu * rate);
    let mut jacobian = OutputJacobian::zeros();
    // The head is at -arm from the IMU: dtheta x (-arm).
    jacobian.fixed_view_mut::<3, 3>(0, ATTITUDE).copy_from(&skew(&arm));
    jacobian.fixed_view_mut::<3, 3>(0, POSITION).copy_from(&Matrix::identity());
    with_clock(jacobian, &(epoch.velocity_in_world - rate.cross(&arm)), since_start_s)
}

/// Jacobian of the head attitude error at an epoch, in lidar time.
pub(super) fn attitude_jacobian(epoch: &Epoch, since_start_s: f64) -> OutputJacobian {
    let rate = epoch.mean_imu().map_or(Vector::zeros(), |(rate, _)| epoch.world_from_imu * rate);
    let mut jacobian = OutputJacobian::zeros();
    jacobian.fixed_view_mut::<3, 3>(0, ATTITUDE).copy_from(&Matrix::identity());
    with_clock(jacobian, &rate, since_start_s)
}

fn with_clock(mut jacobian: OutputJacobian, velocity: &Vector, since_start_s: f64) -> OutputJacobian {
    jacobian.column_mut(CLOCK).copy_from(velocity);
    jacobian.column_mut(CLOCK_RATE).copy_from(&(velocity * since_start_s));
    jacobian
}

/// The covariance of the process noise of a step.
///
/// White noise at a time `r` before the end of the step has the following effects. Gyroscope noise: 1 on the attitude,
/// `-[Rf]x r` on the velocity, `-[Rf]x r^2 / 2` on the position. Accelerometer noise: 1 on the velocity, `r` on the
/// position. The integral over `r` uses the three-point Gauss rule, which is exact to the fifth order.
fn noise(model: &BoundModel, pull: &Matrix, factor: f64) -> State {
    let h = EPOCH.seconds();
    let imu = &model.imu;
    let gyro = factor * imu.gyro_density_rad_per_s_per_sqrt_hz;
    let accel = factor * imu.accel_density_m_per_s2_per_sqrt_hz;
    let mut covariance = SMatrix::<f64, 9, 9>::zeros();
    let node_offset = 0.5 * 0.6_f64.sqrt();
    for (node, weight) in [(0.5 - node_offset, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.5 + node_offset, 5.0 / 18.0)] {
        let r = node * h;
        let mut into = SMatrix::<f64, 9, 6>::zeros();
        into.fixed_view_mut::<3, 3>(ATTITUDE, 0).copy_from(&(Matrix::identity() * gyro));
        into.fixed_view_mut::<3, 3>(VELOCITY, 0).copy_from(&(-pull * (r * gyro)));
        into.fixed_view_mut::<3, 3>(POSITION, 0).copy_from(&(-pull * (0.5 * r * r * gyro)));
        into.fixed_view_mut::<3, 3>(VELOCITY, 3).copy_from(&(Matrix::identity() * accel));
        into.fixed_view_mut::<3, 3>(POSITION, 3).copy_from(&(Matrix::identity() * (r * accel)));
        covariance += into * into.transpose() * (weight * h);
    }
    let mut noise = State::zeros();
    noise.fixed_view_mut::<9, 9>(0, 0).copy_from(&covariance);
    for (at, walk) in
        [(GYRO_BIAS, imu.gyro_bias_walk_rad_per_s_per_sqrt_s), (ACCEL_BIAS, imu.accel_bias_walk_m_per_s2_per_sqrt_s)]
    {
        (at..at + 3).for_each(|axis| noise[(axis, axis)] = walk * walk * h);
    }
    noise
}
