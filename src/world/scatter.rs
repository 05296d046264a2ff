//! Scattered objects: positions are drawn one by one and rejected if too close to another object or a route.

use super::{ScatterSpec, Turn};
use rand::RngExt;
use std::collections::BTreeMap;
use zsim_base::geometry::{Pose, Rotation, Route, Vector, from_roll_pitch_yaw};
use zsim_base::random::{Seed, Stream};

/// Maximum number of copies of one scatter: bounds the build time.
const MAX_COUNT: usize = 200_000;
/// Attempts per copy after which the region counts as full.
const ATTEMPTS_PER_COPY: usize = 100;

type KeyedMessage = (&'static str, String);

/// Poses of the copies in the frame of the scatter, whose pose is `world_from_scatter`.
///
/// # Errors
/// The key and a message, if the region is invalid or too small for all copies.
pub(super) fn poses(
    spec: &ScatterSpec,
    world_from_scatter: &Pose,
    routes: &[&Route],
) -> Result<Vec<Pose>, KeyedMessage> {
    let region = Region::new(spec)?;
    let mut stream = Seed(spec.seed).stream("world/scatter");
    let mut placed = SpacedPoints { spacing: spec.min_spacing_m, cells: BTreeMap::new() };
    let mut poses = Vec::with_capacity(spec.count);
    for _ in 0..spec.count.saturating_mul(ATTEMPTS_PER_COPY) {
        if poses.len() == spec.count {
            break;
        }
        let point = region.draw(&mut stream);
        let turn = turn(spec.turn, &mut stream);
        let in_world = world_from_scatter * nalgebra::Point3::from(point);
        let is_clear = spec.keep_from_routes_m == 0.0
            || routes.iter().all(|route| horizontal_distance(&in_world.coords, route) >= spec.keep_from_routes_m);
        if is_clear && placed.add(point) {
            poses.push(Pose::from_parts(point.into(), turn));
        }
    }
    if poses.len() < spec.count {
        let message = format!(
            "placed only {} of {} copies of `{}`: lower `count`, `min_spacing_m` or `keep_from_routes_m`",
            poses.len(),
            spec.count,
            spec.template
        );
        return Err(("Scatter", message));
    }
    Ok(poses)
}

struct Region {
    lower: Vector,
    size: Vector,
}

impl Region {
    fn new(spec: &ScatterSpec) -> Result<Self, KeyedMessage> {
        let (a, b) = (Vector::from(spec.region_m.0), Vector::from(spec.region_m.1));
        if !a.iter().chain(&b).all(|x| x.is_finite()) {
            return Err(("region_m", "expected finite numbers in `region_m`".to_owned()));
        }
        if spec.count == 0 || spec.count > MAX_COUNT {
            let message = format!("`count` is {}; give 1 to {MAX_COUNT}", spec.count);
            return Err(("count", message));
        }
        Ok(Self { lower: a.inf(&b), size: (a - b).abs() })
    }

    fn draw(&self, stream: &mut Stream) -> Vector {
        let fractions = Vector::from_fn(|_, _| stream.random_range(0.0..1.0));
        self.lower + self.size.component_mul(&fractions)
    }
}

fn turn(turn: Turn, stream: &mut Stream) -> Rotation {
    match turn {
        Turn::Fixed => Rotation::identity(),
        Turn::Upright => from_roll_pitch_yaw(0.0, 0.0, stream.random_range(0.0..std::f64::consts::TAU)),
        Turn::Any => random_rotation(stream),
    }
}

/// A uniformly distributed rotation: a point of the unit 3-sphere, by rejection from the cube.
fn random_rotation(stream: &mut Stream) -> Rotation {
    loop {
        let numbers = nalgebra::Vector4::from_fn(|_, _| stream.random_range(-1.0..1.0));
        if (0.01..=1.0).contains(&numbers.norm_squared()) {
            return Rotation::from_quaternion(nalgebra::Quaternion::from(numbers));
        }
    }
}

/// Points with a minimum spacing, in a grid for neighbour search.
struct SpacedPoints {
    spacing: f64,
    cells: BTreeMap<[i64; 3], Vec<Vector>>,
}

impl SpacedPoints {
    /// Adds a point unless it is too close to another one; returns whether it was added.
    fn add(&mut self, point: Vector) -> bool {
        if self.spacing == 0.0 {
            return true;
        }
        let cell = |offset: [i64; 3]| {
            let at = point / self.spacing;
            [0, 1, 2].map(|axis| (at[axis].floor() as i64).saturating_add(offset[axis]))
        };
        let offsets = (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]);
        let mut near = offsets.filter_map(|offset| self.cells.get(&cell(offset))).flatten();
        let is_clear = near.all(|other| (other - point).norm() >= self.spacing);
        if is_clear {
            self.cells.entry(cell([0; 3])).or_default().push(point);
        }
        is_clear
    }
}

/// Horizontal distance from a point to a route, m.
fn horizontal_distance(point: &Vector, route: &Route) -> f64 {
    let points = &route.points_in_world;
    let closing = route.closed.then(|| (points[points.len() - 1], points[0]));
    let legs = points.windows(2).map(|pair| (pair[0], pair[1])).chain(closing);
    let distance = |(from, to): (Vector, Vector)| {
        let (leg, to_point) = ((to - from).xy(), (point - from).xy());
        let length2 = leg.norm_squared();
        let fraction = if length2 > 0.0 { (leg.dot(&to_point) / length2).clamp(0.0, 1.0) } else { 0.0 };
        (to_point - leg * fraction).norm()
    };
    legs.map(distance).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec(seed: u64, count: usize) -> ScatterSpec {
        ScatterSpec {
            template: "tree".to_owned(),
            seed,
            count,
            region_m: ([0.0, 0.0, 0.0], [40.0, 30.0, 0.0]),
            min_spacing_m: 2.0,
            keep_from_routes_m: 1.5,
            turn: Turn::Upright,
        }
    }

    #[test]
    fn scattered_objects_keep_their_distances_and_depend_on_the_seed_alone() {
        let points_in_world = vec![Vector::new(0.0, 15.0, 0.0), Vector::new(40.0, 15.0, 0.0)];
        let route = Route { points_in_world, closed: false };
        let draw = |seed| poses(&spec(seed, 60), &Pose::identity(), &[&route]).unwrap();
        let poses = draw(3);
        assert_eq!(poses, draw(3));
        assert_ne!(poses, draw(4));
        for (k, pose) in poses.iter().enumerate() {
            let here = pose.translation.vector;
            assert!((here.y - 15.0).abs() >= 1.5);
            assert!((0.0..=40.0).contains(&here.x) && (0.0..=30.0).contains(&here.y) && here.z == 0.0);
            assert!(poses[..k].iter().all(|other| (other.translation.vector - here).norm() >= 2.0));
        }
    }

    #[test]
    fn a_region_that_is_too_small_is_reported() {
        // Discs of radius 1 m cover at most 0.9069 of the plane (Thue): 40 x 30 m plus a margin of 1 m has room for
        // fewer than 388.
        let (key, sentence) = poses(&spec(1, 400), &Pose::identity(), &[]).unwrap_err();
        assert_eq!(key, "Scatter");
        assert!(sentence.contains("of 400 copies of `tree`"), "{sentence}");
        assert_eq!(poses(&spec(1, 0), &Pose::identity(), &[]).unwrap_err().0, "count");
        assert_eq!(poses(&spec(1, usize::MAX), &Pose::identity(), &[]).unwrap_err().0, "count");
    }
}
