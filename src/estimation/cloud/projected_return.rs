//! A return of the laser in the world frame.

use zsim_base::geometry::Vector;
use zsim_base::time::Stamp;

/// A lidar return, projected into the map by the estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProjectedReturn {
    /// Time of emission.
    pub stamp: Stamp,
    /// Measured point in the map, m.
    pub point_in_map: Vector,
    /// Position of the lidar in the map, m.
    pub origin_in_map: Vector,
}

impl ProjectedReturn {
    /// Distance from the lidar, m.
    pub(super) fn range_m(&self) -> f64 {
        (self.point_in_map - self.origin_in_map).norm()
    }
}
