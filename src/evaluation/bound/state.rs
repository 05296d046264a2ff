//! Layout of the error state.

use super::model::BoundModel;
use nalgebra::{SMatrix, SVector};

/// Number of states.
pub(super) const N: usize = 42;
/// Attitude, velocity and position of the IMU in the world.
pub(super) const ATTITUDE: usize = 0;
pub(super) const VELOCITY: usize = 3;
pub(super) const POSITION: usize = 6;
/// Sums over the run of the position error, and of the moment of it about the trajectory's centre: the terms of the
/// alignment.
pub(super) const SUMS: usize = 9;
/// Number of states that depend on the states of the epoch before, the first ones; the others only take up process noise.
pub(super) const CHANGING: usize = GYRO_BIAS;
/// Number of the other states.
pub(super) const CONSTANT: usize = N - CHANGING;
/// Biases.
pub(super) const GYRO_BIAS: usize = 15;
pub(super) const ACCEL_BIAS: usize = 18;
/// Clock offset at the start, clock rate, and the offset of all ranges.
pub(super) const CLOCK: usize = 21;
pub(super) const CLOCK_RATE: usize = 22;
pub(super) const RANGE: usize = 23;
/// Scale and misalignment, row by row.
pub(super) const GYRO_MATRIX: usize = 24;
pub(super) const ACCEL_MATRIX: usize = 33;

pub(super) type State = SMatrix<f64, N, N>;

/// Prior standard deviations of attitude, rad, velocity, m/s, and position, m: nearly uninformative.
const POSE_PRIOR: [f64; 3] = [1.0, 10.0, 10.0];

/// The prior covariance.
pub(super) fn prior(model: &BoundModel) -> State {
    let mut sigma = SVector::<f64, N>::zeros();
    for (at, value) in [(ATTITUDE, POSE_PRIOR[0]), (VELOCITY, POSE_PRIOR[1]), (POSITION, POSE_PRIOR[2])] {
        sigma.fixed_rows_mut::<3>(at).fill(value);
    }
    sigma.fixed_rows_mut::<3>(GYRO_BIAS).fill(model.imu.gyro_turn_on_bias_rad_per_s);
    sigma.fixed_rows_mut::<3>(ACCEL_BIAS).fill(model.imu.accel_turn_on_bias_m_per_s2);
    sigma[CLOCK] = model.clock_offset_s;
    sigma[CLOCK_RATE] = model.clock_rate;
    sigma[RANGE] = model.range_offset_m;
    for (at, (scale, misalignment)) in [(GYRO_MATRIX, model.gyro_matrix), (ACCEL_MATRIX, model.accel_matrix)] {
        for entry in 0..9 {
            sigma[at + entry] = if entry % 4 == 0 { scale } else { misalignment };
        }
    }
    State::from_diagonal(&sigma.component_mul(&sigma))
}
