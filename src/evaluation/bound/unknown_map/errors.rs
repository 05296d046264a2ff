//! The errors at the kept epochs, from the information on them.

use super::super::model::{EPOCH, InformationBound, UnknownMap};
use super::super::motion::{attitude_jacobian, head_in_world, position_jacobian};
use super::chain::{CONSTANTS, OWN, columns};
use super::dense::Information;
use super::problem::Problem;
use nalgebra::{DMatrix, Matrix6, SMatrix, Vector6};
use zsim_base::geometry::{Vector, skew};
use zsim_base::time::{Span, Stamp};

/// Columns of each kept epoch: position, attitude.
const OUTPUTS: usize = 6;

/// The bound at the kept epochs, after the rigid alignment of the positions. `None` if the information is singular.
pub(super) fn bound(problem: &Problem<'_>, start: Stamp, information: Information) -> Option<InformationBound> {
    let kept = &problem.kept;
    let mut white = information.whitened(&outputs(problem, kept))?;
    let alignment = Alignment::of(problem, kept);
    (0..white.nrows()).for_each(|row| alignment.apply(row, &mut white));
    let variance = |column: usize| (0..white.nrows()).map(|row| white[(row, column)].powi(2)).sum::<f64>();
    let variances = |index: usize, from: usize| Vector::from_fn(|axis, _| variance(OUTPUTS * index + from + axis));
    let position: Vec<Vector> = (0..kept.len()).map(|index| variances(index, 0)).collect();
    let attitude: Vec<Vector> = (0..kept.len()).map(|index| variances(index, 3)).collect();
    let root = |variances: &Vector| variances.map(f64::sqrt);
    let mean = |variances: &[Vector]| variances.iter().zip(&alignment.weights).map(|(v, weight)| v * *weight).sum();
    let (mean_position, mean_attitude): (Vector, Vector) = (mean(&position), mean(&attitude));
    let stamp = |epoch: &usize| start + Span::from_nanos(*epoch as i64 * EPOCH.nanos());
    Some(InformationBound {
        stamps: kept.iter().map(stamp).collect(),
        position_sigma_m: position.iter().map(root).collect(),
        attitude_sigma_rad: attitude.iter().map(root).collect(),
        position_rmse_m: mean_position.sum().sqrt(),
        axis_rmse_m: root(&mean_position),
        aligned_position_rmse_m: mean_position.sum().sqrt(),
        attitude_rmse_rad: mean_attitude.sum().sqrt(),
        clock_offset_s: variance(OUTPUTS * kept.len()).sqrt(),
        range_offset_m: variance(OUTPUTS * kept.len() + 1).sqrt(),
        unknown_map: Some(UnknownMap {
            planes: problem.joint.planes,
            joint_beam_fraction: problem.joint.beam_fraction,
        }),
    })
}

/// The reported errors as combinations of the states: position and attitude of each kept epoch, then clock offset at the
/// end, and range offset.
fn outputs(problem: &Problem<'_>, kept: &[usize]) -> DMatrix<f64> {
    let mut across = DMatrix::zeros(CONSTANTS + OWN * kept.len(), OUTPUTS * kept.len() + 2);
    for (index, epoch) in kept.iter().enumerate() {
        let (at, since_start_s) = (&problem.epochs[*epoch], problem.since_start_s(*epoch));
        let position = position_jacobian(&problem.model, at, since_start_s);
        for (from, jacobian) in [(0, position), (3, attitude_jacobian(at, since_start_s))] {
            let (own, constants) = columns(&jacobian);
            for axis in 0..3 {
                let column = OUTPUTS * index + from + axis;
                (0..CONSTANTS).for_each(|k| across[(k, column)] = constants[(axis, k)]);
                (0..OWN).for_each(|k| across[(CONSTANTS + OWN * index + k, column)] = own[(axis, k)]);
            }
        }
    }
    // The constants begin with clock offset, clock rate and range offset.
    let (last, seconds) = (OUTPUTS * kept.len(), problem.since_start_s(kept[kept.len() - 1]));
    (across[(0, last)], across[(1, last)], across[(2, last + 1)]) = (1.0, seconds, 1.0);
    across
}

/// The least-squares fit of a small rigid motion to the position errors of the kept epochs.
struct Alignment {
    /// Fraction of the run that each kept epoch represents.
    weights: Vec<f64>,
    /// Displacement of each head by a rigid motion: shift, rotation.
    rigid: Vec<SMatrix<f64, 3, 6>>,
    /// Inverse of the normal matrix of the fit.
    inverse: Matrix6<f64>,
}

impl Alignment {
    fn of(problem: &Problem<'_>, kept: &[usize]) -> Self {
        let weights = weights(kept);
        let head = |epoch: &usize| head_in_world(&problem.model, &problem.epochs[*epoch]);
        let heads: Vec<Vector> = kept.iter().map(head).collect();
        let middle: Vector = heads.iter().zip(&weights).map(|(head, weight)| head * *weight).sum();
        let rigid: Vec<_> = heads.iter().map(|head| rigid(&(head - middle))).collect();
        let normal: Matrix6<f64> =
            rigid.iter().zip(&weights).map(|(rigid, weight)| rigid.transpose() * rigid * *weight).sum();
        // If all positions are on a line, a rotation about it is not observable.
        let inverse = normal.pseudo_inverse(1e-12 * normal.trace()).unwrap_or_else(|_| Matrix6::zeros());
        Self { weights, rigid, inverse }
    }

    /// Subtracts the rigid motion from the errors in a row.
    fn apply(&self, row: usize, errors: &mut DMatrix<f64>) {
        let mut moment = Vector6::zeros();
        for (index, (rigid, weight)) in self.rigid.iter().zip(&self.weights).enumerate() {
            let position = Vector::from_fn(|axis, _| errors[(row, OUTPUTS * index + axis)]);
            moment += rigid.transpose() * position * *weight;
        }
        let motion = self.inverse * moment;
        for (index, rigid) in self.rigid.iter().enumerate() {
            let moved = rigid * motion;
            for axis in 0..3 {
                errors[(row, OUTPUTS * index + axis)] -= moved[axis];
                errors[(row, OUTPUTS * index + 3 + axis)] -= motion[3 + axis];
            }
        }
    }
}

/// Fractions of the run by the trapezoidal rule over epochs, at least two.
fn weights(kept: &[usize]) -> Vec<f64> {
    let span = 2.0 * (kept[kept.len() - 1] - kept[0]) as f64;
    let after = |k: usize| kept[(k + 1).min(kept.len() - 1)];
    (0..kept.len()).map(|k| (after(k) - kept[k.saturating_sub(1)]) as f64 / span).collect()
}

/// Displacement of a point at `lever` from the centre by a small shift and rotation.
fn rigid(lever: &Vector) -> SMatrix<f64, 3, 6> {
    let mut rigid = SMatrix::<f64, 3, 6>::zeros();
    rigid.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
    rigid.fixed_view_mut::<3, 3>(0, 3).copy_from(&-skew(lever));
    rigid
}
