//! Residuals of one IMU interval or sum of intervals, with their derivatives; see `inertial` for the equations.

use super::fast_motion::ByErrors;
use super::rows::{KNOTS, ResidualRow, ResidualSums};
use crate::layout::{ACCEL_BIAS, ACCEL_MATRIX, GRAVITY, GYRO_BIAS, GYRO_MATRIX, Layout};
use crate::normal_equations::NormalEquations;
use crate::spline::Basis;
use crate::strapdown::{Biases, Interval, State};
use zsim_base::geometry::{Matrix, Rotation, Vector, skew};

/// Intervals whose sigmas differ by more than this factor are not put into one sum.
const MAX_SIGMA_RATIO: f64 = 3.0;

/// The residuals of an interval, and the factors of their derivatives.
#[derive(Debug, Clone, Copy)]
pub(super) struct Inertial {
    /// `e_w`, rad/s.
    pub rate: Vector,
    /// `e_a`, m/s^2.
    pub force: Vector,
    pub map_from_end: Matrix,
    pub map_from_middle: Matrix,
    acceleration: Vector,
}

impl Inertial {
    /// Computes the residuals between the states at an interval's ends.
    pub fn between(a: &State, b: &State, interval: &Interval, biases: &Biases, gravity: &Vector) -> Self {
        let turn = a.rotation.inverse() * b.rotation;
        let measured = Rotation::from_scaled_axis(interval.turn(biases));
        let middle = a.rotation * Rotation::from_scaled_axis(turn.scaled_axis() * 0.5);
        let map_from_middle = middle.to_rotation_matrix().into_inner();
        let acceleration = (b.velocity - a.velocity) / interval.h - gravity;
        Self {
            rate: (measured.inverse() * turn).scaled_axis() / interval.h,
            force: map_from_middle.tr_mul(&acceleration) - interval.force_in_middle(biases),
            map_from_end: b.rotation.to_rotation_matrix().into_inner(),
            map_from_middle,
            acceleration,
        }
    }
}

/// The number of the sum that an interval belongs to: from the middle of one knot span to the next.
pub(super) fn span_of(basis: &Basis) -> i64 {
    basis.first + i64::from(basis.value[3] > basis.value[0])
}

/// A residual on three axes, rad or m/s, with the variance and the knots that it depends on.
#[derive(Debug, Clone, Copy)]
pub(super) struct ResidualSum {
    /// Index of the first knot.
    pub first: i64,
    /// How many knots.
    pub used: usize,
    pub deviation: Vector,
    pub variance: f64,
}

impl ResidualSum {
    /// The sum of a mean residual over an interval, between the bases `a` and `b` at the ends.
    fn over(deviation: &Vector, sigma: f64, h: f64, a: &Basis, b: &Basis) -> Self {
        let used = 4 + offset(b.first, a.first);
        Self { first: a.first, used, deviation: deviation * h, variance: (sigma * h).powi(2) }
    }
}

/// The offset of a knot from `first`.
pub(super) fn offset(knot: i64, first: i64) -> usize {
    ((knot - first).max(0) as usize).min(KNOTS - 4)
}

/// The gyroscope residual over an interval, with the derivatives by the unknowns.
#[derive(Debug, Clone, Copy)]
pub(super) struct GyroResidual {
    sum: ResidualSum,
    by_turn: [f64; KNOTS],
    /// By the bias, and by the columns of the scale and misalignment matrix.
    by_gyro: ByErrors,
}

impl GyroResidual {
    pub(super) fn of(terms: &Inertial, a: &Basis, b: &Basis, interval: &Interval) -> Self {
        let h = interval.h;
        let sum = ResidualSum::over(&(terms.map_from_end * terms.rate), interval.gyro_sigma, h, a, b);
        let mut by_turn = [0.0; KNOTS];
        for (basis, sign) in [(a, -1.0), (b, 1.0)] {
            for (sum, value) in by_turn[offset(basis.first, a.first)..].iter_mut().zip(basis.value) {
                *sum += sign * value;
            }
        }
        let w = &interval.gyro;
        let by_gyro = [1.0, w.x, w.y, w.z].map(|reading| terms.map_from_end * (h * reading));
        Self { sum, by_turn, by_gyro }
    }

    /// The same residual of states that take the fast changes by the gyroscope's errors.
    pub(super) fn with_fast_motion(self, by_gyro: ByErrors) -> Self {
        Self { by_gyro, ..self }
    }

    pub(super) fn add_to(&self, rows: &mut ResidualSums, equations: &mut NormalEquations, layout: &Layout) {
        let ResidualSum { first, used, deviation, variance } = self.sum;
        for axis in 0..3 {
            let mut row = ResidualRow::from(first);
            for (knot, by) in self.by_turn[..used].iter().enumerate() {
                *row.knot(knot, axis) = *by;
            }
            for i in 0..3 {
                *row.border(GYRO_BIAS + i) = self.by_gyro[0][(axis, i)];
            }
            for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
                *row.border(GYRO_MATRIX + 3 * i + j) = self.by_gyro[1 + j][(axis, i)];
            }
            rows.add(&row, deviation[axis], variance.recip(), equations, layout);
        }
    }
}

/// The accelerometer residual over one or more intervals, with the derivatives by the unknowns.
#[derive(Debug, Clone, Copy)]
pub(super) struct AccelResidual {
    pub span: i64,
    pub sigma: f64,
    pub sum: ResidualSum,
    pub by_shift: [f64; KNOTS],
    pub by_turn: [Matrix; KNOTS],
    /// By the bias, and by the columns of the scale and misalignment matrix.
    pub by_accel: ByErrors,
    pub by_tilt: Matrix,
}

impl AccelResidual {
    pub(super) fn of(terms: &Inertial, a: &Basis, b: &Basis, interval: &Interval, gravity: &Vector) -> Self {
        let (h, f) = (interval.h, &interval.accel);
        let by_middle = skew(&terms.acceleration) * (0.5 * h);
        let (mut by_shift, mut by_turn) = ([0.0; KNOTS], [Matrix::zeros(); KNOTS]);
        for (basis, sign) in [(a, -1.0), (b, 1.0)] {
            let offset = offset(basis.first, a.first);
            for k in 0..4 {
                by_shift[offset + k] += sign * basis.rate[k];
                by_turn[offset + k] += by_middle * basis.value[k];
            }
        }
        Self {
            span: span_of(a),
            sigma: interval.accel_sigma,
            sum: ResidualSum::over(&(terms.map_from_middle * terms.force), interval.accel_sigma, h, a, b),
            by_shift,
            by_turn,
            by_accel: [1.0, f.x, f.y, f.z].map(|reading| terms.map_from_middle * (h * reading)),
            by_tilt: skew(gravity) * h,
        }
    }

    /// The same residual of states that take the fast changes by the accelerometer's errors.
    pub(super) fn with_fast_motion(self, by_accel: ByErrors) -> Self {
        Self { by_accel, ..self }
    }

    /// Whether another interval belongs to the same span and has a similar sigma.
    pub(super) fn can_be_summed_with(&self, next: &Self) -> bool {
        next.span == self.span && next.sigma < MAX_SIGMA_RATIO * self.sigma && self.sigma < MAX_SIGMA_RATIO * next.sigma
    }

    /// Adds the residual of the next interval.
    pub(super) fn append(&mut self, next: &Self) {
        let offset = offset(next.sum.first, self.sum.first);
        let used = next.sum.used.min(KNOTS - offset);
        for knot in 0..used {
            self.by_shift[offset + knot] += next.by_shift[knot];
            self.by_turn[offset + knot] += next.by_turn[knot];
        }
        self.by_accel.iter_mut().zip(&next.by_accel).for_each(|(by, next)| *by += next);
        self.by_tilt += next.by_tilt;
        self.sum.used = self.sum.used.max(offset + used);
        self.sum.deviation += next.sum.deviation;
        self.sum.variance += next.sum.variance;
    }

    /// Adds the residual to the equations, with the sigma multiplied by `looser`.
    pub(super) fn add_to(
        &self,
        looser: f64,
        rows: &mut ResidualSums,
        equations: &mut NormalEquations,
        layout: &Layout,
    ) {
        let ResidualSum { first, used, deviation, variance } = self.sum;
        let weight = (variance * looser * looser).recip();
        for axis in 0..3 {
            let mut row = ResidualRow::from(first);
            for knot in 0..used {
                for i in 0..3 {
                    *row.knot(knot, i) = self.by_turn[knot][(axis, i)];
                }
                *row.knot(knot, 3 + axis) = self.by_shift[knot];
            }
            for i in 0..3 {
                *row.border(ACCEL_BIAS + i) = self.by_accel[0][(axis, i)];
            }
            for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
                *row.border(ACCEL_MATRIX + 3 * i + j) = self.by_accel[1 + j][(axis, i)];
            }
            // Gravity tilts about the map's x and y.
            for i in 0..2 {
                *row.border(GRAVITY + i) = self.by_tilt[(axis, i)];
            }
            rows.add(&row, deviation[axis], weight, equations, layout);
        }
    }
}
