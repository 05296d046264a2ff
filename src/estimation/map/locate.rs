//! Where in a map something was seen: from about where it may be, coarse to fine.
//!
//! What was seen is put into the map from several starts, and laid upon it: neighbours in six dimensions, matched as in
//! a window; a rigid motion that brings matched planes together (Chen and Medioni 1992), robustly; again, from the
//! coarsest resolution to the finest. Of the places found so the one counts in which most of what was seen lies on the
//! map, where no other is nearly as good.

use super::search::Search;
use crate::estimation::matching::{Forest, Matcher};
use crate::estimation::residual::matched::Plane;
use crate::estimation::spec::{MatchingSpec, SurfelSpec};
use crate::estimation::surfel::Patch;
use crate::estimation::window::MIN_SIGNIFICANT_TILT;
use crate::geometry::{Matrix, Pose, Rotation, Vector};
use crate::surfel_map::SurfelMap;
use nalgebra::{Matrix6, Vector6};
use rayon::prelude::*;

/// A direction along which normals lean by less than this share, in the mean of their squares, is not told by them.
const WEAK: f64 = 0.01;
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
/// Of how many directions of a shift nothing may be told: along a corridor of one; over bare ground of two, and of the
/// heading.
const MOST_UNTOLD: f64 = 1.5;
/// Information that holds a pose where it is along what is not told, 1/m^2: more than all matches together.
const UNMOVED: f64 = 1e12;
/// Fewest finest patches of which a place can be told.
const FEWEST: usize = 50;
/// Starts that settled so near to each other, m and rad, are one.
const SAME: f64 = 0.01;
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
    /// Share of those that have a patch of the map beside them.
    pub(in crate::estimation) agreement: f64,
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
    /// Their normals, each with its weight.
    normals: Vec<(Vector, f64)>,
    /// How many had a patch beside them, matched or not.
    beside: usize,
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
    /// Of things that are seen by surfels of `surfels`; a match is off by `sigma_m` beside its surfels' thickness, and
    /// the covariance is `inflation` times what matches say.
    pub(in crate::estimation) fn new(map: &SurfelMap, by: (&MatchingSpec, &SurfelSpec), certainty: (f64, f64)) -> Self {
        Self::among(map.surfels().iter().map(Patch::of_map).collect(), by, certainty)
    }

    /// The same among `patches`.
    pub(in crate::estimation) fn among(
        patches: Vec<Patch>,
        (matching, surfels): (&MatchingSpec, &SurfelSpec),
        (sigma_m, inflation): (f64, f64),
    ) -> Self {
        let forest = Matcher::new(matching, surfels).plant(&patches);
        let wide =
            MatchingSpec { max_normal_angle_deg: ANGLE_DEG.max(matching.max_normal_angle_deg), ..matching.clone() };
        Self { matcher: Matcher::new(&wide, surfels), patches, forest, inflation, sigma_m }
    }

    /// The map's patches.
    pub(in crate::estimation) fn patches(&self) -> &[Patch] {
        &self.patches
    }

    /// Where `seen`, looked at from `from`, is, which is about at `map_from_seen`; or why that is not found.
    pub(in crate::estimation) fn find(
        &self,
        seen: &[Patch],
        (from, map_from_seen): (&Vector, &Pose),
        search: &Search,
    ) -> Result<Located, String> {
        let by_level = self.by_level(seen);
        let finest = by_level.first().map_or(0, Vec::len);
        if finest < FEWEST {
            return Err(format!("it shows {finest} patches of surface, and {FEWEST} at least are needed"));
        }
        let places = self.settled(&by_level, search.starts(map_from_seen, from), from);
        let judged = self.judged(&by_level[0], from, &places, search.gate_m);
        // Each with what it is worth.
        let worth = |found: &Located| found.share.powi(3) * search.likely(&found.map_from_seen, map_from_seen, from);
        let mut found: Vec<(f64, Located)> = judged.map(|found| (worth(&found), found)).collect();
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        let Some((worth, best)) = found.iter().find(|(worth, found)| *worth > 0.0 && search.believes(found)) else {
            let best = found.first().map_or((0.0, 0.0), |(_, best)| (100.0 * best.share, 100.0 * best.agreement));
            let (share, agreement) = best;
            let residual_mm = found.first().map_or(0.0, |(_, best)| 1e3 * best.residual_rms_m);
            return Err(format!(
                "at the best place {share:.0} % of what was seen lies on the map, {agreement:.0} % of what could, to \
                 {residual_mm:.0} mm"
            ));
        };
        let as_good = found.iter().filter(|(other, found)| *other > OTHER.2 * worth && search.believes(found));
        let others: Vec<&Located> =
            as_good.map(|(_, other)| other).filter(|other| is_elsewhere(best, other, from)).collect();
        match others.first() {
            Some(other) if !search.nearest => {
                let (far_m, _) = apart(&best.map_from_seen, &other.map_from_seen, from);
                Err(format!("it may be there as well as {far_m:.1} m from there"))
            }
            _ => Ok(best.in_doubt_with(&others, from)),
        }
    }

    /// What was seen, by resolution, as many of each as are laid upon the map.
    pub(super) fn by_level(&self, seen: &[Patch]) -> Vec<Vec<Patch>> {
        (0..self.matcher.levels).map(|level| some_of(seen, level)).collect()
    }

    /// Where what was seen settles from some starts, from the coarsest resolution to the finest.
    pub(super) fn settled(
        &self,
        by_level: &[Vec<Patch>],
        mut places: Vec<(Pose, Pose)>,
        from: &Vector,
    ) -> Vec<(Pose, Pose)> {
        for (level, seen) in by_level.iter().enumerate().rev().filter(|(_, seen)| !seen.is_empty()) {
            let settled = places
                .par_iter()
                .filter_map(|(start, pose)| Some((*start, self.settle((level, seen), from, start, pose)?)));
            places = settled.collect();
            leave_one_of_each(&mut places, from);
        }
        places
    }

    /// What places are worth by the finest patches; those where they determine nothing are left out.
    pub(super) fn judged<'a>(
        &'a self,
        finest: &'a [Patch],
        from: &'a Vector,
        places: &'a [(Pose, Pose)],
        gate_m: Option<f64>,
    ) -> impl Iterator<Item = Located> + 'a {
        let gate_m = gate_m.unwrap_or(self.matcher.finest_voxel_m * GATES.1);
        places.iter().filter_map(move |(_, pose)| self.judge(finest, from, pose, gate_m))
    }

    /// Where the patches of a resolution that were seen settle from a pose, as level as they were at `start`; `None`
    /// where the matches determine nothing.
    fn settle(&self, (level, seen): (usize, &[Patch]), from: &Vector, start: &Pose, pose: &Pose) -> Option<Pose> {
        let mut pose = *pose;
        let edge_m = self.matcher.finest_voxel_m * f64::from(1_u32 << level);
        for iteration in 0..ITERATIONS {
            let late = iteration as f64 / (ITERATIONS - 1) as f64;
            let gate_m = edge_m * GATES.0 * (GATES.1 / GATES.0).powf(late);
            let gate = Gate { level, gate_m, sigma_m: gate_m / 3.0 };
            let pivot = pose.transform_point(&(*from).into()).coords;
            let mut tally = self.tally(seen, &pose, &pivot, &gate);
            let tilt = (pose.rotation * start.rotation.inverse()).scaled_axis();
            // What a resolution does not tell stays as it is.
            tally.information += Matrix6::identity() + tally.untold() * UNMOVED;
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
        Some(pose)
    }

    /// What a pose is worth by the finest patches that were seen; `None` where they determine nothing.
    fn judge(&self, seen: &[Patch], from: &Vector, pose: &Pose, gate_m: f64) -> Option<Located> {
        let pivot = pose.transform_point(&(*from).into()).coords;
        let tally = self.tally(seen, pose, &pivot, &Gate { level: 0, gate_m, sigma_m: self.sigma_m });
        let untold = tally.untold();
        if untold.trace() > MOST_UNTOLD {
            return None;
        }
        // What is not told is known to a metre and a radian.
        let told = Matrix6::identity() - untold;
        let information = told * tally.information * told + Matrix6::identity();
        let covariance = information.try_inverse()? * self.inflation;
        let residual_rms_m = (tally.squares / tally.matched.max(1) as f64).sqrt();
        let share = tally.matched as f64 / seen.len() as f64;
        let agreement = tally.matched as f64 / tally.beside.max(1) as f64;
        Some(Located { map_from_seen: *pose, share, agreement, residual_rms_m, covariance })
    }

    /// Matches of what was seen at `pose` with the map, for a turn about `pivot` and a shift.
    fn tally(&self, seen: &[Patch], pose: &Pose, pivot: &Vector, gate: &Gate) -> Tally {
        let mut tally = Tally::default();
        for patch in seen {
            let patch = patch.moved_by(pose);
            let near = self.matcher.neighbours(&self.forest, &patch, 1);
            let Some(other) = near.first().map(|k| &self.patches[*k as usize]) else { continue };
            debug_assert_eq!(other.level, gate.level);
            tally.beside += 1;
            if !self.matcher.agree(&patch, other, gate.gate_m) {
                continue;
            }
            let plane = Plane::of(&patch, other, gate.sigma_m);
            let (turn, distance_m) = ((patch.centre - pivot).cross(&plane.normal), plane.distance_m);
            let row = Vector6::new(turn.x, turn.y, turn.z, plane.normal.x, plane.normal.y, plane.normal.z);
            let weight = 1.0 / (plane.variance + distance_m * distance_m);
            tally.information += row * row.transpose() * weight;
            tally.right -= row * (weight * distance_m);
            tally.normals.push((plane.normal, weight));
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

/// Of places that are the same, the first.
fn leave_one_of_each(places: &mut Vec<(Pose, Pose)>, from: &Vector) {
    let mut left: Vec<(Pose, Pose)> = Vec::new();
    for (start, pose) in places.drain(..) {
        let is_other = |(_, other): &(Pose, Pose)| {
            let (far_m, turned) = apart(&pose, other, from);
            far_m > SAME || turned > SAME
        };
        if left.iter().all(is_other) {
            left.push((start, pose));
        }
    }
    *places = left;
}

/// A start turned about the vertical through `from`, and shifted.
pub(super) fn tried(map_from_seen: &Pose, from: &Vector, yaw: f64, by: Vector) -> Pose {
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

impl Tally {
    /// Of the directions of a shift those that no normals tell but by their errors: `sum e e^T` in the block of the
    /// shift.
    fn untold(&self) -> Matrix6<f64> {
        let sum: f64 = self.normals.iter().map(|(_, weight)| weight).sum();
        let scatter: Matrix = self.normals.iter().map(|(normal, weight)| normal * normal.transpose() * *weight).sum();
        let mut untold = Matrix6::zeros();
        for direction in scatter.symmetric_eigen().eigenvectors.column_iter() {
            let lean = |(normal, weight): &(Vector, f64)| (normal.dot(&direction), *weight);
            let held = self.normals.iter().map(lean).filter(|(lean, _)| lean.abs() > MIN_SIGNIFICANT_TILT);
            if held.map(|(lean, weight)| lean * lean * weight).sum::<f64>() < WEAK * sum {
                let mut block = untold.fixed_view_mut::<3, 3>(3, 3);
                block += direction * direction.transpose();
            }
        }
        untold
    }
}

impl Located {
    /// The same place, with the doubt that `others` are as good.
    fn in_doubt_with(&self, others: &[&Located], from: &Vector) -> Self {
        let mut covariance = self.covariance;
        for other in others {
            let turn = (other.map_from_seen.rotation * self.map_from_seen.rotation.inverse()).scaled_axis();
            let place = |located: &Located| located.map_from_seen.transform_point(&(*from).into()).coords;
            let shift = place(other) - place(self);
            let by = Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z);
            covariance += by * by.transpose() / (others.len() + 1) as f64;
        }
        Self { covariance, ..self.clone() }
    }
}

/// Whether two places are not the same.
pub(super) fn is_elsewhere(a: &Located, b: &Located, from: &Vector) -> bool {
    let (far_m, turned) = apart(&a.map_from_seen, &b.map_from_seen, from);
    far_m > OTHER.0 || turned > OTHER.1
}

/// How far apart two poses put `from`, m, and by what angle they differ, rad.
pub(super) fn apart(a: &Pose, b: &Pose, from: &Vector) -> (f64, f64) {
    let place = |pose: &Pose| pose.transform_point(&(*from).into()).coords;
    ((place(a) - place(b)).norm(), a.rotation.angle_to(&b.rotation))
}

#[cfg(test)]
mod tests {
    use super::super::search::IN_MAP;
    use super::*;
    use crate::estimation;
    use crate::geometry::from_roll_pitch_yaw;

    /// Patches of a resolution of a room of 6 m by 4 m by 2.5 m with a pillar, seen from within; `at` tells where in
    /// its cell each has its centre.
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
            let found = locator.find(&seen, (&from, &start), &IN_MAP).unwrap();
            let apart = found.map_from_seen.inverse() * map_from_seen;
            assert!(apart.translation.vector.norm() < 2e-3 && apart.rotation.angle() < 1e-3, "{k}: {apart}");
            assert!(found.share > 0.9, "{}", found.share);
        }
    }

    #[test]
    fn a_symmetric_room_from_the_wrong_end_is_better_elsewhere() {
        let locator = locator(&all_levels(0.4, 0.5));
        let seen = all_levels(0.37, 0.4);
        let from = Vector::new(4.0, 2.5, 1.2);
        // The room turned by half a circle about its middle: all but the pillar is the same.
        let half = from_roll_pitch_yaw(0.0, 0.0, std::f64::consts::PI);
        let wrong = Pose::from_parts(Vector::new(6.0, 4.0, 0.0).into(), half);
        let found = locator.find(&seen, (&from, &wrong), &IN_MAP).unwrap();
        assert!(apart(&found.map_from_seen, &wrong, &from).0 < 0.1 && found.share > 0.7, "{}", found.share);
        let better = locator.better_elsewhere(&seen, &from, &found).unwrap();
        let (far_m, turned) = apart(&better.map_from_seen, &Pose::identity(), &from);
        assert!(far_m < 2e-3 && turned < 1e-3, "{far_m} m, {turned} rad");
        // From the right end there is none.
        let found = locator.find(&seen, (&from, &Pose::identity()), &IN_MAP).unwrap();
        assert_eq!(locator.better_elsewhere(&seen, &from, &found), None);
    }

    /// Patches of a resolution of a corridor without ends along x, 2 m wide, between `from_m` and `to_m`.
    fn corridor(level: usize, (from_m, to_m): (f64, f64)) -> Vec<Patch> {
        let edge_m = 0.4 * f64::from(1 << level);
        let mut patches = Vec::new();
        for i in 0..((to_m - from_m) / edge_m) as usize {
            let x = Vector::x() * (from_m + (i as f64 + 0.5) * edge_m);
            let mut wall = |place: Vector, normal: Vector| {
                let across = Matrix::identity() - normal * normal.transpose();
                let covariance = across * (edge_m * edge_m / 12.0) + normal * normal.transpose() * 1e-4;
                let centre = x + place;
                patches.push(Patch { centre, normal, points: 100.0, covariance, doubt: 0.0, level });
            };
            for k in 0..((2.0 / edge_m) as usize).max(1) {
                let along = (k as f64 + 0.5) * edge_m;
                wall(Vector::new(0.0, along, 0.0), Vector::z());
                wall(Vector::new(0.0, 0.0, along), Vector::y());
                wall(Vector::new(0.0, 2.0, along), -Vector::y());
            }
        }
        patches
    }

    #[test]
    fn along_a_corridor_a_head_stays_where_it_is_expected_and_is_in_doubt() {
        let all = |reach: (f64, f64)| (0..3).flat_map(|level| corridor(level, reach)).collect::<Vec<_>>();
        let locator = locator(&all((0.0, 24.0)));
        let from = Vector::new(14.0, 1.0, 1.2);
        let seen = all((8.0, 20.0));
        // Expected 0.2 m to the side, and turned by a tenth.
        let start = tried(&Pose::identity(), &from, 0.1, Vector::new(0.0, 0.2, 0.0));
        let found = locator.find(&seen, (&from, &start), &Search::behind_silence(1.0, 0.01)).unwrap();
        let apart = found.map_from_seen.transform_point(&from.into()).coords - from;
        assert!(apart.y.abs() < 2e-3 && apart.z.abs() < 2e-3 && apart.x.abs() < 0.05, "{apart}");
        assert!(found.map_from_seen.rotation.angle() < 1e-3, "{}", found.map_from_seen);
        let sigma = |k: usize| found.covariance[(k, k)].sqrt();
        assert!(sigma(3) > 0.2 && sigma(4) < 0.01, "{} m along, {} m across", sigma(3), sigma(4));
        // In a map that should tell where it is, that is no place.
        assert!(locator.find(&seen, (&from, &start), &IN_MAP).unwrap_err().contains("as well as"));
    }

    #[test]
    fn bare_ground_tells_no_place() {
        let ground = |reach: (f64, f64)| {
            let all = (0..3).flat_map(|level| corridor(level, reach));
            all.filter(|patch| patch.normal == Vector::z()).collect::<Vec<_>>()
        };
        let (from, start) = (Vector::new(14.0, 1.0, 1.2), Pose::identity());
        let found = locator(&ground((0.0, 24.0))).find(
            &ground((8.0, 20.0)),
            (&from, &start),
            &Search::behind_silence(0.5, 0.01),
        );
        assert!(found.is_err(), "{found:?}");
    }

    #[test]
    fn another_room_is_not_taken_for_it_and_too_little_tells_nothing() {
        let locator = locator(&all_levels(0.4, 0.5));
        let far = Pose::translation(30.0, 0.0, 0.0);
        let seen = all_levels(0.4, 0.5);
        let from = Vector::new(4.0, 2.5, 1.2);
        assert!(locator.find(&seen, (&from, &far), &IN_MAP).unwrap_err().contains("lies on the map"));
        let few: Vec<Patch> = seen.iter().take(20).copied().collect();
        let said = locator.find(&few, (&from, &Pose::identity()), &IN_MAP).unwrap_err();
        assert!(said.contains("20 patches"), "{said}");
    }
}
