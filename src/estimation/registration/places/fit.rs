//! Two places laid upon each other, plane on plane, and whether they are one.

use crate::estimation::matching::{Forest, Matcher};
use crate::estimation::surfel::Patch;
use crate::geometry::{Matrix, Rotation, Vector};
use nalgebra::{Matrix4, Vector4};

/// Resolutions that places are aligned by; those are compared that say whether they agree.
pub(super) const ALIGNED_LEVELS: usize = 3;
const COMPARED_LEVEL: usize = 1;
/// Most surfels of a resolution that look for their counterparts.
const ASKING: usize = 400;
/// Steps of the alignment a resolution; it is settled when one is smaller, m and rad.
const STEPS: usize = 5;
const SETTLED: f64 = 1e-3;
/// Counterparts are no farther apart along their normals, in edges of their resolution.
const GATE_EDGES: f64 = 0.25;
/// A surface faces a direction when its normal leans to it by more than this cosine.
const FACING: f64 = 0.7;
/// Fewest surfaces that must face a direction for it to be judged.
const FEWEST_FACING: usize = 8;
/// What a match of two places may err, m: the open loop may have smeared either.
const MATCH_SIGMA_M: f64 = 0.1;

/// How one place lies beside another. What the first sees at `x` about its head, the second sees at `Rz(yaw) x + shift`
/// about its own; both along the map's axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::estimation::registration) struct Alignment {
    /// rad.
    pub(in crate::estimation::registration) yaw: f64,
    /// m.
    pub(in crate::estimation::registration) shift: Vector,
}

impl Alignment {
    fn turn(&self) -> Matrix {
        Rotation::from_scaled_axis(Vector::z() * self.yaw).to_rotation_matrix().into_inner()
    }

    fn moved(&self, patch: &Patch, turn: &Matrix) -> Patch {
        Patch { centre: turn * patch.centre + self.shift, normal: turn * patch.normal, ..*patch }
    }

    /// How far apart two alignments are, m and rad.
    pub(super) fn apart(&self, other: &Self) -> (f64, f64) {
        let turns = (self.yaw - other.yaw) / std::f64::consts::TAU;
        ((self.shift - other.shift).norm(), ((turns - turns.round()) * std::f64::consts::TAU).abs())
    }
}

/// A place ready to be laid upon others.
pub(super) struct Seen {
    /// All surfels of the resolutions that are aligned, and a tree of them.
    patches: Vec<Patch>,
    forest: Forest,
    /// Some of each resolution.
    asking: Vec<Vec<Patch>>,
}

/// An alignment with what speaks for it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fit {
    pub(super) alignment: Alignment,
    /// What the matches know of `[yaw, shift]`.
    pub(super) information: Matrix4<f64>,
    /// Matches of the last step.
    pub(super) matches: usize,
}

impl Seen {
    /// Of a place's patches, resolution by resolution.
    pub(super) fn new(levels: Vec<Vec<Patch>>, matcher: &Matcher) -> Self {
        let thinned = |patches: &Vec<Patch>| {
            patches.iter().step_by(patches.len().div_ceil(ASKING).max(1)).copied().collect::<Vec<_>>()
        };
        let asking = levels.iter().map(thinned).collect();
        let patches: Vec<Patch> = levels.into_iter().flatten().collect();
        let forest = matcher.plant(&patches);
        Self { patches, forest, asking }
    }

    /// Its finest patches.
    pub(super) fn finest(&self) -> &[Patch] {
        self.asking.first().map_or(&[], Vec::as_slice)
    }

    /// The nearest patch to `patch`, where the two can be one surface.
    fn counterpart(&self, patch: &Patch, matcher: &Matcher, gate_m: f64) -> Option<&Patch> {
        let nearest = *matcher.neighbours(&self.forest, patch, 1).first()?;
        Some(&self.patches[nearest as usize]).filter(|other| matcher.agree(patch, other, gate_m))
    }
}

/// Lays `from` upon `to`, from the coarsest resolution to the finest; `None` where too little matches.
pub(super) fn lay(from: &Seen, to: &Seen, start: &Alignment, matcher: &Matcher) -> Option<Fit> {
    let mut fit = Fit { alignment: *start, information: Matrix4::zeros(), matches: 0 };
    for level in (0..from.asking.len()).rev() {
        let gate_m = GATE_EDGES * matcher.finest_voxel_m * f64::from(1_u32 << level);
        for _ in 0..STEPS {
            let step = step(&mut fit, (from, to), level, gate_m, matcher)?;
            if step.norm() < SETTLED {
                break;
            }
        }
    }
    Some(fit)
}

/// One step towards the planes of the counterparts: `e = n^T (Rz x + shift - mu)`, by yaw and shift.
fn step(
    fit: &mut Fit,
    (from, to): (&Seen, &Seen),
    level: usize,
    gate_m: f64,
    matcher: &Matcher,
) -> Option<Vector4<f64>> {
    let turn = fit.alignment.turn();
    let (mut square, mut right, mut matches) = (Matrix4::zeros(), Vector4::zeros(), 0);
    for patch in &from.asking[level] {
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
    // Where nothing holds a direction it stays, as if known to a metre and a radian.
    let step = (square + Matrix4::identity()).cholesky()?.solve(&right);
    fit.alignment.yaw += step[0];
    fit.alignment.shift += Vector::new(step[1], step[2], step[3]);
    (fit.information, fit.matches) = (square, matches);
    (matches > 0).then_some(step)
}

/// The share of `from`'s surfaces that lie on some of `to`'s, within `gate_m`: the least of those that face the
/// vertical, and each of two horizontal directions at right angles, which are those that most and least of them face.
/// In a corridor floor and walls agree wherever along it one is. `None` where too few face a direction to say.
pub(super) fn agreement(
    from: &Seen,
    to: &Seen,
    alignment: &Alignment,
    (matcher, gate_m): (&Matcher, f64),
) -> Option<f64> {
    let asking = from.asking.get(COMPARED_LEVEL.min(from.asking.len().saturating_sub(1)))?;
    let turn = alignment.turn();
    let directions = directions(asking);
    let mut facing = [(0_usize, 0_usize); 3];
    for patch in asking {
        let Some(k) = directions.iter().position(|d| patch.normal.dot(d).abs() > FACING) else { continue };
        let agrees = to.counterpart(&alignment.moved(patch, &turn), matcher, gate_m).is_some();
        facing[k] = (facing[k].0 + usize::from(agrees), facing[k].1 + 1);
    }
    let share = |(agreeing, all): &(usize, usize)| (*all >= FEWEST_FACING).then(|| *agreeing as f64 / *all as f64);
    facing.iter().map(share).try_fold(f64::INFINITY, |least, share| Some(least.min(share?)))
}

/// The vertical, and two horizontal directions.
fn directions(patches: &[Patch]) -> [Vector; 3] {
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for n in patches.iter().map(|patch| patch.normal) {
        (xx, xy, yy) = (xx + n.x * n.x, xy + n.x * n.y, yy + n.y * n.y);
    }
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    let along = Vector::new(angle.cos(), angle.sin(), 0.0);
    [Vector::z(), along, Vector::z().cross(&along)]
}
