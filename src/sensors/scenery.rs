use crate::geometry::Vector;

/// A surface that a ray met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceHit {
    /// How far along the ray, m.
    pub range_m: f64,
    /// Cosine of the angle between the ray and the surface's normal, 0..=1.
    pub cos_incidence: f32,
    /// Share of the light that comes back diffusely at normal incidence, 0..=1.
    pub reflectance: f32,
    /// Share of the light that goes on behind the surface, once through; 0 for what is not glass.
    pub transmission: f32,
}

impl SurfaceHit {
    /// Whether a beam may go on behind the surface.
    pub fn is_glass(&self) -> bool {
        self.transmission > 0.0
    }
}

/// What stands around a lidar: anything a ray can be cast into.
pub trait Scenery: Sync {
    /// The first surface that a ray from `origin` along the unit vector `direction`, both in the world, meets within
    /// `reach_m` at `t_s` seconds after the start.
    fn first_hit(&self, origin: &Vector, direction: &Vector, reach_m: f64, t_s: f64) -> Option<SurfaceHit>;
}
