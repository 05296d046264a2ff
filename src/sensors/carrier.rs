use super::{CanopyPart, Scenery, SurfaceHit, Track};
use zsim_base::geometry::{Pose, Vector};
use zsim_world::{Ray, TimedRay};

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

    /// Upper bound of the distance of its points from the origin of the base, m.
    fn reach_m(&self) -> f64 {
        self.foot_in_base.norm() + self.height_m + self.radius_m
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

/// Rays that are tested together for the carrier.
const GROUP: usize = 16;

/// Bounds in the world of a solid of the carrier, during a block of rays: a sphere, and an infinite cylinder.
struct Bounds {
    centre: Vector,
    /// Unit vector along the axis of the cylinder.
    axis: Vector,
    sphere_m: f64,
    cylinder_m: f64,
}

impl Bounds {
    /// The bounds of a solid whose base is at `world_from_base`, or displaced by up to `moved_m`.
    fn of(solid: &Cylinder, world_from_base: &Pose, moved_m: f64) -> Self {
        let half_m = 0.5 * solid.height_m;
        // The rounding of the conditions below is far less than a micrometre.
        let margin_m = moved_m + 1e-6;
        Self {
            centre: world_from_base.transform_point(&(solid.foot_in_base + Vector::z() * half_m).into()).coords,
            axis: world_from_base.rotation * Vector::z(),
            sphere_m: solid.radius_m.hypot(half_m) + margin_m,
            cylinder_m: solid.radius_m + margin_m,
        }
    }

    /// Whether any ray can hit that differs from `ray` by up to `shift_m` in the origin and `spread` in the direction.
    fn can_be_hit(&self, ray: &Ray, shift_m: f64, spread: f64) -> bool {
        let (from, direction) = (ray.origin_in_world - self.centre, &ray.direction_in_world);
        let (square, slope) = (from.norm_squared(), from.dot(direction));
        // At the farthest point of the solid, the rays are this far from `ray`.
        let apart_m = shift_m + (square.sqrt() + self.sphere_m + shift_m) * spread;
        let meets = |a: f64, b: f64, c: f64| c <= 0.0 || (b < 0.0 && b * b >= a * c);
        if !meets(1.0, slope, square - (self.sphere_m + apart_m).powi(2)) {
            return false;
        }
        let (height, climb) = (from.dot(&self.axis), direction.dot(&self.axis));
        let radius_m = self.cylinder_m + apart_m;
        meets(1.0 - climb * climb, slope - height * climb, square - height * height - radius_m * radius_m)
    }
}

/// Whether any ray of a group can hit one of the solids.
fn any_can_hit(solids: &[Bounds], group: &[TimedRay]) -> bool {
    let middle = &group[group.len() / 2].ray;
    let (mut shift, mut spread) = (0.0_f64, 0.0_f64);
    for TimedRay { ray, .. } in group {
        shift = shift.max((ray.origin_in_world - middle.origin_in_world).norm_squared());
        spread = spread.max((ray.direction_in_world - middle.direction_in_world).norm_squared());
    }
    let (shift_m, spread) = (shift.sqrt(), spread.sqrt());
    solids.iter().any(|solid| solid.can_be_hit(middle, shift_m, spread))
}

impl SceneryWithCarrier<'_> {
    /// Bounds of the carrier's solids while `rays` are cast.
    fn bounds(&self, rays: &[TimedRay]) -> Vec<Bounds> {
        if rays.is_empty() {
            return Vec::new();
        }
        let times = || rays.iter().map(|timed| timed.t_s);
        let span_s = (times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max));
        let middle = self.base.pose(0.5 * (span_s.0 + span_s.1));
        let of =
            |solid: &Cylinder| Bounds::of(solid, &middle, self.base.displacement_m(span_s, &middle, solid.reach_m()));
        self.carrier.iter().map(of).collect()
    }

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
        let solids = self.bounds(rays);
        let mut carrier_hits = Vec::with_capacity(rays.len());
        for group in rays.chunks(GROUP) {
            if any_can_hit(&solids, group) {
                carrier_hits.extend(group.iter().map(|timed| self.carrier_hit(timed)));
            } else {
                carrier_hits.resize(carrier_hits.len() + group.len(), None);
            }
        }
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
    use approx::assert_relative_eq;
    use std::f64::consts::FRAC_PI_2;
    use zsim_base::geometry::{Kinematics, from_roll_pitch_yaw};

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

    #[test]
    fn rays_of_a_block_hit_the_carrier_as_single_rays_do() {
        // A base that turns at 3 rad/s and moves at 1.4 m/s; rays in all directions, during 20 ms, from around the base.
        let turning = |k: u32| {
            let t_s = f64::from(k) * 0.01;
            let pose =
                Pose::from_parts(Vector::new(t_s, -t_s, 0.0).into(), from_roll_pitch_yaw(0.3, 0.2 * t_s, 3.0 * t_s));
            let turning = Vector::new(0.0, 0.2, 3.0);
            Kinematics {
                velocity_in_world: Vector::new(1.0, -1.0, 0.0),
                angular_velocity_in_world: turning,
                ..Kinematics::at_rest(pose)
            }
        };
        let base = Track::new(0, 0.01, (0..=100).map(turning).collect()).unwrap();
        let handle = Cylinder { foot_in_base: Vector::zeros(), radius_m: 0.03, height_m: 0.2, reflectance: 0.1 };
        let carrier = [operator(), handle];
        let carried = SceneryWithCarrier { scenery: &Wall(3.0), carrier: &carrier, base: &base };
        let ray = |k: u32| {
            // Groups of 16 in similar directions, the others at random.
            let wave = |rate: f64| (f64::from(if k % 2048 < 1024 { k / 16 } else { k }) * rate).sin();
            let from = base.pose(0.5).translation.vector + Vector::new(wave(0.7), wave(1.1), wave(1.9)) * 0.8;
            let fan = Vector::new(0.0, 0.01, -0.01) * f64::from(k % 16);
            let direction_in_world = (Vector::new(wave(2.3), wave(2.9), wave(3.1)).normalize() + fan).normalize();
            let ray = Ray { origin_in_world: from, direction_in_world };
            TimedRay { ray, reach_m: 30.0, t_s: 0.49 + 0.02 * f64::from(k) / 5000.0 }
        };
        let rays: Vec<TimedRay> = (0..5000).map(ray).collect();
        let single = |timed: &TimedRay| {
            carried.first_hit(&timed.ray.origin_in_world, &timed.ray.direction_in_world, timed.reach_m, timed.t_s)
        };
        assert_eq!(carried.first_hits(&rays), rays.iter().map(single).collect::<Vec<_>>());
        let on_carrier = rays.iter().filter(|timed| carried.carrier_hit(timed).is_some()).count();
        assert!((100..2500).contains(&on_carrier), "{on_carrier}");
    }
}
