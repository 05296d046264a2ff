//! The part of a change of the motion that is too fast for the correction spline.
//!
//! A step of the biases `b` and of the scale errors and misalignments `M` changes what the readings `w` and `f` integrate to, in
//! the map's axes by `delta_w' = -R (db + dM w)` in attitude and `delta_f' = -R (db + dM f)` in velocity. The correction spline
//! follows these changes up to about half its knot rate. On a head that swings, the rest is as large as the noise of the IMU
//! from misalignments of some 0.5 degrees on: without it the trajectory would contradict the corrected readings, and the
//! contradiction would hold `b` and `M` back. So the states take the rest with each step, and the inertial residuals depend on
//! `b` and `M` only by the part that the spline follows.

use super::nodes::Nodes;
use crate::layout::{ACCEL_BIAS, ACCEL_MATRIX, GYRO_BIAS, GYRO_MATRIX, Layout};
use crate::nominal::Correction;
use crate::normal_equations::{Factor, NormalEquations};
use crate::spline::Basis;
use crate::strapdown::Interval;
use zsim_base::geometry::{Matrix, Rotation, Vector};

/// Weight of the first node in the fit: the trajectory before it does not change.
const WEIGHT_OF_FIRST: f64 = 1e6;
/// Weight of a zero at each knot, which keeps knots without nodes, and the position of a velocity, determined.
const WEIGHT_OF_ZERO: f64 = 1e-6;

/// Derivatives of a vector by the bias, and by the three columns of `M`.
pub(super) type ByErrors = [Matrix; 4];

const ZERO: ByErrors = [Matrix::new(0., 0., 0., 0., 0., 0., 0., 0., 0.); 4];

/// The changes of the motion at the nodes by the errors of the IMU, in the map frame.
#[derive(Debug, Default)]
pub(crate) struct FastMotion {
    /// Of the attitude, by the errors of the gyroscope.
    turn: SplitChange,
    /// Of the velocity, by the errors of the accelerometer.
    velocity: SplitChange,
    /// Of the position: the integral of the fast part of the velocity.
    position: Vec<ByErrors>,
}

/// A change at each node, split into the part that a spline can follow, and the rest.
#[derive(Debug, Default)]
struct SplitChange {
    slow: Vec<ByErrors>,
    fast: Vec<ByErrors>,
}

impl FastMotion {
    /// Returns the changes at `nodes`, split by least-squares splines with the knots of `layout`.
    pub(crate) fn of(nodes: &Nodes<'_>, layout: &Layout) -> Self {
        let ends = || nodes.intervals.iter().zip(nodes.states.windows(2));
        let turn = ends().map(|(interval, states)| (states[1].rotation, interval.gyro, interval.h));
        let velocity = ends().map(|(interval, states)| (middle(states), interval.accel, interval.h));
        let turn = SplitChange::of(&integrate(turn), nodes.bases, |basis| basis.value, layout);
        let velocity = SplitChange::of(&integrate(velocity), nodes.bases, |basis| basis.rate, layout);
        let position = velocity.integral_of_fast(nodes.intervals);
        Self { turn, velocity, position }
    }

    /// Returns the derivatives of the rotation residual over the interval after a node by the gyroscope's errors, rad.
    pub(super) fn turn_residual(&self, node: usize) -> ByErrors {
        self.turn.residual(node)
    }

    /// Returns the derivatives of the velocity residual over the interval after a node by the accelerometer's errors, m/s.
    pub(super) fn velocity_residual(&self, node: usize) -> ByErrors {
        self.velocity.residual(node)
    }

    /// Returns the fast correction of the state at a node for a `step` of the border.
    pub(crate) fn at(&self, node: usize, step: &[f64]) -> Correction {
        let three = |at: usize| Vector::new(step[at], step[at + 1], step[at + 2]);
        let of = |by: &[ByErrors], bias: usize, matrix: usize| {
            let Some(by) = by.get(node) else { return Vector::zeros() };
            let column = |j: usize| Vector::new(step[matrix + j], step[matrix + 3 + j], step[matrix + 6 + j]);
            by[0] * three(bias) + (0..3).map(|j| by[1 + j] * column(j)).sum::<Vector>()
        };
        Correction {
            rotation: of(&self.turn.fast, GYRO_BIAS, GYRO_MATRIX),
            translation: of(&self.position, ACCEL_BIAS, ACCEL_MATRIX),
            velocity: of(&self.velocity.fast, ACCEL_BIAS, ACCEL_MATRIX),
        }
    }
}

impl SplitChange {
    /// Splits the changes at the nodes by a least-squares spline, whose basis functions at a node are `values`.
    fn of(changes: &[ByErrors], bases: &[Basis], values: fn(&Basis) -> [f64; 4], layout: &Layout) -> Self {
        let at = |basis: &Basis| (basis.first - layout.first_knot) as usize;
        let rows: Vec<(usize, [f64; 4])> = bases.iter().map(|basis| (at(basis), values(basis))).collect();
        let fit = fit(&rows, changes, layout.knots);
        let slow = rows.iter().map(|(at, values)| {
            let mut sum = ZERO;
            for (knot, value) in fit[*at..].iter().zip(values) {
                sum.iter_mut().zip(knot).for_each(|(sum, by)| *sum += by * *value);
            }
            sum
        });
        let slow: Vec<ByErrors> = slow.collect();
        let fast = changes.iter().zip(&slow).map(|(all, slow)| std::array::from_fn(|k| all[k] - slow[k])).collect();
        Self { slow, fast }
    }

    fn residual(&self, node: usize) -> ByErrors {
        let (start, end) = (&self.slow[node], &self.slow[node + 1]);
        std::array::from_fn(|k| start[k] - end[k])
    }

    fn integral_of_fast(&self, intervals: &[Interval]) -> Vec<ByErrors> {
        let mut sum = ZERO;
        let mut integral = vec![sum];
        for (ends, interval) in self.fast.windows(2).zip(intervals) {
            (0..4).for_each(|k| sum[k] += (ends[0][k] + ends[1][k]) * (0.5 * interval.h));
            integral.push(sum);
        }
        integral
    }
}

/// Returns the attitude half-way between two states.
fn middle(states: &[crate::strapdown::State]) -> Rotation {
    states[0].rotation.nlerp(&states[1].rotation, 0.5)
}

/// Integrates the changes by errors of readings, each with its attitude and duration, s, from the first node on.
fn integrate(readings: impl Iterator<Item = (Rotation, Vector, f64)>) -> Vec<ByErrors> {
    let mut sum = ZERO;
    let mut changes = vec![sum];
    for (rotation, reading, h) in readings {
        let map_from_imu = rotation.to_rotation_matrix().into_inner();
        let factors = [1.0, reading.x, reading.y, reading.z];
        sum.iter_mut().zip(factors).for_each(|(sum, factor)| *sum -= map_from_imu * (factor * h));
        changes.push(sum);
    }
    changes
}

/// Returns the coefficients of the least-squares spline through `changes`, given the first knot and the basis of each node.
fn fit(rows: &[(usize, [f64; 4])], changes: &[ByErrors], knots: usize) -> Vec<ByErrors> {
    let mut equations = NormalEquations::new(knots);
    let mut right = vec![ZERO; knots];
    (0..knots).for_each(|knot| equations.add_entry(knot, knot, WEIGHT_OF_ZERO));
    for (k, ((at, values), change)) in rows.iter().zip(changes).enumerate() {
        let weight = if k == 0 { WEIGHT_OF_FIRST } else { 1.0 };
        for (a, by) in values.map(|value| weight * value).into_iter().enumerate() {
            (0..=a).for_each(|b| equations.add_entry(at + a, at + b, by * values[b]));
            right[at + a].iter_mut().zip(change).for_each(|(right, change)| *right += change * by);
        }
    }
    let mut factor = Factor::default();
    if equations.factor(&mut factor).is_err() {
        return vec![ZERO; knots];
    }
    for (k, entry) in (0..4).flat_map(|k| (0..9).map(move |entry| (k, entry))) {
        let column: Vec<f64> = right.iter().map(|by| by[k][entry]).collect();
        right.iter_mut().zip(factor.solve(&column)).for_each(|(by, x)| by[k][entry] = x);
    }
    right
}
