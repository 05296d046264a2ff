//! Point-to-plane registration of two nodes, and the agreement of their surfaces.

use crate::matching::{Matcher, SearchTrees};
use crate::surfel::Patch;
use nalgebra::{Matrix4, Vector4};
use zsim_base::geometry::{Matrix, Rotation, Vector};

/// Number of resolutions used for the registration.
pub(super) const ALIGNED_LEVELS: usize = 3;
/// Resolution at which the agreement is evaluated.
const COMPARED_LEVEL: usize = 1;
/// Maximum number of query surfels per resolution.
const MAX_QUERIES: usize = 400;
/// Maximum number of iterations per resolution.
const MAX_ITERATIONS: usize = 5;
/// The iterations end when a step is smaller than this, m and rad.
const CONVERGED: f64 = 1e-3;
/// Maximum distance of matches along the normal, in voxel edges of the resolution.
const GATE_EDGES: f64 = 0.25;
/// A surface faces a direction if the cosine between normal and direction exceeds this (45 degrees).
const FACING_COSINE: f64 = 0.7;
/// Minimum number of surfaces facing a direction for the evaluation.
const MIN_FACING: usize = 8;
/// A direction of translation is weak if its information is below this fraction of the largest one.
const WEAK_INFORMATION: f64 = 0.02;
/// Standard deviation of a match, m: drift within a node distorts the surfaces.
const MATCH_SIGMA_M: f64 = 0.1;

/// Relative pose of two levelled nodes: a point `x` of the first is at `Rz(yaw) x + shift` in the second.
///
/// Both are relative to their head positions, in map axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::registration) struct Alignment {
    /// Heading difference, rad.
    pub(in crate::registration) yaw: f64,
    /// Translation, m.
    pub(in crate::registration) shift: Vector,
}

impl Alignment {
    fn turn(&self) -> Matrix {
        Rotation::from_scaled_axis(Vector::z() * self.yaw).to_rotation_matrix().into_inner()
    }

    fn moved(&self, patch: &Patch, turn: &Matrix) -> Patch {
        Patch { centre: turn * patch.centre + self.shift, normal: turn * patch.normal, ..*patch }
    }

    /// Difference of two alignments, m and rad.
    pub(super) fn difference(&self, other: &Self) -> (f64, f64) {
        let turns = (self.yaw - other.yaw) / std::f64::consts::TAU;
        ((self.shift - other.shift).norm(), ((turns - turns.round()) * std::f64::consts::TAU).abs())
    }
}

/// Surfels of a node with a search index.
pub(super) struct NodeSurfels {
    /// All surfels of the used resolutions.
    patches: Vec<Patch>,
    trees: SearchTrees,
    /// Subsampled query surfels of each resolution.
    queries: Vec<Vec<Patch>>,
}

/// Result of a registration.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fit {
    pub(super) alignment: Alignment,
    /// Information of the matches about `[yaw, shift]`, 1/rad^2 and 1/m^2.
    pub(super) information: Matrix4<f64>,
    /// Number of matches in the last iteration.
    pub(super) matches: usize,
}

impl Fit {
    /// The fit with the translation of `start` along the directions of little information.
    pub(super) fn held_along_weak_directions(mut self, start: &Alignment) -> Self {
        let eigen = self.information.fixed_view::<3, 3>(1, 1).into_owned().symmetric_eigen();
        let moved = self.alignment.shift - start.shift;
        for (direction, information) in eigen.eigenvectors.column_iter().zip(eigen.eigenvalues.iter()) {
            if *information < WEAK_INFORMATION * eigen.eigenvalues.max() {
                self.alignment.shift -= direction * direction.dot(&moved);
            }
        }
        self
    }
}

impl NodeSurfels {
    /// Builds the index from patches by resolution.
    pub(super) fn new(levels: Vec<Vec<Patch>>, matcher: &Matcher) -> Self {
        let subsample = |patches: &Vec<Patch>| {
            patches.iter().step_by(patches.len().div_ceil(MAX_QUERIES).max(1)).copied().collect::<Vec<_>>()
        };
        let queries = levels.iter().map(subsample).collect();
        let patches: Vec<Patch> = levels.into_iter().flatten().collect();
        let trees = matcher.build_trees(&patches);
        Self { patches, trees, queries }
    }

    /// Query surfels of the finest resolution.
    pub(super) fn finest(&self) -> &[Patch] {
        self.queries.first().map_or(&[], Vec::as_slice)
    }

    /// The patch nearest to `patch`, if the two pass the match gates.
    fn counterpart(&self, patch: &Patch, matcher: &Matcher, gate_m: f64) -> Option<&Patch> {
        let nearest = *matcher.neighbours(&self.trees, patch, 1).first()?;
        Some(&self.patches[nearest as usize]).filter(|other| matcher.pass_gates(patch, other, gate_m))
    }
}

/// Registers `from` to `to` from the coarsest resolution to the finest; `None` without matches.
pub(super) fn align(from: &NodeSurfels, to: &NodeSurfels, start: &Alignment, matcher: &Matcher) -> Option<Fit> {
    let mut fit = Fit { alignment: *start, information: Matrix4::zeros(), matches: 0 };
    for level in (0..from.queries.len()).rev() {
        let gate_m = GATE_EDGES * matcher.finest_voxel_m * f64::from(1_u32 << level);
        for _ in 0..MAX_ITERATIONS {
            let step = step(&mut fit, from, to, level, gate_m, matcher)?;
            if step.norm() < CONVERGED {
                break;
            }
        }
    }
    Some(fit)
}

/// One Gauss-Newton step of `e = n^T (Rz x + shift - mu)` over yaw and shift.
fn step(
    fit: &mut Fit,
    from: &NodeSurfels,
    to: &NodeSurfels,
    level: usize,
    gate_m: f64,
    matcher: &Matcher,
) -> Option<Vector4<f64>> {
    let turn = fit.alignment.turn();
    let (mut square, mut right, mut matches) = (Matrix4::zeros(), Vector4::zeros(), 0);
    for patch in &from.queries[level] {
        let moved = fit.alignment.moved(patch, &turn);
        let Some(other) = to.counterpart(&moved, matcher, gate_m) else { continue };
        let (n, arm) = (other.normal, moved.centre - fit.alignment.shift);
        let e = n.dot(&(moved.centre - other.centre));
        let by = Vector4::new(arm.x * n.y - arm.y * n.x, n.x, n.y, n.z);
        let robust = 1.0 / (1.0 + (e / (0.3 * gate_m)).powi(2));
        square += by * by.transpose() * (robust / MATCH_SIGMA_M.powi(2));
        right -= by * (e * robust / MATCH_SIGMA_M.powi(2));
        matches += 1;
    }
    // A prior of 1 m and 1 rad keeps unobservable directions.
    let step = (square + Matrix4::identity()).cholesky()?.solve(&right);
    fit.alignment.yaw += step[0];
    fit.alignment.shift += Vector::new(step[1], step[2], step[3]);
    (fit.information, fit.matches) = (square, matches);
    (matches > 0).then_some(step)
}

/// Fraction of the surfaces of `from` that match `to` within `gate_m`: the minimum over three directions.
///
/// The directions are the vertical and the horizontal principal axes of the normals. The minimum is used because in a corridor
/// floor and walls match at any position along it. `None` if too few surfaces face one of the directions.
pub(super) fn agreement(from: &NodeSurfels, to: &NodeSurfels, alignment: &Alignment, matcher: &Matcher) -> Option<f64> {
    let queries = from.queries.get(COMPARED_LEVEL.min(from.queries.len().saturating_sub(1)))?;
    let turn = alignment.turn();
    let directions = directions(queries);
    let mut facing = [(0_usize, 0_usize); 3];
    for patch in queries {
        let Some(k) = directions.iter().position(|d| patch.normal.dot(d).abs() > FACING_COSINE) else { continue };
        let agrees = to.counterpart(&alignment.moved(patch, &turn), matcher, matcher.max_plane_distance_m()).is_some();
        facing[k] = (facing[k].0 + usize::from(agrees), facing[k].1 + 1);
    }
    let fraction = |(agreeing, all): &(usize, usize)| (*all >= MIN_FACING).then(|| *agreeing as f64 / *all as f64);
    facing.iter().map(fraction).try_fold(f64::INFINITY, |smallest, fraction| Some(smallest.min(fraction?)))
}

/// The vertical and the two horizontal principal axes of the normals.
fn directions(patches: &[Patch]) -> [Vector; 3] {
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for n in patches.iter().map(|patch| patch.normal) {
        (xx, xy, yy) = (xx + n.x * n.x, xy + n.x * n.y, yy + n.y * n.y);
    }
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    let along = Vector::new(angle.cos(), angle.sin(), 0.0);
    [Vector::z(), along, Vector::z().cross(&along)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A corridor along y with a floor.
    #[test]
    fn a_fit_keeps_its_translation_but_along_a_corridor() {
        let information = Matrix4::from_diagonal(&Vector4::new(3e5, 2e4, 100.0, 1e3));
        let alignment = Alignment { yaw: 0.01, shift: Vector::new(0.1, 1.6, 0.2) };
        let fit = Fit { alignment, information, matches: 100 };
        let start = Alignment { yaw: 0.0, shift: Vector::new(0.0, 0.5, 0.0) };
        let held = fit.held_along_weak_directions(&start).alignment;
        assert!((held.shift - Vector::new(0.1, 0.5, 0.2)).norm() < 1e-12, "{held:?}");
        assert_eq!(held.yaw, alignment.yaw);
    }
}
