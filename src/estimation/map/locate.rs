//! Where in a map something was seen: from about where it may be, coarse to fine.
//!
//! What was seen is put into the map from several starts, and laid upon it: neighbours in six dimensions, matched as in a
//! window; a rigid motion that brings matched planes together (Chen and Medioni 1992), robustly; again, from the coarsest
//! resolution to the finest. Of the places found so the one counts in which most of what was seen lies on the map, where no
//! other is nearly as good.

use crate::estimation::EstimationError;
use crate::estimation::matching::{Forest, Matcher};
use crate::estimation::residual::matched::Plane;
use crate::estimation::spec::{MatchingSpec, SurfelSpec};
use crate::estimation::surfel::Patch;
use crate::geometry::{Pose, Rotation, Vector};
use crate::surfel_map::SurfelMap;
use nalgebra::{Matrix6, Vector6};
use rayon::prelude::*;

/// Starts are tried at these distances on the level from the one given, m, and turned by these angles, degrees: with what the
/// coarsest surfels reach, they cover a metre and twenty degrees.
const TRIED: ([f64; 3], [f64; 3]) = ([-0.7, 0.0, 0.7], [-14.0, 0.0, 14.0]);
/// Most patches of a resolution that are laid upon the map.
const MOST: usize = 2000;
/// Iterations a resolution.
const ITERATIONS: usize = 8;
/// In the first of them planes may be this share of a voxel's edge apart, in the last that one.
const GATES: (f64, f64) = (0.5, 0.1);
/// Normals may differ by this much at first, degrees.
const ANGLE_DEG: f64 = 30.0;
/// Both frames are level to this, degrees.
const LEVEL_DEG: f64 = 1.0;
/// Fewest finest patches of which a place can be told.
const FEWEST: usize = 50;
/// Least share of them that lies on the map.
const SHARE: f64 = 0.4;
/// Another place is another from this distance on, m, or this angle, rad; and as good as the best at this share of what
/// that has.
const OTHER: (f64, f64, f64) = (0.3, 0.1, 0.85);

/// Where something was found in a map.
#[derive(Debug, Clone, PartialEq)]
pub struct Located {
    /// Where it is.
    pub map_from_seen: Pose,
    /// Share of its finest surfels that lie on the map.
    pub share: f64,
    /// Root mean square of their distances along normals, m.
    pub residual_rms_m: f64,
    /// Covariance of a turn (rad) about where it was seen from, and a shift (m), in the map.
    pub(in crate::estimation) covariance: Matrix6<f64>,
}

/// A map in which places are looked for.
#[derive(Debug)]
pub(in crate::estimation) struct Locator {
    matcher: Matcher,
    patches: Vec<Patch>,
    forest: Forest,
    inflation: f64,
    sigma_m: f64,
}

/// What the matches of an iteration say.
#[derive(Default)]
struct Tally {
    information: Matrix6<f64>,
    right: Vector6<f64>,
    matched: usize,
    squares: f64,
}

/// How to match in an iteration.
struct Gate {
    level: usize,
    gate_m: f64,
    /// Standard deviation of a match, m, beside its surfels' thickness.
    sigma_m: f64,
}

impl Locator {
    /// Of things that are seen by surfels of `surfels`; a match is off by `sigma_m` beside its surfels' thickness, and the
    /// covariance is `inflation` times what matches say.
    pub(in crate::estimation) fn new(
        map: &SurfelMap,
        (matching, surfels): (&MatchingSpec, &SurfelSpec),
        (sigma_m, inflation): (f64, f64),
    ) -> Self {
        let patches: Vec<Patch> = map.surfels().iter().map(Patch::of_map).collect();
        let forest = Matcher::new(matching, surfels).plant(&patches);
        let wide =
            MatchingSpec { max_normal_angle_deg: ANGLE_DEG.max(matching.max_normal_angle_deg), ..matching.clone() };
        Self { matcher: Matcher::new(&wide, surfels), patches, forest, inflation, sigma_m }
    }

    /// The map's patches.
    pub(in crate::estimation) fn patches(&self) -> &[Patch] {
        &self.patches
    }

    /// Where `seen`, looked at from `from`, is, which is about at `map_from_seen`.
    pub(in crate::estimation) fn find(
        &self,
        seen: &[Patch],
        from: &Vector,
        map_from_seen: &Pose,
    ) -> Result<Located, EstimationError> {
        let by_level: Vec<Vec<Patch>> = (0..self.matcher.levels).map(|level| some_of(seen, level)).collect();
        let finest = by_level.first().map_or(0, Vec::len);
        let not_found = |why: String| Err(EstimationError::NotInMap(why));
        if finest < FEWEST {
            return not_found(format!("it shows {finest} patches of surface, and {FEWEST} at least are needed"));
        }
        let mut starts = Vec::new();
        for yaw_deg in TRIED.1 {
            for (x, y) in TRIED.0.iter().flat_map(|x| TRIED.0.iter().map(|y| (*x, *y))) {
                starts.push(tried(map_from_seen, from, yaw_deg.to_radians(), Vector::new(x, y, 0.0)));
            }
        }
        let mut found: Vec<Located> =
            starts.par_iter().filter_map(|start| self.settle(&by_level, from, start)).collect();
        found.sort_by(|a, b| b.share.total_cmp(&a.share));
        let Some(best) = found.first().filter(|best| best.share >= SHARE) else {
            let share = 100.0 * found.first().map_or(0.0, |best| best.share);
            return not_found(format!("at the best place {share:.0} % of what was seen lies on the map"));
        };
        let other = found.iter().find(|other| other.share > OTHER.2 * best.share && is_elsewhere(best, other, from));
        match other {
            Some(other) => {
                let apart = other.map_from_seen.transform_point(&(*from).into()).coords
                    - best.map_from_seen.transform_point(&(*from).into()).coords;
                not_found(format!("it may be there as well as {:.1} m from there", apart.norm()))
            }
            None => Ok(best.clone()),
        }
    }

    /// Where what was seen settles from a start, from coarse to fine; `None` where the matches determine nothing.
    fn settle(&self, by_level: &[Vec<Patch>], from: &Vector, start: &Pose) -> Option<Located> {
        let mut pose = *start;
        for (level, seen) in by_level.iter().enumerate().rev().filter(|(_, seen)| !seen.is_empty()) {
            let edge_m = self.matcher.finest_voxel_m * f64::from(1_u32 << level);
            for iteration in 0..ITERATIONS {
                let late = iteration as f64 / (ITERATIONS - 1) as f64;
                let gate_m = edge_m * GATES.0 * (GATES.1 / GATES.0).powf(late);
                let gate = Gate { level, gate_m, sigma_m: gate_m / 3.0 };
                let pivot = pose.transform_point(&(*from).into()).coords;
                let mut tally = self.tally(seen, &pose, &pivot, &gate);
                let tilt = (pose.rotation * start.rotation.inverse()).scaled_axis();
                // What a resolution does not tell stays as it is.
                tally.information += Matrix6::identity();
                let level_weight = LEVEL_DEG.to_radians().powi(-2);
                for axis in 0..2 {
                    tally.information[(axis, axis)] += level_weight;
                    tally.right[axis] -= level_weight * tilt[axis];
                }
                let step = (tally.matched >= 6).then(|| tally.information.cholesky())??.solve(&tally.right);
                pose = corrected(&pose, &pivot, &step);
                if step.amax() < 1e-5 {
                    break;
                }
            }
        }
        let seen = by_level.first()?;
        let pivot = pose.transform_point(&(*from).into()).coords;
        let gate_m = self.matcher.finest_voxel_m * GATES.1;
        let tally = self.tally(seen, &pose, &pivot, &Gate { level: 0, gate_m, sigma_m: self.sigma_m });
        let covariance = tally.information.try_inverse()? * self.inflation;
        let residual_rms_m = (tally.squares / tally.matched.max(1) as f64).sqrt();
        let share = tally.matched as f64 / seen.len() as f64;
        Some(Located { map_from_seen: pose, share, residual_rms_m, covariance })
    }

    /// Matches of what was seen at `pose` with the map, for a turn about `pivot` and a shift.
    fn tally(&self, seen: &[Patch], pose: &Pose, pivot: &Vector, gate: &Gate) -> Tally {
        let mut tally = Tally::default();
        for patch in seen {
            let patch = patch.moved_by(pose);
            let near = self.matcher.neighbours(&self.forest, &patch, 1);
            let Some(other) = near.first().map(|k| &self.patches[*k as usize]) else { continue };
            debug_assert_eq!(other.level, gate.level);
            if !self.matcher.agree(&patch, other, gate.gate_m) {
                continue;
            }
            let plane = Plane::of(&patch, other, gate.sigma_m);
            let (turn, distance_m) = ((patch.centre - pivot).cross(&plane.normal), plane.distance_m);
            let row = Vector6::new(turn.x, turn.y, turn.z, plane.normal.x, plane.normal.y, plane.normal.z);
            let weight = 1.0 / (plane.variance + distance_m * distance_m);
            tally.information += row * row.transpose() * weight;
            tally.right -= row * (weight * distance_m);
            tally.matched += 1;
            tally.squares += distance_m * distance_m;
        }
        tally
    }
}

/// Patches of a resolution, evenly chosen where there are too many.
fn some_of(seen: &[Patch], level: usize) -> Vec<Patch> {
    let all: Vec<&Patch> = seen.iter().filter(|patch| patch.level == level).collect();
    all.iter().step_by(all.len().div_ceil(MOST).max(1)).map(|patch| **patch).collect()
}

/// A start turned about the vertical through `from`, and shifted.
fn tried(map_from_seen: &Pose, from: &Vector, yaw: f64, by: Vector) -> Pose {
    let pivot = map_from_seen.transform_point(&(*from).into()).coords;
    corrected(map_from_seen, &pivot, &Vector6::new(0.0, 0.0, yaw, by.x, by.y, by.z))
}

/// A pose turned about `pivot` and shifted.
fn corrected(pose: &Pose, pivot: &Vector, step: &Vector6<f64>) -> Pose {
    let turn = Rotation::from_scaled_axis(step.fixed_rows::<3>(0).into_owned());
    let shift: Vector = step.fixed_rows::<3>(3).into_owned();
    let translation = pivot + shift + turn * (pose.translation.vector - pivot);
    Pose::from_parts(translation.into(), turn * pose.rotation)
}

fn is_elsewhere(a: &Located, b: &Located, from: &Vector) -> bool {
    let place = |located: &Located| located.map_from_seen.transform_point(&(*from).into()).coords;
    let turn = a.map_from_seen.rotation.angle_to(&b.map_from_seen.rotation);
    (place(a) - place(b)).norm() > OTHER.0 || turn > OTHER.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation;
    use crate::geometry::{Matrix, from_roll_pitch_yaw};

    /// Patches of a resolution of a room of 6 m by 4 m by 2.5 m with a pillar, seen from within; `at` tells where in its
    /// cell each has its centre.
    fn room(edge_m: f64, level: usize, at: f64) -> Vec<Patch> {
        let mut patches = Vec::new();
        let mut wall = |corner: Vector, along: Vector, up: Vector, normal: Vector| {
            let (wide, high) = (along.norm(), up.norm());
            let (columns, rows) = ((wide / edge_m).ceil() as usize, (high / edge_m).ceil() as usize);
            for (i, j) in (0..columns).flat_map(|i| (0..rows).map(move |j| (i, j))) {
                let share = |k: usize, of: usize| (k as f64 + at) / of as f64;
                let centre = corner + along * share(i, columns) + up * share(j, rows);
                let (u, v) = (along / wide, up / high);
                let flat = (u * u.transpose() + v * v.transpose()) * (edge_m * edge_m / 12.0);
                let covariance: Matrix = flat + normal * normal.transpose() * 1e-4;
                patches.push(Patch { centre, normal, points: 100.0, covariance, doubt: 0.0, level });
            }
        };
        let (x, y, z) = (Vector::x(), Vector::y(), Vector::z());
        wall(Vector::zeros(), x * 6.0, y * 4.0, z);
        wall(z * 2.5, x * 6.0, y * 4.0, -z);
        wall(Vector::zeros(), x * 6.0, z * 2.5, y);
        wall(y * 4.0, x * 6.0, z * 2.5, -y);
        wall(Vector::zeros(), y * 4.0, z * 2.5, x);
        wall(x * 6.0, y * 4.0, z * 2.5, -x);
        wall(Vector::new(2.0, 1.0, 0.0), y * 0.8, z * 2.5, -x);
        wall(Vector::new(2.8, 1.0, 0.0), y * 0.8, z * 2.5, x);
        wall(Vector::new(2.0, 1.8, 0.0), x * 0.8, z * 2.5, y);
        patches
    }

    fn all_levels(edge_m: f64, at: f64) -> Vec<Patch> {
        (0..3).flat_map(|level| room(edge_m * f64::from(1 << level), level, at)).collect()
    }

    fn locator(patches: &[Patch]) -> Locator {
        let spec = estimation::load("default").unwrap();
        let map = SurfelMap::new(0.4, 3, patches.iter().map(|patch| patch.to_map(0.002)).collect()).unwrap();
        Locator::new(&map, (&spec.matching, &spec.surfels), (0.01, 7.0))
    }

    #[test]
    fn a_room_is_found_again_from_a_metre_and_twenty_degrees_away() {
        let locator = locator(&all_levels(0.4, 0.5));
        for k in 0..12 {
            let wave = |m: f64| (k as f64 * m + 0.3).sin();
            // Where it truly is, and from where it was seen.
            let map_from_seen = Pose::from_parts(
                Vector::new(3.0 * wave(0.9), 2.0, -1.0).into(),
                from_roll_pitch_yaw(0.005, -0.004, 3.0 * wave(1.7)),
            );
            let from = map_from_seen.inverse_transform_point(&Vector::new(4.0, 2.5, 1.2).into()).coords;
            let seen: Vec<Patch> =
                all_levels(0.37, 0.4).iter().map(|patch| patch.moved_by(&map_from_seen.inverse())).collect();
            let direction = Vector::new(wave(2.3), wave(3.1), 0.3 * wave(4.7)).normalize();
            let start = tried(&map_from_seen, &from, 20_f64.to_radians() * wave(5.3).signum(), direction);
            let found = locator.find(&seen, &from, &start).unwrap();
            let apart = found.map_from_seen.inverse() * map_from_seen;
            assert!(apart.translation.vector.norm() < 2e-3 && apart.rotation.angle() < 1e-3, "{k}: {apart}");
            assert!(found.share > 0.9, "{}", found.share);
        }
    }

    #[test]
    fn another_room_is_not_taken_for_it_and_too_little_tells_nothing() {
        let locator = locator(&all_levels(0.4, 0.5));
        let far = Pose::translation(30.0, 0.0, 0.0);
        let seen = all_levels(0.4, 0.5);
        let from = Vector::new(4.0, 2.5, 1.2);
        assert!(matches!(locator.find(&seen, &from, &far), Err(EstimationError::NotInMap(_))));
        let few: Vec<Patch> = seen.iter().take(20).copied().collect();
        let said = locator.find(&few, &from, &Pose::identity()).unwrap_err().to_string();
        assert!(said.contains("20 patches"), "{said}");
    }
}
