//! Scattered objects: positions are drawn one by one and rejected if too close to another object or a route.

use super::{ScatterSpec, Turn};
use rand::RngExt;
use std::collections::BTreeMap;
use zsim_base::geometry::{Pose, Rotation, Route, Vector, from_roll_pitch_yaw};
use zsim_base::random::{Seed, Stream};
use zsim_base::spec::checked::MAX_LENGTH_M;

/// Maximum number of copies of one scatter: bounds the build time.
const MAX_COUNT: usize = 200_000;
/// Maximum number of copies of all scatters of a scene: bounds memory, also of plants, which share their triangles.
const MAX_COPIES: usize = 1_000_000;
/// Attempts per copy after which the region counts as full.
const ATTEMPTS_PER_COPY: usize = 100;
/// Maximum number of steps of all scatters of a scene, some 5 s; a step is the distance to one leg of a route.
const MAX_STEPS: usize = 500_000_000;
/// Steps of an attempt: the search for neighbours.
const ATTEMPT_STEPS: usize = 200;

type KeyedMessage = (&'static str, String);

/// Copies and time that the scatters of a scene may still use.
pub(super) struct Budget {
    copies: usize,
    steps: usize,
}

impl Default for Budget {
    fn default() -> Self {
        Self { copies: MAX_COPIES, steps: MAX_STEPS }
    }
}

impl Budget {
    fn reserve(&mut self, copies: usize) -> Result<(), KeyedMessage> {
        let left = self.copies.checked_sub(copies);
        self.copies = left.ok_or_else(|| ("Scatter", format!("the scene scatters more than {MAX_COPIES} copies")))?;
        Ok(())
    }

    /// Takes the steps of an attempt; returns whether there were enough.
    fn take(&mut self, legs: usize) -> bool {
        let left = self.steps.checked_sub(ATTEMPT_STEPS + legs);
        self.steps = left.unwrap_or(0);
        left.is_some()
    }
}

/// Poses of the copies in the frame of the scatter, whose pose is `world_from_scatter`.
///
/// # Errors
/// The key and a message, if the region is invalid or too small for all copies, or if the search takes too long.
pub(super) fn poses(
    spec: &ScatterSpec,
    world_from_scatter: &Pose,
    routes: &[&Route],
    budget: &mut Budget,
) -> Result<Vec<Pose>, KeyedMessage> {
    let region = Region::new(spec)?;
    budget.reserve(spec.count)?;
    let mut stream = Seed(spec.seed).stream("world/scatter");
    let mut placed = SpacedPoints::new(spec.min_spacing_m, &region);
    let routes = if spec.keep_from_routes_m > 0.0 { routes } else { &[] };
    let legs = routes.iter().map(|route| route.points_in_world.len()).sum();
    let mut poses = Vec::with_capacity(spec.count);
    let mut limit = "";
    for _ in 0..spec.count.saturating_mul(ATTEMPTS_PER_COPY) {
        if poses.len() == spec.count {
            break;
        }
        if !budget.take(legs) {
            limit = " within the limit of time";
            break;
        }
        let point = region.draw(&mut stream);
        let turn = turn(spec.turn, &mut stream);
        let in_world = world_from_scatter * nalgebra::Point3::from(point);
        let is_clear =
            routes.iter().all(|route| horizontal_distance(&in_world.coords, route) >= spec.keep_from_routes_m);
        if is_clear && placed.add(point) {
            poses.push(Pose::from_parts(point.into(), turn));
        }
    }
    if poses.len() < spec.count {
        let message = format!(
            "placed only {} of {} copies of `{}`{limit}: lower `count`, `min_spacing_m` or `keep_from_routes_m`",
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
        if !a.iter().chain(&b).all(|x| x.abs() <= MAX_LENGTH_M) {
            return Err(("region_m", "`region_m` has a corner that is not within 100 km of the origin".to_owned()));
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
    /// Lower corner of the grid, and edge of its cells.
    lower: Vector,
    edge: f64,
    cells: BTreeMap<[i64; 3], Vec<Vector>>,
}

impl SpacedPoints {
    fn new(spacing: f64, region: &Region) -> Self {
        // Cells are at least as large as the spacing. Of a smaller spacing, a cell is a millionth of the region, so that its
        // number is exact and few points share it.
        let edge = spacing.max(1e-6 * region.size.max());
        Self { spacing, lower: region.lower, edge, cells: BTreeMap::new() }
    }

    /// Adds a point unless it is too close to another one; returns whether it was added.
    fn add(&mut self, point: Vector) -> bool {
        if self.spacing == 0.0 {
            return true;
        }
        let at = (point - self.lower) / self.edge;
        let cell = |offset: [i64; 3]| [0, 1, 2].map(|axis| (at[axis].floor() as i64).saturating_add(offset[axis]));
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

    fn poses(spec: &ScatterSpec, routes: &[&Route]) -> Result<Vec<Pose>, KeyedMessage> {
        super::poses(spec, &Pose::identity(), routes, &mut Budget::default())
    }

    #[test]
    fn scattered_objects_keep_their_distances_and_depend_on_the_seed_alone() {
        let points_in_world = vec![Vector::new(0.0, 15.0, 0.0), Vector::new(40.0, 15.0, 0.0)];
        let route = Route { points_in_world, closed: false };
        let draw = |seed| poses(&spec(seed, 60), &[&route]).unwrap();
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
        let (key, sentence) = poses(&spec(1, 400), &[]).unwrap_err();
        assert_eq!(key, "Scatter");
        assert!(sentence.contains("of 400 copies of `tree`"), "{sentence}");
        assert_eq!(poses(&spec(1, 0), &[]).unwrap_err().0, "count");
        assert_eq!(poses(&spec(1, usize::MAX), &[]).unwrap_err().0, "count");
    }

    #[test]
    fn copies_and_time_of_a_scene_are_limited() {
        // A spacing far below the resolution of the coordinates once put all copies into one cell.
        let dense = ScatterSpec { min_spacing_m: 1e-300, keep_from_routes_m: 0.0, ..spec(1, 20_000) };
        assert_eq!(poses(&dense, &[]).unwrap().len(), 20_000);
        let points_in_world = (0..1_000_000).map(|k| Vector::new(f64::from(k), 50.0, 0.0)).collect();
        let long = Route { points_in_world, closed: false };
        let mut little = Budget { steps: 50_000_000, ..Budget::default() };
        let message = super::poses(&spec(1, 1000), &Pose::identity(), &[&long], &mut little).unwrap_err().1;
        assert!(message.contains("of 1000 copies of `tree` within the limit of time"), "{message}");
        let mut budget = Budget::default();
        assert!(budget.reserve(MAX_COPIES).is_ok() && budget.reserve(1).unwrap_err().1.contains("1000000 copies"));
        let far = ScatterSpec { region_m: ([0.0; 3], [1e150, 1.0, 1.0]), ..spec(1, 1) };
        assert!(poses(&far, &[]).unwrap_err().1.contains("100 km"));
    }
}
