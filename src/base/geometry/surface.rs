//! Interface to the true surfaces, independent of the scene representation.

use super::Vector;

/// The point of a surface nearest to a query point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// The nearest point, in the world, m.
    pub point_in_world: Vector,
    /// Unit normal at that point, of either sign.
    pub normal_in_world: Vector,
}

/// Reference surfaces for the evaluation of a point cloud.
pub trait Surface: Sync {
    /// The nearest surface point within `reach_m` (m) of `point_in_world`, or `None`.
    fn nearest(&self, point_in_world: &Vector, reach_m: f64) -> Option<SurfacePoint>;
}
