use crate::geometry::Vector;
use crate::world::{Ray, World};

/// Intersection of a ray with a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceHit {
    /// Distance along the ray, m.
    pub range_m: f64,
    /// Cosine of the angle between the ray and the surface normal, 0..=1.
    pub cos_incidence: f32,
    /// Fraction of light that returns diffusely at normal incidence, 0..=1.
    pub reflectance: f32,
    /// Fraction of light that a single pass through the surface transmits; 0 for materials other than glass.
    pub transmission: f32,
}

impl SurfaceHit {
    /// Whether a beam can pass through the surface.
    pub fn is_glass(&self) -> bool {
        self.transmission > 0.0
    }
}

/// Surroundings of a lidar, into which rays can be cast.
pub trait Scenery: Sync {
    /// The first surface within `reach_m` on the ray from `origin` along the unit vector `direction`, both in the
    /// world, at `t_s` seconds after the start.
    fn first_hit(&self, origin: &Vector, direction: &Vector, reach_m: f64, t_s: f64) -> Option<SurfaceHit>;
}

impl Scenery for World {
    fn first_hit(&self, origin: &Vector, direction: &Vector, reach_m: f64, t_s: f64) -> Option<SurfaceHit> {
        let ray = Ray { origin_in_world: *origin, direction_in_world: *direction };
        let hit = self.cast(&ray, reach_m, t_s)?;
        let material = self.material(hit.material);
        Some(SurfaceHit {
            range_m: hit.distance_m,
            cos_incidence: hit.normal_in_world.dot(direction).abs() as f32,
            reflectance: material.reflectance as f32,
            transmission: material.transmission as f32,
        })
    }
}
