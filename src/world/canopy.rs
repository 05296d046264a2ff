//! Canopies: boxes of leaves or blades that are finer than a laser beam.

use super::{MaterialId, Ray};
use zsim_base::geometry::{Pose, Vector};

/// A box that stops rays at random depths.
pub(super) struct Canopy {
    body_from_world: Pose,
    /// Corners of the box in its own frame, m.
    lower: Vector,
    upper: Vector,
    extinction_per_m: f64,
    material: MaterialId,
}

/// Part of a ray in a canopy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CanopyCrossing {
    /// Distances along the ray at which it enters and leaves, m.
    pub from_m: f64,
    /// See `from_m`.
    pub to_m: f64,
    /// Extinction coefficient, 1/m.
    pub extinction_per_m: f64,
    /// Material of the leaves.
    pub material: MaterialId,
}

impl Canopy {
    /// A box of `size` with the middle of its lower face at `world_from_body`.
    pub fn new(world_from_body: &Pose, size: [f64; 3], extinction_per_m: f64, material: MaterialId) -> Self {
        let [x, y, z] = size;
        Self {
            body_from_world: world_from_body.inverse(),
            lower: Vector::new(-x / 2.0, -y / 2.0, 0.0),
            upper: Vector::new(x / 2.0, y / 2.0, z),
            extinction_per_m,
            material,
        }
    }

    /// The part of `ray` in the box, up to `reach_m` (slab test).
    pub fn crossing(&self, ray: &Ray, reach_m: f64) -> Option<CanopyCrossing> {
        let origin = self.body_from_world.transform_point(&ray.origin_in_world.into()).coords;
        let direction = self.body_from_world.rotation * ray.direction_in_world;
        let (mut from_m, mut to_m) = (0.0_f64, reach_m);
        for axis in 0..3 {
            let [a, b] = [self.lower, self.upper].map(|side| (side[axis] - origin[axis]) / direction[axis]);
            // A ray in the plane of a side divides zero by zero; min and max ignore the NaN.
            (from_m, to_m) = (from_m.max(a.min(b)), to_m.min(a.max(b)));
        }
        let Self { extinction_per_m, material, .. } = *self;
        (from_m < to_m).then_some(CanopyCrossing { from_m, to_m, extinction_per_m, material })
    }

    /// Distance of a point from the box, 0 inside, m.
    pub fn distance_m(&self, point_in_world: &Vector) -> f64 {
        let point = self.body_from_world.transform_point(&(*point_in_world).into()).coords;
        (point - point.sup(&self.lower).inf(&self.upper)).norm()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::from_roll_pitch_yaw;

    fn canopy(world_from_body: &Pose) -> Canopy {
        Canopy::new(world_from_body, [4.0, 2.0, 1.0], 0.5, MaterialId(0))
    }

    fn crossing(canopy: &Canopy, origin: [f64; 3], direction: [f64; 3]) -> Option<(f64, f64)> {
        let ray = Ray { origin_in_world: origin.into(), direction_in_world: Vector::from(direction).normalize() };
        canopy.crossing(&ray, 30.0).map(|part| (part.from_m, part.to_m))
    }

    #[test]
    fn a_ray_is_in_the_box_between_its_two_sides() {
        let box_at_origin = canopy(&Pose::identity());
        assert_eq!(crossing(&box_at_origin, [-5.0, 0.0, 0.5], [1.0, 0.0, 0.0]), Some((3.0, 7.0)));
        assert_eq!(crossing(&box_at_origin, [0.0, 0.0, 0.25], [0.0, 0.0, 1.0]), Some((0.0, 0.75)), "from inside");
        assert_eq!(crossing(&box_at_origin, [5.0, 0.0, 0.5], [1.0, 0.0, 0.0]), None, "behind the ray");
        assert_eq!(crossing(&box_at_origin, [-5.0, 0.0, 1.5], [1.0, 0.0, 0.0]), None, "above");
        assert_eq!(crossing(&box_at_origin, [-50.0, 0.0, 0.5], [1.0, 0.0, 0.0]), None, "out of reach");
    }

    #[test]
    fn a_turned_box_is_crossed_along_its_own_axes() {
        // Turned by 45 degrees, the box of 2 m width is 2 sqrt(2) m wide along x at its middle.
        let turned = Pose::from_parts(
            Vector::new(10.0, 0.0, 0.0).into(),
            from_roll_pitch_yaw(0.0, 0.0, 0.25 * std::f64::consts::PI),
        );
        let (from_m, to_m) = crossing(&canopy(&turned), [0.0, 0.0, 0.5], [1.0, 0.0, 0.0]).unwrap();
        assert_relative_eq!(from_m, 10.0 - 2.0_f64.sqrt(), epsilon = 1e-12);
        assert_relative_eq!(to_m, 10.0 + 2.0_f64.sqrt(), epsilon = 1e-12);
    }

    #[test]
    fn the_distance_from_the_box_is_to_its_nearest_face_edge_or_corner() {
        let canopy = canopy(&Pose::translation(1.0, 0.0, 0.0));
        for (point, distance_m) in [([1.0, 0.0, 0.5], 0.0), ([1.0, 0.0, 1.5], 0.5), ([6.0, 5.0, 0.5], 5.0)] {
            assert_relative_eq!(canopy.distance_m(&point.into()), distance_m, epsilon = 1e-12);
        }
    }
}
