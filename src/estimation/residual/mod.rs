//! Residuals of the window with derivatives: IMU, matched surfels, priors.

pub(super) mod contradiction;
mod fast_motion;
mod imu_residual;
pub(super) mod inertial;
mod knot_span;
pub(super) mod matched;
mod nodes;
pub(super) mod prior;
mod rows;
pub(super) mod sums;

pub(super) use fast_motion::FastMotion;
pub(super) use nodes::Nodes;
