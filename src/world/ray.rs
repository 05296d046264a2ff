use super::MaterialId;
use crate::geometry::Vector;

/// A half-line along which light travels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it starts, m.
    pub origin_in_world: Vector,
    /// Where it goes; a unit vector.
    pub direction_in_world: Vector,
}

/// The first surface that a ray meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance from the ray's origin, m.
    pub distance_m: f64,
    /// The surface's unit normal there, turned towards the ray's origin.
    pub normal_in_world: Vector,
    /// What the surface is made of.
    pub material: MaterialId,
}

impl Ray {
    /// The point at `distance_m` along the ray.
    pub fn at(&self, distance_m: f64) -> Vector {
        self.origin_in_world + self.direction_in_world * distance_m
    }
}
