use super::{CanopyPart, Scenery, SurfaceHit, Track};
use crate::geometry::Vector;
use crate::world::{Ray, TimedRay};

/// An upright cylinder with closed ends, fixed in the base frame: an operator's body, a handle, the mast of a cart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    /// Lower end of its axis, which is parallel to z of the base, in the base frame, m.
    pub foot_in_base: Vector,
    /// Radius, m.
    pub radius_m: f64,
    /// Height, m.
    pub height_m: f64,
    /// Fraction of light that returns diffusely at normal incidence, 0..=1.
    pub reflectance: f32,
}

impl Cylinder {
    /// Distance of a point in the base frame from the surface, m; positive inside and outside.
    pub fn distance_m(&self, point_in_base: &Vector) -> f64 {
        let from_foot = point_in_base - self.foot_in_base;
        let beyond_side = from_foot.xy().norm() - self.radius_m;
        let beyond_end = (from_foot.z - 0.5 * self.height_m).abs() - 0.5 * self.height_m;
        let nearest_from_inside = -beyond_side.max(beyond_end);
        if nearest_from_inside >= 0.0 { nearest_from_inside } else { beyond_side.max(0.0).hypot(beyond_end.max(0.0)) }
    }

    /// First intersection with a ray in the base frame, in front of the origin of the ray.
    fn first_hit(&self, origin: &Vector, direction: &Vector) -> Option<SurfaceHit> {
        let from = origin - self.foot_in_base;
        // The distance from the axis satisfies |(from + s direction).xy|^2 = a s^2 + 2 b s + c + radius^2. Most rays
        // lead away from the axis, or miss the cylinder.
        let a = direction.xy().norm_squared();
        let b = from.xy().dot(&direction.xy());
        let c = from.xy().norm_squared() - self.radius_m * self.radius_m;
        if c > 0.0 && (b >= 0.0 || b * b < a * c) {
            return None;
        }
        let at = |range_m: f64| from + direction * range_m;
        let hit = |range_m: f64, cos: f64| SurfaceHit {
            range_m,
            cos_incidence: cos.abs() as f32,
            reflectance: self.reflectance,
            transmission: 0.0,
        };
        let caps = [0.0, self.height_m].into_iter().filter_map(|z| {
            let range_m = (z - from.z) / direction.z;
            (range_m > 0.0 && at(range_m).xy().norm() <= self.radius_m).then(|| hit(range_m, direction.z))
        });
        let root = (b * b - a * c).sqrt();
        let side = [(-b - root) / a, (-b + root) / a].into_iter().filter_map(|range_m| {
            let point = at(range_m);
            let on_side = range_m > 0.0 && (0.0..=self.height_m).contains(&point.z);
            on_side.then(|| hit(range_m, point.xy().dot(&direction.xy()) / self.radius_m))
        });
        caps.chain(side).min_by(|a, b| a.range_m.total_cmp(&b.range_m))
    }
}

/// Surroundings of a lidar together with the solids that carry it, which move with the base.
#[derive(Clone, Copy)]
pub struct SceneryWithCarrier<'a> {
    /// The surroundings.
    pub scenery: &'a dyn Scenery,
    /// The solids that carry the lidar.
    pub carrier: &'a [Cylinder],
    /// Motion of the base.
    pub base: &'a Track,
}

impl SceneryWithCarrier<'_> {
    /// The first solid of the carrier on a ray.
    fn carrier_hit(&self, timed: &TimedRay) -> Option<SurfaceHit> {
        let world_from_base = self.base.pose(timed.t_s);
        let origin = world_from_base.inverse_transform_point(&timed.ray.origin_in_world.into()).coords;
        let direction = world_from_base.inverse_transform_vector(&timed.ray.direction_in_world);
        let solids = self.carrier.iter().filter_map(|solid| solid.first_hit(&origin, &direction));
        solids.filter(|hit| hit.range_m <= timed.reach_m).min_by(|a, b| a.range_m.total_cmp(&b.range_m))
    }
}

impl Scenery for SceneryWithCarrier<'_> {
    fn first_hit(&self, origin: &Vector, direction: &Vector, reach_m: f64, t_s: f64) -> Option<SurfaceHit> {
        let ray = Ray { origin_in_world: *origin, direction_in_world: *direction };
        let nearest = self.carrier_hit(&TimedRay { ray, reach_m, t_s });
        let beyond_m = nearest.map_or(reach_m, |hit| hit.range_m);
        self.scenery.first_hit(origin, direction, beyond_m, t_s).or(nearest)
    }

    fn first_hits(&self, rays: &[TimedRay]) -> Vec<Option<SurfaceHit>> {
        let carrier_hits: Vec<Option<SurfaceHit>> = rays.iter().map(|timed| self.carrier_hit(timed)).collect();
        let nearer = |(timed, hit): (&TimedRay, &Option<SurfaceHit>)| TimedRay {
            reach_m: hit.map_or(timed.reach_m, |hit| hit.range_m),
            ..*timed
        };
        let shortened: Vec<TimedRay> = rays.iter().zip(&carrier_hits).map(nearer).collect();
        let hits = self.scenery.first_hits(&shortened);
        hits.into_iter().zip(carrier_hits).map(|(hit, of_carrier)| hit.or(of_carrier)).collect()
    }

    fn canopies(&self, origin: &Vector, direction: &Vector, reach_m: f64, into: &mut Vec<CanopyPart>) {
        self.scenery.canopies(origin, direction, reach_m, into);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Kinematics, Pose, from_roll_pitch_yaw};
    use approx::assert_relative_eq;
    use std::f64::consts::FRAC_PI_2;

    /// A wall across the world's x axis.
    struct Wall(f64);

    impl Scenery for Wall {
        fn first_hit(&self, origin: &Vector, direction: &Vector, reach_m: f64, _t_s: f64) -> Option<SurfaceHit> {
            let range_m = (self.0 - origin.x) / direction.x;
            let hit = SurfaceHit { range_m, cos_incidence: 1.0, reflectance: 0.5, transmission: 0.0 };
            (range_m > 0.0 && range_m <= reach_m).then_some(hit)
        }
    }

    /// An operator half a metre behind the base, from 1.2 m below the base to 0.5 m above.
    fn operator() -> Cylinder {
        Cylinder { foot_in_base: Vector::new(-0.5, 0.0, -1.2), radius_m: 0.2, height_m: 1.7, reflectance: 0.3 }
    }

    #[test]
    fn a_ray_hits_the_side_and_the_ends_of_a_cylinder() {
        let hit = |origin: Vector, direction: Vector| operator().first_hit(&origin, &direction.normalize());
        // Straight back: 0.5 - 0.2. Passing the axis at 0.12 m: 0.5 - sqrt(0.04 - 0.0144) = 0.34, cosine 0.16 / 0.2.
        let side = hit(Vector::zeros(), -Vector::x()).unwrap();
        assert_relative_eq!(side.range_m, 0.3, epsilon = 1e-12);
        let off = hit(Vector::y() * 0.12, -Vector::x()).unwrap();
        assert_relative_eq!(off.range_m, 0.34, epsilon = 1e-12);
        assert_relative_eq!(off.cos_incidence, 0.8, epsilon = 1e-6);
        // From 2 m above the base straight down to the top of the operator, at 0.5 m.
        let top = hit(Vector::new(-0.4, 0.1, 2.0), -Vector::z()).unwrap();
        assert_relative_eq!(top.range_m, 1.5, epsilon = 1e-12);
        // At 45 degrees up, the ray hits the side at a height of 0.3 m; at 60 degrees (0.52 m) it misses.
        assert_relative_eq!(
            hit(Vector::zeros(), Vector::new(-1.0, 0.0, 1.0)).unwrap().range_m,
            0.3 * 2_f64.sqrt(),
            epsilon = 1e-12
        );
        assert!(hit(Vector::zeros(), Vector::new(-0.3, 0.0, 0.3 * 3_f64.sqrt())).is_none());
        assert!(hit(Vector::zeros(), Vector::x()).is_none() && hit(Vector::y() * 0.21, -Vector::x()).is_none());
    }

    #[test]
    fn the_distance_to_a_cylinder_is_that_to_the_nearest_side_or_end() {
        let distance = |x: f64, y: f64, z: f64| operator().distance_m(&Vector::new(x, y, z));
        // The axis is at x = -0.5, from z = -1.2 to 0.5; the radius is 0.2.
        assert_relative_eq!(distance(0.0, 0.0, 0.0), 0.3, epsilon = 1e-12);
        assert_relative_eq!(distance(-0.5, 0.1, 0.9), 0.4, epsilon = 1e-12);
        assert_relative_eq!(distance(-0.5, 0.0, -1.3), 0.1, epsilon = 1e-12);
        // Diagonally outside the upper edge by 0.3 and 0.4; inside, 0.05 from the side; on the axis, 0.1 below the top.
        assert_relative_eq!(distance(0.0, 0.0, 0.9), 0.5, epsilon = 1e-12);
        assert_relative_eq!(distance(-0.5, 0.15, 0.0), 0.05, epsilon = 1e-12);
        assert_relative_eq!(distance(-0.5, 0.0, 0.4), 0.1, epsilon = 1e-12);
        let hit = operator().first_hit(&Vector::zeros(), &Vector::new(-1.0, 0.2, 0.3).normalize()).unwrap();
        let end = Vector::new(-1.0, 0.2, 0.3).normalize() * hit.range_m;
        assert_relative_eq!(distance(end.x, end.y, end.z), 0.0, epsilon = 1e-12);
    }

    #[test]
    fn the_carrier_moves_with_its_base_and_hides_the_surroundings() {
        // The base moves along x at 1 m/s and faces y, so that the operator is half a metre towards -y.
        let walking = |k: u32| {
            let pose = Pose::from_parts(
                Vector::new(f64::from(k) * 0.01, 0.0, 0.0).into(),
                from_roll_pitch_yaw(0.0, 0.0, FRAC_PI_2),
            );
            Kinematics { velocity_in_world: Vector::x(), ..Kinematics::at_rest(pose) }
        };
        let base = Track::new(0, 0.01, (0..=100).map(walking).collect()).unwrap();
        let carrier = [operator()];
        let carried = SceneryWithCarrier { scenery: &Wall(3.0), carrier: &carrier, base: &base };
        let range = |origin: Vector, direction: Vector, t_s: f64| {
            carried.first_hit(&origin, &direction, 30.0, t_s).map(|hit| hit.range_m)
        };
        assert_relative_eq!(range(Vector::x() * 0.7, -Vector::y(), 0.7).unwrap(), 0.3, epsilon = 1e-9);
        assert!(range(Vector::zeros(), -Vector::y(), 0.7).is_none(), "the operator has moved on");
        // Along x at y = -0.5: the operator is at 0.7 m with the near side at 0.5, the wall at 3; a closer wall hides
        // the operator.
        let along = Vector::new(0.0, -0.5, 0.0);
        assert_relative_eq!(range(along, Vector::x(), 0.7).unwrap(), 0.5, epsilon = 1e-9);
        assert_relative_eq!(range(along + Vector::y(), Vector::x(), 0.7).unwrap(), 3.0, epsilon = 1e-9);
        let hidden = SceneryWithCarrier { scenery: &Wall(0.4), ..carried };
        assert_relative_eq!(hidden.first_hit(&along, &Vector::x(), 30.0, 0.7).unwrap().range_m, 0.4, epsilon = 1e-9);
        assert!(carried.first_hit(&along, &Vector::x(), 0.4, 0.7).is_none(), "out of range");
    }
}
