//! Objects thrown into a region: places drawn one after the other, those too close to another thrown again.

use super::{ScatterSpec, Turn};
use crate::geometry::{Pose, Rotation, Route, Vector, from_roll_pitch_yaw};
use crate::random::{Seed, Stream};
use rand::RngExt;
use std::collections::BTreeMap;

/// Most copies of one scatter.
const MAX_COUNT: usize = 200_000;
/// Throws for each copy before the region counts as full.
const THROWS: usize = 100;

type Wrong = (&'static str, String);

/// The poses of the copies, in the frame of the scatter, which stands at `world_from_scatter`.
///
/// # Errors
/// The key and a sentence, when the region is wrong or too small for them all.
pub(super) fn places(spec: &ScatterSpec, world_from_scatter: &Pose, routes: &[&Route]) -> Result<Vec<Pose>, Wrong> {
    let region = Region::new(spec)?;
    let mut stream = Seed(spec.seed).stream("world/scatter");
    let mut placed = Spaced { spacing: spec.min_spacing_m, cells: BTreeMap::new() };
    let mut poses = Vec::with_capacity(spec.count);
    for _ in 0..spec.count.saturating_mul(THROWS) {
        if poses.len() == spec.count {
            break;
        }
        let point = region.draw(&mut stream);
        let turn = turn(spec.turn, &mut stream);
        let on_the_map = world_from_scatter * nalgebra::Point3::from(point);
        let is_clear = spec.keep_from_routes_m == 0.0
            || routes.iter().all(|route| distance_on_the_map(&on_the_map.coords, route) >= spec.keep_from_routes_m);
        if is_clear && placed.add(point) {
            poses.push(Pose::from_parts(point.into(), turn));
        }
    }
    if poses.len() < spec.count {
        let message = format!(
            "only {} of {} copies of `{}` found a place: lower `count`, `min_spacing_m` or `keep_from_routes_m`",
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
    fn new(spec: &ScatterSpec) -> Result<Self, Wrong> {
        let (a, b) = (Vector::from(spec.region_m.0), Vector::from(spec.region_m.1));
        if !a.iter().chain(&b).all(|x| x.is_finite()) {
            return Err(("region_m", "expected finite numbers in `region_m`".to_owned()));
        }
        if spec.count == 0 || spec.count > MAX_COUNT {
            let message = format!("`count` is {}; a scatter has from 1 to {MAX_COUNT} copies", spec.count);
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
        Turn::Any => any_rotation(stream),
    }
}

/// A rotation, all equally likely: a point of the unit 3-sphere, by rejection from its cube.
fn any_rotation(stream: &mut Stream) -> Rotation {
    loop {
        let numbers = nalgebra::Vector4::from_fn(|_, _| stream.random_range(-1.0..1.0));
        if (0.01..=1.0).contains(&numbers.norm_squared()) {
            return Rotation::from_quaternion(nalgebra::Quaternion::from(numbers));
        }
    }
}

/// Points that keep a distance, found by the cell of a grid.
struct Spaced {
    spacing: f64,
    cells: BTreeMap<[i64; 3], Vec<Vector>>,
}

impl Spaced {
    /// Adds a point unless another is too close.
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

/// Horizontal distance from a point to a route.
fn distance_on_the_map(point: &Vector, route: &Route) -> f64 {
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
        let draw = |seed| places(&spec(seed, 60), &Pose::identity(), &[&route]).unwrap();
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
    fn a_region_that_is_too_small_is_told() {
        // Discs of radius 1 m cover at most 0.9069 of the plane (Thue): 40 x 30 m and a rim of 1 m hold fewer than 388.
        let (key, sentence) = places(&spec(1, 400), &Pose::identity(), &[]).unwrap_err();
        assert_eq!(key, "Scatter");
        assert!(sentence.contains("of 400 copies of `tree`"), "{sentence}");
        assert_eq!(places(&spec(1, 0), &Pose::identity(), &[]).unwrap_err().0, "count");
        assert_eq!(places(&spec(1, usize::MAX), &Pose::identity(), &[]).unwrap_err().0, "count");
    }
}
