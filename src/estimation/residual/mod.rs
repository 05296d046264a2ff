//! Residuals of the window with derivatives: IMU, matched surfels, priors.

pub(super) mod contradiction;
pub(super) mod inertial;
pub(super) mod matched;
pub(super) mod prior;
mod rows;
pub(super) mod sums;

/// Number of border unknowns.
///
/// The border has the unknowns that all times share; they follow the knots and make the last rows of the equations
/// dense: gyroscope bias, accelerometer bias, tilt of gravity, clock offset and rate, range bias, rotation and translation of
/// the lidar, and scale and misalignment of gyroscope and accelerometer, each three by three.
pub(super) const BORDER: usize = 35;
/// Offsets of the unknowns in the border.
pub(super) const GYRO_BIAS: usize = 0;
pub(super) const ACCEL_BIAS: usize = 3;
pub(super) const GRAVITY: usize = 6;
pub(super) const CLOCK: usize = 8;
pub(super) const CLOCK_RATE: usize = 9;
pub(super) const RANGE: usize = 10;
pub(super) const LIDAR_ROTATION: usize = 11;
pub(super) const LIDAR_TRANSLATION: usize = 14;
pub(super) const GYRO_MATRIX: usize = 17;
pub(super) const ACCEL_MATRIX: usize = 26;

/// The order of a window's unknowns.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layout {
    /// Index of the first knot; knot 0 is at time 0.
    pub(super) first_knot: i64,
    /// Number of knots.
    pub(super) knots: usize,
}

impl Layout {
    /// Number of unknowns.
    pub(super) fn size(&self) -> usize {
        self.knots * 6 + BORDER
    }

    /// The first unknown of the border.
    pub(super) fn border(&self) -> usize {
        self.knots * 6
    }

    /// The first unknown of a knot: three of rotation, three of translation.
    pub(super) fn knot(&self, index: i64) -> usize {
        (index - self.first_knot) as usize * 6
    }
}
