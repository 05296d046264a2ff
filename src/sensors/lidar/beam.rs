//! A beam of a lidar pattern.

use zsim_base::geometry::Vector;
use zsim_base::time::Span;

/// Maximum number of beams per scan: a guard against a typing error, and for memory.
pub(super) const MAX_BEAMS: usize = 1 << 20;

/// A beam of a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beam {
    /// Direction, a unit vector in the lidar frame.
    pub direction_in_laser: Vector,
    /// Firing time after the first beam, on the crystal of the lidar.
    pub offset: Span,
    /// The same time, s, without rounding to 1 ns.
    pub offset_s: f64,
}

impl Beam {
    /// The beam at `azimuth_rad` counter-clockwise from x about z and `elevation_rad` above the plane z = 0.
    pub fn new(azimuth_rad: f64, elevation_rad: f64, offset_s: f64) -> Self {
        let (sin, cos) = azimuth_rad.sin_cos();
        let (up, level) = elevation_rad.sin_cos();
        let direction_in_laser = Vector::new(level * cos, level * sin, up);
        Self { direction_in_laser, offset: Span::from_seconds(offset_s), offset_s }
    }
}
