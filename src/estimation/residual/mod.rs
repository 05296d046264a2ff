//! Residuals of the window with derivatives: IMU, matched surfels, priors.

pub(super) mod contradiction;
mod fast_motion;
mod imu_residual;
pub(super) mod inertial;
mod knot_span;
mod layout;
pub(super) mod matched;
mod nodes;
pub(super) mod paper;
pub(super) mod prior;
mod rows;
pub(super) mod sums;

pub(super) use fast_motion::FastMotion;
pub(super) use layout::{
    ACCEL_BIAS, ACCEL_MATRIX, BORDER, CLOCK, GRAVITY, GYRO_BIAS, GYRO_MATRIX, LIDAR_ROTATION, Layout,
};
pub(super) use nodes::Nodes;

pub(super) const CLOCK_RATE: usize = 9;
pub(super) const RANGE: usize = 10;
pub(super) const LIDAR_TRANSLATION: usize = 14;
