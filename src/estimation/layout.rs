//! Order of the unknowns.

/// Number of border unknowns.
///
/// The border has the unknowns that all times share; they follow the knots and make the last rows of the equations
/// dense: gyroscope bias, accelerometer bias, tilt of gravity, clock offset and rate, range bias, rotation and translation of
/// the lidar, and scale and misalignment of gyroscope and accelerometer, each three by three.
pub(crate) const BORDER: usize = 35;
/// Offsets of the unknowns in the border.
pub(crate) const GYRO_BIAS: usize = 0;
pub(crate) const ACCEL_BIAS: usize = 3;
pub(crate) const GRAVITY: usize = 6;
pub(crate) const CLOCK: usize = 8;
pub(crate) const CLOCK_RATE: usize = 9;
pub(crate) const RANGE: usize = 10;
pub(crate) const LIDAR_ROTATION: usize = 11;
pub(crate) const LIDAR_TRANSLATION: usize = 14;
pub(crate) const GYRO_MATRIX: usize = 17;
pub(crate) const ACCEL_MATRIX: usize = 26;

/// The order of a window's unknowns.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Layout {
    /// Index of the first knot; knot 0 is at time 0.
    pub(crate) first_knot: i64,
    /// Number of knots.
    pub(crate) knots: usize,
}

impl Layout {
    /// Number of unknowns.
    pub(crate) fn size(&self) -> usize {
        self.knots * 6 + BORDER
    }

    /// The first unknown of the border.
    pub(crate) fn border(&self) -> usize {
        self.knots * 6
    }

    /// The first unknown of a knot: three of rotation, three of translation.
    pub(crate) fn knot(&self, index: i64) -> usize {
        (index - self.first_knot) as usize * 6
    }
}
