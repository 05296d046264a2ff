//! Smoothed covariances of all epochs.
//!
//! A Kalman filter runs forwards and the modified Bryson-Frazier smoother backwards (Bierman, Factorization Methods for
//! Discrete Sequential Estimation, 1977, chapter X): with the predicted covariance `P` and `W = H^T S^-1 H` of an
//! epoch's measurements,
//!
//! ```text
//! L~ = W + (I - W P) L^ (I - P W)      P_smoothed = P - P L~ P      L^_before = F^T L~ F
//! ```
//!
//! No matrix that may be singular is inverted. The forward pass stores one covariance in [`CHECKPOINT_INTERVAL`]; the backward pass
//! recomputes the others.

use super::epoch::{BeamInformation, Epoch};
use super::model::{BoundModel, EPOCH, InformationBound};
use super::motion::{OutputJacobian, Step, attitude_jacobian, head_in_world, position_jacobian};
use super::state::{ATTITUDE, CLOCK, CLOCK_RATE, N, POSITION, RANGE, SUMS, State, prior};
use nalgebra::{Matrix6, SMatrix};
use zsim_base::geometry::{Matrix, Vector, skew};
use zsim_base::time::{Span, Stamp};

/// Number of epochs between stored covariances: a compromise between memory and recomputation.
const CHECKPOINT_INTERVAL: usize = 64;
/// Indices of the states that the beams measure.
const MEASURED_STATES: [usize; 9] =
    [ATTITUDE, ATTITUDE + 1, ATTITUDE + 2, POSITION, POSITION + 1, POSITION + 2, CLOCK, CLOCK_RATE, RANGE];

type Measured = SMatrix<f64, 9, 9>;

/// The epochs of a run and the centre of the trajectory.
struct Run<'a> {
    model: &'a BoundModel,
    epochs: &'a [Epoch],
    middle_in_world: Vector,
}

impl Run<'_> {
    fn since_start_s(&self, index: usize) -> f64 {
        index as f64 * EPOCH.seconds()
    }

    /// The step from epoch `index` to the next.
    fn step(&self, index: usize) -> Step {
        let (from, to) = (&self.epochs[index], &self.epochs[index + 1]);
        Step::between(self.model, from, to, &self.middle_in_world, self.since_start_s(index))
    }

    /// `W` of the measurements of an epoch, for the measured states: `(I + M P)^-1 M` with the information `M`.
    fn weight(&self, index: usize, predicted: &State) -> Measured {
        let information = with_rate(&self.epochs[index].beam_information, self.since_start_s(index));
        let known = Measured::from_fn(|i, j| predicted[(MEASURED_STATES[i], MEASURED_STATES[j])]);
        let weight = (Measured::identity() + information * known).lu().solve(&information);
        // I + M P has no eigenvalue below 1.
        let weight = weight.unwrap_or_else(Measured::zeros);
        (weight + weight.transpose()) * 0.5
    }

    /// The predicted covariance of the epoch after `index`; `weight` as from [`Self::weight`].
    fn advance(&self, index: usize, predicted: &State, weight: &Measured) -> State {
        let across = measured_columns(predicted);
        symmetric(&self.step(index).propagate(&(predicted - across * weight * across.transpose())))
    }
}

/// Converts information on the current clock offset to information on the initial offset and the rate.
fn with_rate(information: &BeamInformation, since_start_s: f64) -> Measured {
    let mut spread = SMatrix::<f64, 8, 9>::zeros();
    (0..7).for_each(|k| spread[(k, k)] = 1.0);
    spread[(6, 7)] = since_start_s;
    spread[(7, 8)] = 1.0;
    spread.transpose() * information * spread
}

/// The columns of the measured states.
fn measured_columns(matrix: &State) -> SMatrix<f64, N, 9> {
    SMatrix::from_fn(|i, j| matrix[(i, MEASURED_STATES[j])])
}

fn symmetric(matrix: &State) -> State {
    (matrix + matrix.transpose()) * 0.5
}

/// Computes the bound over `epochs`, at least one.
pub(super) fn bound(model: &BoundModel, start: Stamp, epochs: &[Epoch]) -> InformationBound {
    let heads = epochs.iter().map(|epoch| head_in_world(model, epoch));
    let run = Run { model, epochs, middle_in_world: heads.sum::<Vector>() / epochs.len() as f64 };
    let mut checkpoints = Vec::new();
    let mut predicted = prior(model);
    for index in 0..epochs.len() {
        if index % CHECKPOINT_INTERVAL == 0 {
            checkpoints.push(predicted);
        }
        if index + 1 < epochs.len() {
            predicted = run.advance(index, &predicted, &run.weight(index, &predicted));
        }
    }
    let alignment_reduction = alignment_reduction(&run, &predicted);
    let mut found = Variances::of(epochs.len());
    smooth_backwards(&run, &checkpoints, &mut found);
    let count = epochs.len() as f64;
    let mean = |variances: &[Vector]| variances.iter().sum::<Vector>() / count;
    let (position, attitude) = (mean(&found.position), mean(&found.attitude));
    let root = |variances: &Vector| variances.map(|v| v.max(0.0).sqrt());
    let roots = |mut variances: Vec<Vector>| {
        variances.iter_mut().for_each(|variance| *variance = root(variance));
        variances
    };
    InformationBound {
        stamps: (0..epochs.len()).map(|k| start + Span::from_nanos(k as i64 * EPOCH.nanos())).collect(),
        position_sigma_m: roots(found.position),
        attitude_sigma_rad: roots(found.attitude),
        position_rmse_m: position.sum().max(0.0).sqrt(),
        axis_rmse_m: root(&position),
        aligned_position_rmse_m: (position.sum() - alignment_reduction / count).max(0.0).sqrt(),
        attitude_rmse_rad: attitude.sum().max(0.0).sqrt(),
        clock_offset_s: found.clock.max(0.0).sqrt(),
        range_offset_m: found.range.max(0.0).sqrt(),
        unknown_map: None,
    }
}

/// Smoothed variances of all epochs.
struct Variances {
    position: Vec<Vector>,
    attitude: Vec<Vector>,
    /// Clock offset at the end, s^2.
    clock: f64,
    /// Range offset, m^2.
    range: f64,
}

impl Variances {
    fn of(epochs: usize) -> Self {
        let none = vec![Vector::zeros(); epochs];
        Self { position: none.clone(), attitude: none, clock: 0.0, range: 0.0 }
    }
}

/// Runs the smoother backwards over the run, section by section.
fn smooth_backwards(run: &Run<'_>, checkpoints: &[State], found: &mut Variances) {
    let mut later = State::zeros();
    for (section, first) in checkpoints.iter().enumerate().rev() {
        let from = section * CHECKPOINT_INTERVAL;
        let to = (from + CHECKPOINT_INTERVAL).min(run.epochs.len());
        let mut filtered = vec![(*first, run.weight(from, first))];
        for index in from + 1..to {
            let (before, weight) = &filtered[index - 1 - from];
            let predicted = run.advance(index - 1, before, weight);
            filtered.push((predicted, run.weight(index, &predicted)));
        }
        for index in (from..to).rev() {
            let (predicted, weight) = &filtered[index - from];
            let adjoint = updated(weight, predicted, &later);
            smooth(run, index, predicted, &adjoint, found);
            if index > 0 {
                later = symmetric(&run.step(index - 1).propagate_back(&adjoint));
            }
        }
    }
}

/// `L~` of an epoch; `later` is `L^`, from the later epochs.
fn updated(weight: &Measured, predicted: &State, later: &State) -> State {
    // The rows of I - W P that are not those of the identity. The differences are formed first: the products with `later`
    // are much larger than their sums.
    let mut rows: SMatrix<f64, 9, N> = -(weight * measured_columns(predicted).transpose());
    MEASURED_STATES.iter().enumerate().for_each(|(i, row)| rows[(i, *row)] += 1.0);
    let (mut left, by_left) = (*later, rows * later);
    MEASURED_STATES.iter().enumerate().for_each(|(i, row)| left.set_row(*row, &by_left.row(i)));
    let (mut both, by_right) = (left, left * rows.transpose());
    MEASURED_STATES.iter().enumerate().for_each(|(j, column)| both.set_column(*column, &by_right.column(j)));
    for (i, row) in MEASURED_STATES.iter().enumerate() {
        for (j, column) in MEASURED_STATES.iter().enumerate() {
            both[(*row, *column)] += weight[(i, j)];
        }
    }
    symmetric(&both)
}

/// Computes the smoothed variances of the epoch at `index`; `adjoint` is from the later epochs.
fn smooth(run: &Run<'_>, index: usize, predicted: &State, adjoint: &State, found: &mut Variances) {
    let (epoch, since_start_s) = (&run.epochs[index], run.since_start_s(index));
    // C (P - P L~ P) C^T, for the reported errors only.
    let variances = |jacobian: &OutputJacobian| -> Vector {
        let across = jacobian * predicted;
        let covariance: Matrix = across * jacobian.transpose() - across * adjoint * across.transpose();
        covariance.diagonal()
    };
    found.position[index] = variances(&position_jacobian(run.model, epoch, since_start_s));
    found.attitude[index] = variances(&attitude_jacobian(epoch, since_start_s));
    if index + 1 == run.epochs.len() {
        let mut constants = OutputJacobian::zeros();
        (constants[(0, CLOCK)], constants[(0, CLOCK_RATE)], constants[(1, RANGE)]) = (1.0, since_start_s, 1.0);
        let constants = variances(&constants);
        (found.clock, found.range) = (constants.x, constants.y);
    }
}

/// Reduction of the sum of squared position errors by a rigid alignment over all epochs.
///
/// It is `tr((A^T A)^-1 A^T S A)`, where `A` maps a small rigid motion to the positions and `A^T S A` is the covariance
/// of the sums in the state.
fn alignment_reduction(run: &Run<'_>, last: &State) -> f64 {
    let at_end = run.epochs.len() - 1;
    let across = measured_columns(last);
    let updated = last - across * run.weight(at_end, last) * across.transpose();
    let epoch = &run.epochs[at_end];
    // Add the error of the last epoch to the sums.
    let jacobian = position_jacobian(run.model, epoch, run.since_start_s(at_end));
    let lever = |epoch: &Epoch| skew(&(head_in_world(run.model, epoch) - run.middle_in_world));
    let mut sums = SMatrix::<f64, 6, N>::zeros();
    (0..6).for_each(|k| sums[(k, SUMS + k)] = 1.0);
    let mut force = sums.fixed_view_mut::<3, N>(0, 0);
    force += jacobian;
    let mut moment = sums.fixed_view_mut::<3, N>(3, 0);
    moment += lever(epoch) * jacobian;
    let spread: Matrix6<f64> = sums * updated * sums.transpose();
    let mut normal = Matrix6::zeros();
    for epoch in run.epochs {
        let lever = lever(epoch);
        let mut rigid = SMatrix::<f64, 3, 6>::zeros();
        rigid.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
        rigid.fixed_view_mut::<3, 3>(0, 3).copy_from(&-lever);
        normal += rigid.transpose() * rigid;
    }
    // If all positions are on a line, a rotation about it is not observable.
    let tolerance = 1e-12 * normal.trace();
    normal.pseudo_inverse(tolerance).map_or(0.0, |inverse| (inverse * spread).trace())
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::{Pose, Rotation, STANDARD_GRAVITY_M_PER_S2};
    use zsim_base::measurement::ImuSample;

    /// Two epochs in motion, with an IMU sample each.
    fn epochs() -> [Epoch; 2] {
        [0.0, EPOCH.seconds()].map(|t_s| {
            let at = |t_s: f64| {
                let turn = Rotation::from_scaled_axis(Vector::new(0.4, -0.7, 1.1) * (1.0 + t_s));
                Pose::from_parts(Vector::new(1.0, 0.6 * t_s, -0.3 * t_s).into(), turn)
            };
            let mut epoch = Epoch::new(&at(t_s), &at(t_s - 1e-3), 1e-3);
            epoch.add_imu_sample(&ImuSample {
                stamp: Stamp::default(),
                angular_velocity_rad_per_s: Vector::new(0.4, -0.7, 1.1),
                specific_force_m_per_s2: Vector::new(0.3, -0.2, STANDARD_GRAVITY_M_PER_S2),
            });
            epoch
        })
    }

    /// A covariance or information with unequal entries.
    fn positive(seed: f64) -> State {
        let root = State::from_fn(|i, j| ((i * 17 + j * 5) as f64 * 0.37 + seed).sin());
        root * root.transpose()
    }

    #[test]
    fn the_products_of_the_non_zero_blocks_are_those_of_the_whole_matrices() {
        let epochs = epochs();
        let step = Step::between(&BoundModel::for_tests(), &epochs[0], &epochs[1], &Vector::new(0.1, 0.2, 0.3), 7.0);
        let (f, p, l) = (step.transition, positive(0.1), positive(0.7));
        assert_relative_eq!(step.propagate(&p), f * p * f.transpose() + step.noise, max_relative = 1e-10);
        assert_relative_eq!(step.propagate_back(&l), f.transpose() * l * f, epsilon = 1e-10, max_relative = 1e-10);
        let weight = Measured::from_fn(|i, j| l[(i, j)] / p.trace());
        let mut whole = State::zeros();
        for (i, row) in MEASURED_STATES.iter().enumerate() {
            MEASURED_STATES.iter().enumerate().for_each(|(j, column)| whole[(*row, *column)] = weight[(i, j)]);
        }
        let left = State::identity() - whole * p;
        let expected = whole + left * l * left.transpose();
        assert_relative_eq!(updated(&weight, &p, &l), expected, epsilon = 1e-10, max_relative = 1e-10);
    }
}
