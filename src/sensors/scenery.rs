use crate::geometry::Vector;
use crate::world::{Ray, World};

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
