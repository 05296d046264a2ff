//! The covariance of every epoch given all of the run.
//!
//! A Kalman filter forwards, and the modified Bryson-Frazier smoother backwards (Bierman, Factorization Methods for
//! Discrete Sequential Estimation, 1977, chapter X): with the predicted covariance `P` and `W = H^T S^-1 H` of an
//! epoch's measurements,
//!
//! ```text
//! L~ = W + (I - W P) L^ (I - P W)      P_smoothed = P - P L~ P      L^_before = F^T L~ F
//! ```
//!
//! No matrix that may be singular is inverted. The forward pass stores one covariance in [`STRETCH`]; the backward pass
//! recomputes the others.

use super::epoch::{Epoch, Seen};
use super::motion::{Step, Told, attitude_told, head_in_world, position_told};
use super::state::{ATTITUDE, CLOCK, CLOCK_RATE, N, POSITION, RANGE, SUMS, State, prior};
use super::{BoundModel, EPOCH, InformationBound};
use crate::geometry::{Matrix, Vector, skew};
use crate::time::{Span, Stamp};
use nalgebra::{Matrix6, SMatrix};

/// Epochs between two stored covariances.
const STRETCH: usize = 64;
/// Errors that measurements constrain, by index in the state.
const TOLD_OF: [usize; 9] =
    [ATTITUDE, ATTITUDE + 1, ATTITUDE + 2, POSITION, POSITION + 1, POSITION + 2, CLOCK, CLOCK_RATE, RANGE];

type Measured = SMatrix<f64, 9, 9>;

/// The run, ready to be walked along.
struct Run<'a> {
    model: &'a BoundModel,
    epochs: &'a [Epoch],
    middle_in_world: Vector,
}

impl Run<'_> {
    fn since_start_s(&self, index: usize) -> f64 {
        index as f64 * EPOCH.seconds()
    }

    /// From epoch `index` to the one after it.
    fn step(&self, index: usize) -> Step {
        let ends = (&self.epochs[index], &self.epochs[index + 1]);
        Step::between(self.model, ends, &self.middle_in_world, self.since_start_s(index))
    }

    /// `W` of an epoch's measurements, on the errors that they constrain: `(I + M P)^-1 M` with the information `M`.
    fn weight(&self, index: usize, predicted: &State) -> Measured {
        let information = with_rate(&self.epochs[index].seen(), self.since_start_s(index));
        let known = Measured::from_fn(|i, j| predicted[(TOLD_OF[i], TOLD_OF[j])]);
        let weight = (Measured::identity() + information * known).lu().solve(&information);
        // I + M P has no eigenvalue below 1.
        let weight = weight.unwrap_or_else(Measured::zeros);
        (weight + weight.transpose()) * 0.5
    }

    /// The predicted covariance of the epoch after `index`.
    fn advance(&self, index: usize, predicted: &State) -> State {
        let across = columns(predicted);
        let updated = predicted - across * self.weight(index, predicted) * across.transpose();
        let Step { transition, noise } = self.step(index);
        symmetric(&(transition * updated * transition.transpose() + noise))
    }
}

/// Information on the current clock offset as information on the initial offset and the rate.
fn with_rate(seen: &Seen, since_start_s: f64) -> Measured {
    let mut spread = SMatrix::<f64, 8, 9>::zeros();
    (0..7).for_each(|k| spread[(k, k)] = 1.0);
    spread[(6, 7)] = since_start_s;
    spread[(7, 8)] = 1.0;
    spread.transpose() * seen * spread
}

fn columns(matrix: &State) -> SMatrix<f64, N, 9> {
    SMatrix::from_fn(|i, j| matrix[(i, TOLD_OF[j])])
}

fn symmetric(matrix: &State) -> State {
    (matrix + matrix.transpose()) * 0.5
}

/// The bound over `epochs`, of which there is at least one.
pub(super) fn bound(model: &BoundModel, start: Stamp, epochs: &[Epoch]) -> InformationBound {
    let heads = epochs.iter().map(|epoch| head_in_world(model, epoch));
    let run = Run { model, epochs, middle_in_world: heads.sum::<Vector>() / epochs.len() as f64 };
    let mut kept = Vec::new();
    let mut predicted = prior(model);
    for index in 0..epochs.len() {
        if index % STRETCH == 0 {
            kept.push(predicted);
        }
        if index + 1 < epochs.len() {
            predicted = run.advance(index, &predicted);
        }
    }
    let aligned_away = taken_by_alignment(&run, &predicted);
    let mut found = Variances::of(epochs.len());
    back(&run, &kept, &mut found);
    let count = epochs.len() as f64;
    let mean = |variances: &[Vector]| variances.iter().sum::<Vector>() / count;
    let (position, attitude) = (mean(&found.position), mean(&found.attitude));
    let root = |variances: &Vector| variances.map(|v| v.max(0.0).sqrt());
    let roots = |mut variances: Vec<Vector>| {
        variances.iter_mut().for_each(|of| *of = root(of));
        variances
    };
    InformationBound {
        stamps: (0..epochs.len()).map(|k| start + Span::from_nanos(k as i64 * EPOCH.nanos())).collect(),
        position_sigma_m: roots(found.position),
        attitude_sigma_rad: roots(found.attitude),
        position_rmse_m: position.sum().max(0.0).sqrt(),
        axis_rmse_m: root(&position),
        aligned_position_rmse_m: (position.sum() - aligned_away / count).max(0.0).sqrt(),
        attitude_rmse_rad: attitude.sum().max(0.0).sqrt(),
        clock_offset_s: found.clock.max(0.0).sqrt(),
        range_offset_m: found.range.max(0.0).sqrt(),
    }
}

/// Variances of all epochs, given all of the run.
struct Variances {
    position: Vec<Vector>,
    attitude: Vec<Vector>,
    /// Of the clock offset at the end, s^2.
    clock: f64,
    /// Of the offset of the ranges, m^2.
    range: f64,
}

impl Variances {
    fn of(epochs: usize) -> Self {
        let none = vec![Vector::zeros(); epochs];
        Self { position: none.clone(), attitude: none, clock: 0.0, range: 0.0 }
    }
}

/// Walks back over the run.
fn back(run: &Run<'_>, kept: &[State], found: &mut Variances) {
    let mut behind = State::zeros();
    for (stretch, first) in kept.iter().enumerate().rev() {
        let from = stretch * STRETCH;
        let to = (from + STRETCH).min(run.epochs.len());
        let mut predicted = vec![*first];
        for index in from..to - 1 {
            predicted.push(run.advance(index, &predicted[index - from]));
        }
        for index in (from..to).rev() {
            let at = &predicted[index - from];
            let adjoint = updated(&run.weight(index, at), at, &behind);
            smooth(run, (index, at, &adjoint), found);
            if index > 0 {
                let transition = run.step(index - 1).transition;
                behind = symmetric(&(transition.transpose() * adjoint * transition));
            }
        }
    }
}

/// `L~` of an epoch, from the later epochs.
fn updated(weight: &Measured, predicted: &State, behind: &State) -> State {
    let mut whole = State::zeros();
    for (i, row) in TOLD_OF.iter().enumerate() {
        for (j, column) in TOLD_OF.iter().enumerate() {
            whole[(*row, *column)] = weight[(i, j)];
        }
    }
    let left = State::identity() - whole * predicted;
    symmetric(&(whole + left * behind * left.transpose()))
}

/// Computes the smoothed variances of the epoch at `index`; `adjoint` is from the later epochs.
fn smooth(run: &Run<'_>, (index, predicted, adjoint): (usize, &State, &State), found: &mut Variances) {
    let (epoch, since_start_s) = (&run.epochs[index], run.since_start_s(index));
    // C (P - P L~ P) C^T, for the reported errors only.
    let variances = |told: &Told| -> Vector {
        let across = told * predicted;
        let covariance: Matrix = across * told.transpose() - across * adjoint * across.transpose();
        covariance.diagonal()
    };
    found.position[index] = variances(&position_told(run.model, epoch, since_start_s));
    found.attitude[index] = variances(&attitude_told(epoch, since_start_s));
    if index + 1 == run.epochs.len() {
        let mut constants = Told::zeros();
        (constants[(0, CLOCK)], constants[(0, CLOCK_RATE)], constants[(1, RANGE)]) = (1.0, since_start_s, 1.0);
        let constants = variances(&constants);
        (found.clock, found.range) = (constants.x, constants.y);
    }
}

/// The reduction of the sum of squared position errors by a rigid alignment over all epochs: with `A` the motion of all
/// positions by a small rigid one, `tr((A^T A)^-1 A^T S A)`, where `A^T S A` is the covariance of the sums that the
/// state includes.
fn taken_by_alignment(run: &Run<'_>, last: &State) -> f64 {
    let at_end = run.epochs.len() - 1;
    let across = columns(last);
    let updated = last - across * run.weight(at_end, last) * across.transpose();
    let epoch = &run.epochs[at_end];
    // The last epoch's own error joins the sums.
    let told = position_told(run.model, epoch, run.since_start_s(at_end));
    let lever = |epoch: &Epoch| skew(&(head_in_world(run.model, epoch) - run.middle_in_world));
    let mut sums = SMatrix::<f64, 6, N>::zeros();
    (0..6).for_each(|k| sums[(k, SUMS + k)] = 1.0);
    let mut force = sums.fixed_view_mut::<3, N>(0, 0);
    force += told;
    let mut moment = sums.fixed_view_mut::<3, N>(3, 0);
    moment += lever(epoch) * told;
    let spread: Matrix6<f64> = sums * updated * sums.transpose();
    let mut normal = Matrix6::zeros();
    for epoch in run.epochs {
        let lever = lever(epoch);
        let mut rigid = SMatrix::<f64, 3, 6>::zeros();
        rigid.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
        rigid.fixed_view_mut::<3, 3>(0, 3).copy_from(&-lever);
        normal += rigid.transpose() * rigid;
    }
    // Where all positions lie on a line or in a point, a turn about it moves none.
    let least = 1e-12 * normal.trace();
    normal.pseudo_inverse(least).map_or(0.0, |inverse| (inverse * spread).trace())
}
