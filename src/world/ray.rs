use super::{FaceId, MaterialId};
use zsim_base::geometry::Vector;

/// A ray of light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Origin, m.
    pub origin_in_world: Vector,
    /// Direction; a unit vector.
    pub direction_in_world: Vector,
}

/// A ray of a scan: its time and its reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimedRay {
    /// The ray.
    pub ray: Ray,
    /// Maximum distance from its origin, m.
    pub reach_m: f64,
    /// True time since the start of the run, s.
    pub t_s: f64,
}

/// The first surface on a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance from the origin of the ray, m.
    pub distance_m: f64,
    /// Unit normal of the surface, towards the origin of the ray.
    pub normal_in_world: Vector,
    /// Material of the surface.
    pub material: MaterialId,
    /// Static face that the ray hit; `None` on a mover or a swaying plant.
    pub face: Option<FaceId>,
}

impl Ray {
    /// The point at `distance_m` along the ray.
    pub fn at(&self, distance_m: f64) -> Vector {
        self.origin_in_world + self.direction_in_world * distance_m
    }
}
