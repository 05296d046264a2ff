//! Information of the IMU on the states of two epochs, and of the priors.

use super::super::model::BoundModel;
use super::super::motion::{OutputJacobian, Step};
use super::super::state::{CLOCK, GYRO_BIAS, SUMS, State};
use nalgebra::{SMatrix, SVector};

/// Number of states of an epoch: attitude, velocity, position, biases.
pub(super) const OWN: usize = 15;
/// Number of constants of the run: clock offset, clock rate, range offset, both matrices of the IMU.
pub(super) const CONSTANTS: usize = 21;
/// States of two epochs and the constants.
pub(super) const STEP: usize = 2 * OWN + CONSTANTS;
/// Indices of the position among the states of an epoch.
pub(super) const POSITION: usize = 6;
/// Index of the attitude about the vertical.
pub(super) const HEADING: usize = 2;

/// Minimum densities of the noise, far below that of any sensor: gyroscope, rad/s/sqrt(Hz), and accelerometer,
/// m/s^2/sqrt(Hz). Less noise makes the information of a step too stiff for double precision.
const MIN_DENSITY: (f64, f64) = (1e-7, 1e-5);
/// Minimum change of a bias by its walk during the run, relative to the turn-on bias.
const MIN_WALK: f64 = 1e-4;
/// Minimum prior standard deviation of constants and biases, in SI units.
const MIN_PRIOR: f64 = 1e-9;

/// Index in the state of the filter of a state of an epoch.
fn own(k: usize) -> usize {
    if k < SUMS { k } else { k - SUMS + GYRO_BIAS }
}

/// Index in the state of the filter of a constant.
fn constant(k: usize) -> usize {
    k + CLOCK
}

/// A model with at least the minimum noise, for a run of `seconds`.
pub(super) fn with_minimum_noise(model: &BoundModel, seconds: f64) -> BoundModel {
    let mut model = model.clone();
    let imu = &mut model.imu;
    imu.gyro_density_rad_per_s_per_sqrt_hz = imu.gyro_density_rad_per_s_per_sqrt_hz.max(MIN_DENSITY.0);
    imu.accel_density_m_per_s2_per_sqrt_hz = imu.accel_density_m_per_s2_per_sqrt_hz.max(MIN_DENSITY.1);
    let walk = |turn_on: f64| MIN_WALK * turn_on.max(MIN_PRIOR) / seconds.sqrt();
    imu.gyro_bias_walk_rad_per_s_per_sqrt_s =
        imu.gyro_bias_walk_rad_per_s_per_sqrt_s.max(walk(imu.gyro_turn_on_bias_rad_per_s));
    imu.accel_bias_walk_m_per_s2_per_sqrt_s =
        imu.accel_bias_walk_m_per_s2_per_sqrt_s.max(walk(imu.accel_turn_on_bias_m_per_s2));
    model
}

/// Information of the IMU on the states of both epochs of a step, and on the constants. `None` if the noise is singular.
pub(super) fn step_information(step: &Step) -> Option<SMatrix<f64, STEP, STEP>> {
    let noise = SMatrix::<f64, OWN, OWN>::from_fn(|i, j| step.noise[(own(i), own(j))]);
    let weight = noise.cholesky()?.inverse();
    // The error of the second epoch minus its prediction.
    let mut jacobian = SMatrix::<f64, OWN, STEP>::zeros();
    for row in 0..OWN {
        (0..OWN).for_each(|k| jacobian[(row, k)] = -step.transition[(own(row), own(k))]);
        (0..CONSTANTS).for_each(|k| jacobian[(row, 2 * OWN + k)] = -step.transition[(own(row), constant(k))]);
        jacobian[(row, OWN + row)] = 1.0;
    }
    Some(jacobian.transpose() * weight * jacobian)
}

/// The columns of a Jacobian of the filter for the states of an epoch, and for the constants.
pub(super) fn columns(jacobian: &OutputJacobian) -> (SMatrix<f64, 3, OWN>, SMatrix<f64, 3, CONSTANTS>) {
    let of_own = SMatrix::from_fn(|row, k| jacobian[(row, own(k))]);
    (of_own, SMatrix::from_fn(|row, k| jacobian[(row, constant(k))]))
}

/// Prior standard deviations of the states of the first epoch, and of the constants, of the covariance of the filter.
pub(super) fn prior_sigmas(prior: &State) -> (SVector<f64, OWN>, SVector<f64, CONSTANTS>) {
    let sigma = |k: usize| prior[(k, k)].sqrt().max(MIN_PRIOR);
    (SVector::from_fn(|k, _| sigma(own(k))), SVector::from_fn(|k, _| sigma(constant(k))))
}
