//! The mean motion between samples.

use super::clipping::Clipped;
use zsim_base::geometry::Vector;

/// Samples of a faster IMU are averaged to about this spacing, s.
pub(super) const SPACING_S: f64 = 0.01;
/// The mean of one or more consecutive samples, at the middle of the time that they cover.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mean {
    pub(super) centre_s: f64,
    pub(super) gyro: Vector,
    pub(super) accel: Vector,
    /// Standard deviations in addition to the sensor noise, rad/s and m/s^2.
    pub(super) extra_gyro_sigma: f64,
    pub(super) extra_accel_sigma: f64,
    pub(super) clipped: Clipped,
    /// Whether the mean is interpolated, without samples.
    pub(super) bridged: bool,
}
