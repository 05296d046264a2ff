//! What an evaluation needs to know of the true surfaces, without knowing what they are made of.

use super::Vector;

/// The point of a surface that is nearest to some other point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// The nearest point, m.
    pub point_in_world: Vector,
    /// Unit normal there, of either sign.
    pub normal_in_world: Vector,
}

/// Surfaces that a cloud can be compared with.
pub trait Surface: Sync {
    /// The nearest point of the surface within `reach_m` of `point_in_world`, or `None` where there is none.
    fn nearest(&self, point_in_world: &Vector, reach_m: f64) -> Option<SurfacePoint>;
}
