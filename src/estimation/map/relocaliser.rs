//! Relocalisation: finds the pose of observed surfels (the query) in a map, from an approximate pose.
//!
//! From several start poses the query is registered to the map: nearest neighbours in six dimensions as in a window, then
//! the rigid motion that minimises point-to-plane distances (Chen and Medioni 1992) with robust weights, iterated from the
//! coarsest resolution to the finest. The result is the pose with the highest fraction of matched surfels, provided that no
//! different pose is nearly as good.

use super::limits::{MAP_LIMITS, RelocalisationLimits};
use super::localised_pose::{LocalisedPose, apply_step, pose_distance};
use crate::matching::{Matcher, SearchTrees};
use crate::residual::matched::MIN_SIGNIFICANT_TILT;
use crate::residual::matched::Plane;
use crate::spec::{MatchingSpec, SolveSpec, SurfelSpec};
use crate::surfel::Patch;
use nalgebra::{Matrix6, Vector6};
use rayon::prelude::*;
use zsim_base::geometry::{Matrix, Pose, Vector};
use zsim_base::surfel_map::SurfelMap;

#[cfg(test)]
mod tests;

/// A direction is unobservable if the weighted mean square of the normals' components along it is below this.
const MIN_NORMAL_SQUARE: f64 = 0.01;
/// Maximum number of query patches per resolution.
const MAX_PATCHES: usize = 2000;
/// Iterations per resolution.
const ITERATIONS: usize = 8;
/// Match gate along the normal in the first and the last iteration, as a fraction of the voxel edge.
const MATCH_GATE_EDGES: (f64, f64) = (0.5, 0.1);
/// Minimum gate on the angle between normals, degrees: start poses are up to half a heading step off.
const NORMAL_GATE_DEG: f64 = 30.0;
/// Standard deviation of roll and pitch between the two level frames, degrees.
const LEVEL_SIGMA_DEG: f64 = 1.0;
/// Maximum number of unobservable directions of translation: a corridor has one; bare ground has two (and no heading), and is
/// rejected.
const MAX_UNOBSERVABLE: f64 = 1.5;
/// Information that fixes the pose along unobservable directions, 1/m^2: larger than that of all matches.
const FIXED_INFORMATION: f64 = 1e12;
/// Minimum number of finest query patches for a relocalisation.
const MIN_PATCHES: usize = 50;
/// Poses that converged to within this distance, m and rad, are duplicates.
const DUPLICATE_POSE_TOLERANCE: f64 = 0.01;
/// Two poses are different above this distance, m, or angle, rad.
const DIFFERENT_POSE: (f64, f64) = (0.3, 0.1);
/// A different pose competes with the best one if it has at least this fraction of the score of the best; in a whole map, of its
/// inlier ratio.
pub(super) const COMPETING_SCORE: f64 = 0.85;
/// After a gap a pose is rejected if another with more than this multiple of its score is farther away than this, m.
const ALTERNATIVE: (f64, f64) = (0.5, 1.0);

/// Finds poses in a map of patches.
#[derive(Debug)]
pub(crate) struct Relocaliser {
    matcher: Matcher,
    patches: Vec<Patch>,
    trees: SearchTrees,
    /// Standard deviation of a match in addition to surfel thickness, m.
    sigma_m: f64,
}

/// Sums over the matches of one iteration.
#[derive(Default)]
struct MatchSums {
    /// Normal matrix and right-hand side, for a rotation about the viewpoint and a translation.
    information: Matrix6<f64>,
    right: Vector6<f64>,
    matched: usize,
    /// Normals of the matches and their weights.
    normals: Vec<(Vector, f64)>,
    /// Number of query patches with a neighbour in the map, matched or not.
    with_neighbour: usize,
    /// Sum of squared distances, m^2.
    squares: f64,
}

/// Match settings of one iteration.
struct Gate {
    level: usize,
    /// Maximum distance along the normals, m.
    gate_m: f64,
    /// Standard deviation of a match in addition to surfel thickness, m.
    sigma_m: f64,
}

impl Relocaliser {
    /// Relocaliser in `map`, for queries with the surfel settings `surfels`.
    pub(crate) fn new(map: &SurfelMap, matching: &MatchingSpec, surfels: &SurfelSpec, solve: &SolveSpec) -> Self {
        let patches = map.surfels().iter().map(Patch::from_map_surfel).collect();
        Self::in_patches(patches, matching, surfels, solve)
    }

    /// Relocaliser in `patches`, which are in one frame.
    pub(crate) fn in_patches(
        patches: Vec<Patch>,
        matching: &MatchingSpec,
        surfels: &SurfelSpec,
        solve: &SolveSpec,
    ) -> Self {
        let trees = Matcher::new(matching, surfels).build_trees(&patches);
        let wide = MatchingSpec {
            max_normal_angle_deg: NORMAL_GATE_DEG.max(matching.max_normal_angle_deg),
            ..matching.clone()
        };
        Self { matcher: Matcher::new(&wide, surfels), patches, trees, sigma_m: solve.match_sigma_m }
    }

    /// The map's patches.
    pub(crate) fn patches(&self) -> &[Patch] {
        &self.patches
    }

    /// Finds the pose of `query`, observed from the point `from`, in a complete map, within 1 m and 20 degrees of `start`.
    ///
    /// # Errors
    /// The reason why no pose is accepted, and what to do.
    pub(crate) fn find_near(&self, query: &[Patch], from: &Vector, start: &Pose) -> Result<LocalisedPose, String> {
        self.find(query, from, start, &MAP_LIMITS).map_err(|why| {
            format!(
                "{why}; the search covers 1 m and 20 degrees about the start; set the start with `--start x,y,z,yaw` (m, \
                 degrees)"
            )
        })
    }

    /// Finds the pose of `query`, observed from the point `from`, near `map_from_query`.
    ///
    /// # Errors
    /// The reason why no pose is accepted.
    pub(crate) fn find(
        &self,
        query: &[Patch],
        from: &Vector,
        map_from_query: &Pose,
        limits: &RelocalisationLimits,
    ) -> Result<LocalisedPose, String> {
        let patches_by_level = self.patches_by_level(query);
        check_size(query)?;
        let poses = self.refine_all(&patches_by_level, limits.starts(map_from_query, from), from);
        let evaluated =
            self.evaluate_all(&patches_by_level[..limits.levels.min(self.matcher.levels)], from, &poses, limits.gate_m);
        let score = |found: &LocalisedPose| {
            limits.likelihood(found) * limits.prior(&found.map_from_query, map_from_query, from)
        };
        let mut found: Vec<(f64, LocalisedPose)> = evaluated.map(|found| (score(&found), found)).collect();
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        let Some((score, best)) = found.iter().find(|(score, found)| *score > 0.0 && limits.accepts(found)) else {
            let Some((_, best)) = found.first() else { return Err("at no pose surfels match the map".to_owned()) };
            return Err(format!(
                "at the best pose {} surfels ({:.0} %) match the map, {:.0} % of those with a neighbour (residual {:.0} mm)",
                best.matched,
                100.0 * best.inlier_ratio,
                100.0 * best.agreement,
                1e3 * best.residual_rms_m
            ));
        };
        let accepted: Vec<&(f64, LocalisedPose)> =
            found.iter().filter(|(score, found)| *score > 0.0 && limits.accepts(found)).collect();
        if limits.nearest {
            refuse_distant_alternative(&accepted, best, from)?;
            let ambiguity_m = limits.unmatched_m(best.inlier_ratio);
            return Ok(LocalisedPose { ambiguity_m, ..best.clone() }.with_alternatives(&accepted, from));
        }
        let competes = |(other, found): &&&(f64, LocalisedPose)| {
            *other > COMPETING_SCORE * score && is_different_pose(best, found, from)
        };
        match accepted.iter().find(competes) {
            Some((_, other)) => {
                let (distance_m, _) = pose_distance(&best.map_from_query, &other.map_from_query, from);
                Err(format!("ambiguous: another pose at a distance of {distance_m:.1} m matches as well"))
            }
            None => Ok(best.clone()),
        }
    }

    /// Query patches by resolution, at most `MAX_PATCHES` each.
    pub(super) fn patches_by_level(&self, query: &[Patch]) -> Vec<Vec<Patch>> {
        (0..self.matcher.levels).map(|level| subsample(query, level)).collect()
    }

    /// Refines start poses from the coarsest resolution to the finest; drops failures and duplicates.
    pub(super) fn refine_all(
        &self,
        patches_by_level: &[Vec<Patch>],
        mut poses: Vec<(Pose, Pose)>,
        from: &Vector,
    ) -> Vec<(Pose, Pose)> {
        for (level, query) in patches_by_level.iter().enumerate().rev().filter(|(_, query)| !query.is_empty()) {
            let refined = poses
                .par_iter()
                .filter_map(|(start, pose)| Some((*start, self.refine(level, query, from, start, pose)?)));
            poses = refined.collect();
            remove_duplicates(&mut poses, from);
        }
        poses
    }

    /// Evaluates poses with patches of one or more resolutions; skips poses that the matches do not determine.
    pub(super) fn evaluate_all<'a>(
        &'a self,
        patches_by_level: &'a [Vec<Patch>],
        from: &'a Vector,
        poses: &'a [(Pose, Pose)],
        gate_m: Option<f64>,
    ) -> impl Iterator<Item = LocalisedPose> + 'a {
        let gate_m = gate_m.unwrap_or(self.matcher.finest_voxel_m * MATCH_GATE_EDGES.1);
        poses.iter().filter_map(move |(_, pose)| self.evaluate(patches_by_level, from, pose, gate_m))
    }

    /// Refines a pose with the patches of one resolution; roll and pitch are constrained to the values at `start`.
    ///
    /// `None` if the matches do not determine the pose.
    fn refine(&self, level: usize, query: &[Patch], from: &Vector, start: &Pose, pose: &Pose) -> Option<Pose> {
        let mut pose = *pose;
        let edge_m = self.matcher.finest_voxel_m * f64::from(1_u32 << level);
        for iteration in 0..ITERATIONS {
            let late = iteration as f64 / (ITERATIONS - 1) as f64;
            let gate_m = edge_m * MATCH_GATE_EDGES.0 * (MATCH_GATE_EDGES.1 / MATCH_GATE_EDGES.0).powf(late);
            let gate = Gate { level, gate_m, sigma_m: gate_m / 3.0 };
            let pivot = pose.transform_point(&(*from).into()).coords;
            let mut sums = self.sum_matches(query, &pose, &pivot, &gate);
            let tilt = (pose.rotation * start.rotation.inverse()).scaled_axis();
            // Unobservable directions keep their value.
            sums.information += Matrix6::identity() + sums.unobservable() * FIXED_INFORMATION;
            let level_weight = LEVEL_SIGMA_DEG.to_radians().powi(-2);
            for axis in 0..2 {
                sums.information[(axis, axis)] += level_weight;
                sums.right[axis] -= level_weight * tilt[axis];
            }
            let step = (sums.matched >= 6).then(|| sums.information.cholesky())??.solve(&sums.right);
            pose = apply_step(&pose, &pivot, &step);
            if step.amax() < 1e-5 {
                break;
            }
        }
        Some(pose)
    }

    /// Evaluates a pose with patches of some resolutions; `None` if they leave too many directions unobservable.
    fn evaluate(
        &self,
        patches_by_level: &[Vec<Patch>],
        from: &Vector,
        pose: &Pose,
        gate_m: f64,
    ) -> Option<LocalisedPose> {
        let pivot = pose.transform_point(&(*from).into()).coords;
        let mut sums = MatchSums::default();
        for (level, query) in patches_by_level.iter().enumerate() {
            // Larger surfels are less plane.
            let edges = f64::from(1_u32 << level);
            let gate = Gate { level, gate_m: edges * gate_m, sigma_m: edges * self.sigma_m };
            sums.add(self.sum_matches(query, pose, &pivot, &gate));
        }
        let unobservable = sums.unobservable();
        if unobservable.trace() > MAX_UNOBSERVABLE {
            return None;
        }
        // Along unobservable directions the standard deviation is 1 m and 1 rad.
        let observable = Matrix6::identity() - unobservable;
        let information = observable * sums.information * observable + Matrix6::identity();
        let covariance = information.try_inverse()?;
        let residual_rms_m = (sums.squares / sums.matched.max(1) as f64).sqrt();
        let inlier_ratio = sums.matched as f64 / patches_by_level.iter().map(Vec::len).sum::<usize>() as f64;
        let agreement = sums.matched as f64 / sums.with_neighbour.max(1) as f64;
        Some(LocalisedPose {
            map_from_query: *pose,
            inlier_ratio,
            matched: sums.matched,
            agreement,
            residual_rms_m,
            covariance,
            ambiguity_m: 0.0,
        })
    }

    /// Matches the query at `pose` with the map; unknowns are a rotation about `pivot` and a translation.
    fn sum_matches(&self, query: &[Patch], pose: &Pose, pivot: &Vector, gate: &Gate) -> MatchSums {
        let mut sums = MatchSums::default();
        for patch in query {
            let patch = patch.moved_by(pose);
            let near = self.matcher.neighbours(&self.trees, &patch, 1);
            let Some(other) = near.first().map(|k| &self.patches[*k as usize]) else { continue };
            debug_assert_eq!(other.level, gate.level);
            sums.with_neighbour += 1;
            if !self.matcher.pass_gates(&patch, other, gate.gate_m) {
                continue;
            }
            let plane = Plane::of(&patch, other, gate.sigma_m);
            let (turn, distance_m) = ((patch.centre - pivot).cross(&plane.normal), plane.distance_m);
            let row = Vector6::new(turn.x, turn.y, turn.z, plane.normal.x, plane.normal.y, plane.normal.z);
            let weight = 1.0 / (plane.variance + distance_m * distance_m);
            sums.information += row * row.transpose() * weight;
            sums.right -= row * (weight * distance_m);
            sums.normals.push((plane.normal, weight));
            sums.matched += 1;
            sums.squares += distance_m * distance_m;
        }
        sums
    }
}

/// Refuses a query with too few of the finest patches.
pub(super) fn check_size(query: &[Patch]) -> Result<(), String> {
    match query.iter().filter(|patch| patch.level == 0).count() {
        finest if finest < MIN_PATCHES => {
            Err(format!("the query has {finest} finest surfels, at least {MIN_PATCHES} are needed"))
        }
        _ => Ok(()),
    }
}

/// Patches of a resolution, evenly subsampled to at most `MAX_PATCHES`.
fn subsample(query: &[Patch], level: usize) -> Vec<Patch> {
    let all: Vec<&Patch> = query.iter().filter(|patch| patch.level == level).collect();
    all.iter().step_by(all.len().div_ceil(MAX_PATCHES).max(1)).map(|patch| **patch).collect()
}

/// Keeps the first of duplicate poses.
fn remove_duplicates(poses: &mut Vec<(Pose, Pose)>, from: &Vector) {
    let mut distinct: Vec<(Pose, Pose)> = Vec::new();
    for (start, pose) in poses.drain(..) {
        let is_other = |(_, other): &(Pose, Pose)| {
            let (distance_m, angle) = pose_distance(&pose, other, from);
            distance_m > DUPLICATE_POSE_TOLERANCE || angle > DUPLICATE_POSE_TOLERANCE
        };
        if distinct.iter().all(is_other) {
            distinct.push((start, pose));
        }
    }
    *poses = distinct;
}

impl MatchSums {
    /// Adds the sums over other matches.
    fn add(&mut self, other: Self) {
        self.information += other.information;
        self.right += other.right;
        self.matched += other.matched;
        self.normals.extend(other.normals);
        self.with_neighbour += other.with_neighbour;
        self.squares += other.squares;
    }

    /// Projector on the unobservable directions of translation, `sum e e^T`, in the translation block.
    ///
    /// Small components of normals along a direction are errors of the normals and do not count.
    fn unobservable(&self) -> Matrix6<f64> {
        let sum: f64 = self.normals.iter().map(|(_, weight)| weight).sum();
        let scatter: Matrix = self.normals.iter().map(|(normal, weight)| normal * normal.transpose() * *weight).sum();
        let mut unobservable = Matrix6::zeros();
        for direction in scatter.symmetric_eigen().eigenvectors.column_iter() {
            let component = |(normal, weight): &(Vector, f64)| (normal.dot(&direction), *weight);
            let large =
                self.normals.iter().map(component).filter(|(component, _)| component.abs() > MIN_SIGNIFICANT_TILT);
            if large.map(|(component, weight)| component * component * weight).sum::<f64>() < MIN_NORMAL_SQUARE * sum {
                let mut block = unobservable.fixed_view_mut::<3, 3>(3, 3);
                block += direction * direction.transpose();
            }
        }
        unobservable
    }
}

/// Refuses `best` if another of the accepted poses, metres away, is about as likely.
fn refuse_distant_alternative(
    accepted: &[&(f64, LocalisedPose)],
    best: &LocalisedPose,
    from: &Vector,
) -> Result<(), String> {
    let best_score = accepted.iter().map(|(score, _)| *score).fold(0.0, f64::max);
    let likely = accepted.iter().filter(|(score, _)| *score > ALTERNATIVE.0 * best_score);
    let distance_m =
        likely.map(|(_, other)| pose_distance(&best.map_from_query, &other.map_from_query, from).0).fold(0.0, f64::max);
    if distance_m > ALTERNATIVE.1 {
        return Err(format!("ambiguous: another pose at a distance of {distance_m:.1} m is about as likely"));
    }
    Ok(())
}

/// Whether two poses differ by more than `DIFFERENT_POSE`.
pub(super) fn is_different_pose(a: &LocalisedPose, b: &LocalisedPose, from: &Vector) -> bool {
    let (distance_m, angle) = pose_distance(&a.map_from_query, &b.map_from_query, from);
    distance_m > DIFFERENT_POSE.0 || angle > DIFFERENT_POSE.1
}
