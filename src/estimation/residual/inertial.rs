//! How the trajectory deviates from what the IMU measured over an interval between two nodes.
//!
//! ```text
//! e_w = log(exp(phi(b_w))^-1 R_k^-1 R_(k+1)) / h
//! e_a = R_mid^T ((v_(k+1) - v_k) / h - g) - (f_mid - b_a)
//! ```
//!
//! Both compare means over the interval, so the rate belongs to its middle and no second difference of positions is taken:
//! `v` is the integrated velocity, corrected by the spline's exact derivative. With `R' = exp(dr) R`, `t' = t + dt`:
//!
//! ```text
//! de_w / d(dr_(k+1) - dr_k) = R_(k+1)^T / h      de_w / db_w = 1
//! de_a / d(dv_(k+1) - dv_k) = R_mid^T / h        de_a / d dr_mid = R_mid^T [x]x,  x = (v_(k+1) - v_k) / h - g
//! de_w / dM = w^T, row by row, M the gyroscope's exaggeration
//! de_a / db_a = 1                                de_a / dgamma = R_mid^T [g]x (e_x, e_y),  g' = exp(gamma) g
//! ```

use super::{ACCEL_BIAS, GRAVITY, GYRO_BIAS, GYRO_MATRIX, Layout};
use crate::estimation::normal_equations::NormalEquations;
use crate::estimation::spline::Basis;
use crate::estimation::strapdown::{Biases, Interval, State};
use crate::geometry::{Matrix, Rotation, Vector, skew};

/// The residuals of an interval and what their derivatives are made of.
#[derive(Debug, Clone, Copy)]
pub(in crate::estimation) struct Inertial {
    /// `e_w`, rad/s.
    pub(in crate::estimation) rate: Vector,
    /// `e_a`, m/s^2.
    pub(in crate::estimation) force: Vector,
    end_from_map: Matrix,
    middle_from_map: Matrix,
    acceleration: Vector,
}

impl Inertial {
    /// The residuals between the states at an interval's ends.
    pub(in crate::estimation) fn between(
        a: &State,
        b: &State,
        interval: &Interval,
        biases: &Biases,
        gravity: &Vector,
    ) -> Self {
        let turn = a.rotation.inverse() * b.rotation;
        let measured = Rotation::from_scaled_axis(interval.turn(biases));
        let bend = interval.gyro_slope * (interval.h * interval.h / 8.0);
        let middle = a.rotation * Rotation::from_scaled_axis(turn.scaled_axis() * 0.5 - bend);
        let middle_from_map = middle.inverse().to_rotation_matrix().into_inner();
        let acceleration = (b.velocity - a.velocity) / interval.h - gravity;
        Self {
            rate: (measured.inverse() * turn).scaled_axis() / interval.h,
            force: middle_from_map * acceleration - interval.force_in_middle(biases),
            end_from_map: b.rotation.inverse().to_rotation_matrix().into_inner(),
            middle_from_map,
            acceleration,
        }
    }

    /// `de_a / d dr` at the middle.
    pub(in crate::estimation) fn force_by_turn(&self) -> Matrix {
        self.middle_from_map * skew(&self.acceleration)
    }

    /// `de_a / dgamma`: a tilt of gravity about the map's x and y.
    pub(in crate::estimation) fn force_by_tilt(&self, gravity: &Vector) -> nalgebra::Matrix3x2<f64> {
        (self.middle_from_map * skew(gravity)).fixed_columns::<2>(0).into_owned()
    }

    /// Adds the interval's part of the normal equations; `bases` at its two ends.
    pub(in crate::estimation) fn add_to(
        &self,
        equations: &mut NormalEquations,
        layout: &Layout,
        bases: (&Basis, &Basis),
        interval: &Interval,
        gravity: &Vector,
    ) {
        let spread = Spread::of(bases, interval.h);
        let first = layout.knot(bases.0.first);
        self.add_rate(equations, layout, (first, &spread), interval);
        self.add_force(equations, layout, (first, &spread), (interval, gravity));
    }

    fn add_rate(
        &self,
        equations: &mut NormalEquations,
        layout: &Layout,
        (first, spread): (usize, &Spread),
        interval: &Interval,
    ) {
        let weight = interval.gyro_sigma.powi(-2);
        let errors = Errors::of_gyro(layout.border(), &interval.gyro);
        // The derivative by a knot is a multiple of a rotation, so its square is that multiple of the identity.
        let right = self.end_from_map.transpose() * self.rate;
        for a in 0..spread.used {
            let scaled = weight * spread.turn[a];
            for c in 0..=a {
                for axis in 0..3 {
                    equations.add_entry(first + 6 * a + axis, first + 6 * c + axis, scaled * spread.turn[c]);
                }
            }
            for axis in 0..3 {
                equations.add_right(first + 6 * a + axis, -scaled * right[axis]);
                for row in 0..3 {
                    let by = scaled * self.end_from_map[(row, axis)];
                    errors.add_beside(equations, row, first + 6 * a + axis, by);
                }
            }
        }
        errors.add_own(equations, &self.rate, weight);
    }

    fn add_force(
        &self,
        equations: &mut NormalEquations,
        layout: &Layout,
        (first, spread): (usize, &Spread),
        (interval, gravity): (&Interval, &Vector),
    ) {
        let weight = interval.accel_sigma.powi(-2);
        let errors = Errors::of_accel(layout.border());
        let tilt = layout.border() + GRAVITY;
        let (by_turn, by_shift, by_tilt) = (self.force_by_turn(), self.middle_from_map, self.force_by_tilt(gravity));
        let turn_turn = by_turn.transpose() * by_turn;
        let turn_shift = by_turn.transpose() * by_shift;
        let (tilt_turn, tilt_shift) = (by_tilt.transpose() * by_turn, by_tilt.transpose() * by_shift);
        let (right_turn, right_shift) = (by_turn.transpose() * self.force, by_shift.transpose() * self.force);
        for a in 0..spread.used {
            let (m, s) = (weight * spread.middle[a], weight * spread.shift[a]);
            let (turn, shift) = (first + 6 * a, first + 6 * a + 3);
            for i in 0..3 {
                equations.add_right(turn + i, -m * right_turn[i]);
                equations.add_right(shift + i, -s * right_shift[i]);
                for c in 0..=a {
                    let (turn_c, shift_c) = (first + 6 * c, first + 6 * c + 3);
                    equations.add_entry(shift + i, shift_c + i, s * spread.shift[c]);
                    for j in 0..3 {
                        // Within one knot the lower triangle alone; between two, the whole block.
                        if c < a || j <= i {
                            equations.add_entry(turn + i, turn_c + j, m * spread.middle[c] * turn_turn[(i, j)]);
                        }
                        equations.add_entry(shift + i, turn_c + j, s * spread.middle[c] * turn_shift[(j, i)]);
                        if c < a {
                            equations.add_entry(turn + i, shift_c + j, m * spread.shift[c] * turn_shift[(i, j)]);
                        }
                    }
                }
                for j in 0..3 {
                    errors.add_beside(equations, j, turn + i, m * by_turn[(j, i)]);
                    errors.add_beside(equations, j, shift + i, s * by_shift[(j, i)]);
                }
                for j in 0..2 {
                    equations.add_entry(tilt + j, turn + i, m * tilt_turn[(j, i)]);
                    equations.add_entry(tilt + j, shift + i, s * tilt_shift[(j, i)]);
                }
            }
        }
        self.add_force_border(equations, (&errors, tilt), &by_tilt, weight);
    }

    fn add_force_border(
        &self,
        equations: &mut NormalEquations,
        (errors, tilt): (&Errors<1>, usize),
        by_tilt: &nalgebra::Matrix3x2<f64>,
        weight: f64,
    ) {
        let square = by_tilt.transpose() * by_tilt;
        let right = by_tilt.transpose() * self.force;
        for i in 0..3 {
            for j in 0..2 {
                errors.add_beside(equations, i, tilt + j, weight * by_tilt[(i, j)]);
            }
        }
        errors.add_own(equations, &self.force, weight);
        for i in 0..2 {
            equations.add_right(tilt + i, -weight * right[i]);
            for j in 0..=i {
                equations.add_entry(tilt + i, tilt + j, weight * square[(i, j)]);
            }
        }
    }
}

/// A sensor's own errors among the unknowns: component `i` of its residual hangs on `unknowns[i][k]` by `by[k]`.
struct Errors<const N: usize> {
    unknowns: [[usize; N]; 3],
    by: [f64; N],
}

impl Errors<4> {
    /// The bias by 1, and row `i` of the exaggeration by the reading.
    fn of_gyro(border: usize, reading: &Vector) -> Self {
        let row = |i: usize| {
            let matrix = border + GYRO_MATRIX + 3 * i;
            [border + GYRO_BIAS + i, matrix, matrix + 1, matrix + 2]
        };
        Self { unknowns: [row(0), row(1), row(2)], by: [1.0, reading.x, reading.y, reading.z] }
    }
}

impl Errors<1> {
    /// The bias.
    fn of_accel(border: usize) -> Self {
        let bias = border + ACCEL_BIAS;
        Self { unknowns: [[bias], [bias + 1], [bias + 2]], by: [1.0] }
    }
}

impl<const N: usize> Errors<N> {
    /// Adds the products with another unknown, by which component `i` changes `by` times.
    fn add_beside(&self, equations: &mut NormalEquations, i: usize, unknown: usize, by: f64) {
        for (own, factor) in self.unknowns[i].iter().zip(self.by) {
            equations.add_entry(*own, unknown, by * factor);
        }
    }

    /// Adds the products among themselves, and the right-hand side.
    fn add_own(&self, equations: &mut NormalEquations, residual: &Vector, weight: f64) {
        for (i, unknowns) in self.unknowns.iter().enumerate() {
            for (a, (row, by)) in unknowns.iter().zip(self.by).enumerate() {
                equations.add_right(*row, -weight * by * residual[i]);
                for (column, other) in unknowns.iter().zip(self.by).take(a + 1) {
                    equations.add_entry(*row, *column, weight * by * other);
                }
            }
        }
    }
}

/// How an interval's differences hang on the (at most five) knots about it.
struct Spread {
    used: usize,
    /// Of the mean rate of rotation, 1/s.
    turn: [f64; 5],
    /// Of the rotation in the middle.
    middle: [f64; 5],
    /// Of the mean acceleration, 1/s^2.
    shift: [f64; 5],
}

impl Spread {
    fn of((a, b): (&Basis, &Basis), h: f64) -> Self {
        let late = (b.first - a.first).clamp(0, 1) as usize;
        let mut spread = Self { used: 4 + late, turn: [0.0; 5], middle: [0.0; 5], shift: [0.0; 5] };
        for k in 0..4 {
            spread.turn[k] -= a.value[k] / h;
            spread.turn[k + late] += b.value[k] / h;
            spread.middle[k] += 0.5 * a.value[k];
            spread.middle[k + late] += 0.5 * b.value[k];
            spread.shift[k] -= a.rate[k] / h;
            spread.shift[k + late] += b.rate[k] / h;
        }
        spread
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::nominal::Correction;
    use crate::geometry::{from_roll_pitch_yaw, gravity_in_world};
    use approx::assert_relative_eq;
    use nalgebra::{DMatrix, DVector};

    const SPACING_S: f64 = 0.2;

    struct Case {
        states: [State; 2],
        interval: Interval,
        biases: Biases,
        gravity: Vector,
        times_s: [f64; 2],
    }

    /// An interval of 10 ms across a knot, at a few rad/s, with states that do not quite fit it.
    fn case() -> Case {
        let interval = Interval {
            h: 0.01,
            gyro: Vector::new(0.5, 5.0, -1.0),
            gyro_slope: Vector::new(10.0, -20.0, 5.0),
            accel: Vector::new(2.0, -1.0, 9.0),
            accel_slope: Vector::new(-30.0, 10.0, 20.0),
            gyro_sigma: 0.006,
            accel_sigma: 0.01,
            bridged: false,
        };
        let biases = Biases { gyro: Vector::new(0.01, -0.02, 0.005), accel: Vector::new(0.03, 0.01, -0.02) };
        let gravity = gravity_in_world();
        let rotation = from_roll_pitch_yaw(0.2, -0.6, 1.4);
        let start = State { rotation, position: Vector::new(1.0, 2.0, 3.0), velocity: Vector::new(0.3, -0.2, 0.1) };
        let mut end = start.after(&interval, &biases, &gravity);
        end.rotation = Rotation::from_scaled_axis(Vector::new(1e-4, -2e-4, 1e-4)) * end.rotation;
        end.velocity += Vector::new(1e-3, 2e-3, -1e-3);
        Case { states: [start, end], interval, biases, gravity, times_s: [0.595, 0.605] }
    }

    fn layout() -> Layout {
        Layout { first_knot: 2, knots: 5 }
    }

    /// Both residuals, whitened, after a step `x` of the window's unknowns.
    fn whitened(case: &Case, x: &DVector<f64>) -> DVector<f64> {
        let moved = |k: usize| {
            let correction = Correction::of_spline(&Basis::at(case.times_s[k], SPACING_S), 2, x.as_slice());
            let state = &case.states[k];
            State {
                rotation: Rotation::from_scaled_axis(correction.rotation) * state.rotation,
                position: state.position + correction.translation,
                velocity: state.velocity + correction.velocity,
            }
        };
        let border = layout().border();
        let three = |at: usize| Vector::new(x[border + at], x[border + at + 1], x[border + at + 2]);
        let biases = Biases { gyro: case.biases.gyro + three(GYRO_BIAS), accel: case.biases.accel + three(ACCEL_BIAS) };
        let interval = case.interval.without(&Matrix::from_fn(|r, c| x[border + GYRO_MATRIX + 3 * r + c]));
        let tilt = Vector::new(x[border + GRAVITY], x[border + GRAVITY + 1], 0.0);
        let gravity = Rotation::from_scaled_axis(tilt) * case.gravity;
        let terms = Inertial::between(&moved(0), &moved(1), &interval, &biases, &gravity);
        let (rate, force) = (terms.rate / case.interval.gyro_sigma, terms.force / case.interval.accel_sigma);
        DVector::from_iterator(6, rate.iter().chain(force.iter()).copied())
    }

    #[test]
    fn the_derivatives_are_those_of_the_residuals() {
        let (case, layout) = (case(), layout());
        let zero = DVector::zeros(layout.size());
        let mut jacobian = DMatrix::zeros(6, layout.size());
        let step = 1e-6;
        for k in 0..layout.size() {
            let mut x = zero.clone();
            x[k] = step;
            let forward = whitened(&case, &x);
            x[k] = -step;
            jacobian.set_column(k, &((forward - whitened(&case, &x)) / (2.0 * step)));
        }
        let residual = whitened(&case, &zero);
        let mut equations = NormalEquations::new(layout.size());
        let [a, b] = &case.states;
        let bases = case.times_s.map(|t| Basis::at(t, SPACING_S));
        Inertial::between(a, b, &case.interval, &case.biases, &case.gravity).add_to(
            &mut equations,
            &layout,
            (&bases[0], &bases[1]),
            &case.interval,
            &case.gravity,
        );
        // Left out on purpose: what the biases do through terms of order h (a turn of 0.05 rad within the interval).
        let (dense, numeric) = (equations.dense(), jacobian.transpose() * &jacobian);
        let scale = numeric.amax();
        assert_relative_eq!(dense, numeric, epsilon = 1e-2 * scale, max_relative = 2e-2);
        let knots = layout.border();
        let block = |m: &DMatrix<f64>| m.view((0, 0), (knots, knots)).into_owned();
        assert_relative_eq!(block(&dense), block(&numeric), epsilon = 2e-4 * block(&numeric).amax());
        let right = -jacobian.transpose() * residual;
        assert_relative_eq!(equations.right(), right, epsilon = 5e-3 * right.amax());
    }

    #[test]
    fn integration_leaves_no_residual() {
        let case = case();
        let end = case.states[0].after(&case.interval, &case.biases, &case.gravity);
        let terms = Inertial::between(&case.states[0], &end, &case.interval, &case.biases, &case.gravity);
        assert!(terms.rate.norm() < 1e-12, "{}", terms.rate);
        // The middle is found from the turn here and from the rate there: they differ by the coning term, h^3 small.
        assert!(terms.force.norm() < 1e-3, "{}", terms.force);
    }
}
