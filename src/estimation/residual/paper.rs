//! IMU residuals of the paper's formulation, for a trajectory in lidar time `tau`.
//!
//! With the clock offset `l`, node spacings `h`, and the IMU signals `w_m` and `f_m` as functions of IMU time:
//!
//! ```text
//! e_w = log(r(tau)^-1 r(tau + h)) / h - (w_m(tau + h/2 + l) - b_w)
//! e_a = R^T (d2 t / dtau^2 - g) - (f_m(tau + l) - b_a)
//! ```
//!
//! `d2 t / dtau^2` is the second difference of three nodes. The two intervals between them, with the velocities at the
//! nodes eliminated from the strapdown equations, predict for it
//!
//! ```text
//! d2 t = 2 / (h_0 + h_1) [ (A_0 h_0 + A_1 h_1) / 2 - (J_1 h_1^2 - J_0 h_0^2) / 12 ]
//! ```
//!
//! with `A` and `J` the mean acceleration and its slope in an interval, so that integration leaves no residual. With `t' = t +
//! dt`, `R' = exp(dr) R`, in the map's axes:
//!
//! ```text
//! d R e_a / d dt = the second difference of dt         d R e_a / d dr = [x]x,  x = d2 t - g
//! d R e_a / db_a = R                                   d R e_a / dl = -R f_m',   d e_w / dl = -w_m'
//! ```
//!
//! Every sample has its full weight.

use super::imu_residual::{AccelResidual, GyroResidual, Inertial, ResidualSum, offset, span_of};
use super::inertial::{near_steps, with_step_margin};
use super::nodes::Nodes;
use super::rows::{KNOTS, ResidualSums};
use crate::layout::Layout;
use crate::normal_equations::NormalEquations;
use crate::spline::Basis;
use crate::strapdown::{Biases, Interval};
use zsim_base::geometry::{Matrix, Vector, skew};

/// Adds the residuals at `nodes`, whose times are relative to the clock's reference, s.
pub(crate) fn add_inertial(
    equations: &mut NormalEquations,
    layout: &Layout,
    nodes: &Nodes<'_>,
    times_s: &[f64],
    biases: &Biases,
    gravity: &Vector,
) {
    let (mut gyro, mut accel) = (ResidualSums::none(), ResidualSums::none());
    let near_steps = near_steps(nodes.intervals);
    let mut before: Option<(Interval, Inertial)> = None;
    for (k, interval) in nodes.intervals.iter().enumerate() {
        let interval = if near_steps[k] { with_step_margin(interval) } else { *interval };
        let terms = Inertial::between(&nodes.states[k], &nodes.states[k + 1], &interval, biases, gravity);
        let (start, end) = (&nodes.bases[k], &nodes.bases[k + 1]);
        GyroResidual::of(&terms, start, end, &interval)
            .with_clock(&terms, &interval, times_s[k] + 0.5 * interval.h)
            .add_to(&mut gyro, equations, layout);
        if let Some(before) = before {
            let pair = [before, (interval, terms)];
            second_difference(k, times_s[k], nodes, &pair, biases, gravity).add_to(1.0, &mut accel, equations, layout);
        }
        before = Some((interval, terms));
    }
    gyro.flush_to(equations, layout);
    accel.flush_to(equations, layout);
}

/// The accelerometer's residual at node `k`, between two intervals; the node is `time_s` after the clock's reference.
fn second_difference(
    k: usize,
    time_s: f64,
    nodes: &Nodes<'_>,
    pair: &[(Interval, Inertial); 2],
    biases: &Biases,
    gravity: &Vector,
) -> AccelResidual {
    let [h0, h1] = [pair[0].0.h, pair[1].0.h];
    let scale = 2.0 / (h0 + h1);
    // Weights of the three positions in the second difference.
    let weights = [scale / h0, -scale / h0 - scale / h1, scale / h1];
    let measured = (0..3).map(|i| nodes.states[k + i - 1].position * weights[i]).sum::<Vector>();
    let (mut predicted, mut by_clock) = (*gravity, Vector::zeros());
    let mut by_accel = [Matrix::zeros(); 4];
    for ((interval, terms), sign) in pair.iter().zip([-1.0, 1.0]) {
        let (h, from_body) = (interval.h, &terms.map_from_middle);
        let force = interval.force_in_middle(biases);
        let slope = interval.force_slope(biases, &force);
        let weight = 0.5 * scale * h;
        predicted += from_body * (force * weight - slope * (sign * scale * h * h / 12.0));
        by_clock -= from_body * interval.accel_slope * weight;
        let readings = [1.0, interval.accel.x, interval.accel.y, interval.accel.z];
        by_accel.iter_mut().zip(readings).for_each(|(by, reading)| *by += from_body * (weight * reading));
    }
    let bases = [-1, 0, 1].map(|i: isize| &nodes.bases[k.wrapping_add_signed(i)]);
    let first = bases[0].first;
    let mut by_shift = [0.0; KNOTS];
    for (basis, weight) in bases.iter().zip(weights) {
        add_basis(&mut by_shift, basis, first, |value, by| *by += weight * value);
    }
    let mut by_turn = [Matrix::zeros(); KNOTS];
    let by_rotation = skew(&(measured - gravity));
    add_basis(&mut by_turn, bases[1], first, |value, by| *by += by_rotation * value);
    let sigma = 0.5 * (pair[0].0.accel_sigma + pair[1].0.accel_sigma);
    let used = 4 + offset(bases[2].first, first);
    AccelResidual {
        span: span_of(bases[1]),
        sigma,
        sum: ResidualSum { first, used, deviation: measured - predicted, variance: sigma * sigma },
        by_shift,
        by_turn,
        by_accel,
        by_tilt: skew(gravity),
        by_clock: [by_clock, by_clock * time_s],
    }
}

/// Calls `add` with the values of a basis and the entries of `knots`, which start with the knot `first`.
fn add_basis<T>(knots: &mut [T; KNOTS], basis: &Basis, first: i64, mut add: impl FnMut(f64, &mut T)) {
    let from = offset(basis.first, first);
    knots[from..from + 4].iter_mut().zip(basis.value).for_each(|(knot, value)| add(value, knot));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imu_signal::ImuSignal;
    use crate::layout::{ACCEL_BIAS, CLOCK, CLOCK_RATE, GRAVITY, GYRO_BIAS};
    use crate::nominal::Correction;
    use crate::strapdown::State;
    use approx::assert_relative_eq;
    use nalgebra::{DMatrix, DVector};
    use zsim_base::geometry::{Rotation, gravity_in_world};

    const SPACING_S: f64 = 0.2;
    const H_S: f64 = 0.01;
    const START_S: f64 = 0.5;
    const COUNT: usize = 30;
    const BIASES: Biases = Biases { gyro: Vector::new(0.01, -0.02, 0.005), accel: Vector::new(0.03, 0.01, -0.02) };
    const LAYOUT: Layout = Layout { first_knot: 2, knots: 6 };
    /// The clock offset, s, and the lidar time that its rate counts from.
    const CLOCK_AT: (f64, f64) = (0.003, 0.6);

    /// A rocking head's readings over IMU time.
    fn signal() -> ImuSignal {
        let mut signal = ImuSignal::default();
        for k in 0..COUNT + 20 {
            let start_s = START_S - 0.1 + k as f64 * H_S;
            let phase = 7.5 * (start_s + 0.5 * H_S);
            let interval = Interval {
                h: H_S,
                gyro: Vector::new(0.5, 5.0 * phase.cos(), -1.0),
                gyro_slope: Vector::new(0.0, -37.5 * phase.sin(), 0.0),
                accel: Vector::new(2.0, phase.sin() - 1.0, 9.0),
                accel_slope: Vector::new(0.0, 7.5 * phase.cos(), 0.0),
                uncompensated: 1.0,
                gyro_sigma: 0.006,
                accel_sigma: 0.01,
                bridged: false,
            };
            signal.push(start_s, interval);
        }
        signal
    }

    /// Times of the nodes, lidar time, s, not quite evenly spaced.
    fn times_s() -> Vec<f64> {
        (0..=COUNT).map(|k| START_S + k as f64 * H_S + if k % 7 == 3 { 0.002 } else { 0.0 }).collect()
    }

    /// The readings between the nodes for a step of clock offset and rate.
    fn intervals(by_offset_s: f64, by_rate: f64) -> Vec<Interval> {
        let (signal, (offset_s, at_s)) = (signal(), CLOCK_AT);
        let u_s = |tau_s: f64| tau_s + offset_s + by_offset_s + by_rate * (tau_s - at_s);
        let reading = |pair: &[f64]| {
            let mean = signal.mean(u_s(pair[0]), u_s(pair[1])).unwrap();
            Interval { h: pair[1] - pair[0], ..mean }
        };
        times_s().windows(2).map(reading).collect()
    }

    fn integrated(intervals: &[Interval]) -> Vec<State> {
        let start = State {
            rotation: Rotation::from_scaled_axis(Vector::new(0.2, -0.1, 1.0)),
            position: Vector::new(1.0, 2.0, 3.0),
            velocity: Vector::new(0.3, -0.2, 0.1),
        };
        let next = |state: &mut State, interval: &Interval| {
            *state = state.after(interval, &BIASES, &gravity_in_world());
            Some(*state)
        };
        std::iter::once(start).chain(intervals.iter().scan(start, next)).collect()
    }

    /// States that do not fit the readings exactly.
    fn misfit() -> Vec<State> {
        let off = |(k, mut state): (usize, State)| {
            let by = 1e-4 * (k as f64).sin();
            state.rotation = Rotation::from_scaled_axis(Vector::new(1.0, -2.0, 1.0) * by) * state.rotation;
            state.position += Vector::new(0.1, 0.2, -0.1) * by;
            state
        };
        integrated(&intervals(0.0, 0.0)).into_iter().enumerate().map(off).collect()
    }

    fn bases() -> Vec<Basis> {
        times_s().iter().map(|t| Basis::at(*t, SPACING_S)).collect()
    }

    /// The residuals over their sigmas, axis by axis.
    fn whitened(states: &[State], intervals: &[Interval], biases: &Biases, gravity: &Vector) -> DVector<f64> {
        let bases = bases();
        let nodes = Nodes { states, bases: &bases, intervals };
        let terms = |k: usize| {
            let interval = intervals[k];
            (interval, Inertial::between(&states[k], &states[k + 1], &interval, biases, gravity))
        };
        let rate = |k| {
            let (interval, terms) = terms(k);
            terms.map_from_end * terms.rate / interval.gyro_sigma
        };
        let force = |k| {
            let at = second_difference(k, 0.0, &nodes, &[terms(k - 1), terms(k)], biases, gravity);
            at.sum.deviation / at.sigma
        };
        let all = (0..COUNT).map(rate).chain((1..COUNT).map(force));
        DVector::from_vec(all.flat_map(|residual: Vector| [residual.x, residual.y, residual.z]).collect())
    }

    /// The residuals after a step `x` of all unknowns but the IMU's matrices.
    fn moved(x: &DVector<f64>) -> DVector<f64> {
        let border = LAYOUT.border();
        let three = |at: usize| Vector::new(x[border + at], x[border + at + 1], x[border + at + 2]);
        let step = |(state, basis): (State, Basis)| {
            let by = Correction::of_spline(&basis, LAYOUT.first_knot, x.as_slice());
            State {
                rotation: Rotation::from_scaled_axis(by.rotation) * state.rotation,
                position: state.position + by.translation,
                velocity: state.velocity + by.velocity,
            }
        };
        let states: Vec<State> = misfit().into_iter().zip(bases()).map(step).collect();
        let biases = Biases { gyro: BIASES.gyro + three(GYRO_BIAS), accel: BIASES.accel + three(ACCEL_BIAS) };
        let tilt = Vector::new(x[border + GRAVITY], x[border + GRAVITY + 1], 0.0);
        let gravity = Rotation::from_scaled_axis(tilt) * gravity_in_world();
        whitened(&states, &intervals(x[border + CLOCK], x[border + CLOCK_RATE]), &biases, &gravity)
    }

    #[test]
    fn the_derivatives_are_those_of_the_residuals() {
        let (zero, residual) = (DVector::zeros(LAYOUT.size()), moved(&DVector::zeros(LAYOUT.size())));
        let mut jacobian = DMatrix::zeros(residual.len(), LAYOUT.size());
        let unknowns = LAYOUT.border() + CLOCK_RATE + 1;
        for k in 0..unknowns {
            let at = |step: f64| {
                let mut x = zero.clone();
                x[k] = step;
                moved(&x)
            };
            jacobian.set_column(k, &((at(1e-6) - at(-1e-6)) / 2e-6));
        }
        let mut equations = NormalEquations::new(LAYOUT.size());
        let (states, intervals, bases) = (misfit(), intervals(0.0, 0.0), bases());
        let nodes = Nodes { states: &states, bases: &bases, intervals: &intervals };
        let times_s: Vec<f64> = times_s().iter().map(|t| t - CLOCK_AT.1).collect();
        add_inertial(&mut equations, &LAYOUT, &nodes, &times_s, &BIASES, &gravity_in_world());
        // In units in which each unknown has an information of 1. Neglected on purpose: terms of order h, 0.05 rad.
        let dense = equations.dense().view((0, 0), (unknowns, unknowns)).into_owned();
        let numeric = (jacobian.transpose() * &jacobian).view((0, 0), (unknowns, unknowns)).into_owned();
        let scale = DVector::from_fn(unknowns, |k, _| numeric[(k, k)].sqrt().max(1e-9).recip());
        let scaled = |m: &DMatrix<f64>| DMatrix::from_fn(unknowns, unknowns, |r, c| m[(r, c)] * scale[r] * scale[c]);
        assert_relative_eq!(scaled(&dense), scaled(&numeric), epsilon = 0.03);
        let right = DVector::from_fn(unknowns, |k, _| equations.right()[k] * scale[k]);
        let expected = (-jacobian.transpose() * residual).rows(0, unknowns).component_mul(&scale);
        assert_relative_eq!(right, expected, epsilon = 0.03 * expected.amax());
        assert!((LAYOUT.border()..unknowns).all(|k| dense[(k, k)] > 0.0));
    }

    #[test]
    fn integration_leaves_no_residual() {
        let intervals = intervals(0.0, 0.0);
        let residual = whitened(&integrated(&intervals), &intervals, &BIASES, &gravity_in_world());
        assert!(residual.amax() < 0.1, "{}", residual.amax());
    }
}
