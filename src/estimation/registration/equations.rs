//! Normal equations of the whole trajectory, knot by knot: what hangs together in time apart from what links times that
//! are far from each other.

use super::blocks::Blocks;
use super::gradients::{self, System};
use super::lidar::{SHARED, Shared};
use crate::estimation::spline::Basis;
use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::Llt;
use nalgebra::{Cholesky, Const, Matrix6, SMatrix, Vector6};

/// Segments so far from each other hang together in time: the open loop's motion links neighbours.
const NEAR: i64 = 1;
/// Knots of a segment of the spline.
const KNOTS: usize = 4;

/// What a residual, or the sum of many, says of the corrections at two instants: `J^T W J` and `-J^T W e`.
#[derive(Debug, Clone, Default)]
pub(super) struct Link {
    pub(super) first: Own,
    pub(super) second: Own,
    /// Rows of the first, columns of the second.
    pub(super) cross: Matrix6<f64>,
}

/// What is said of the correction at one instant.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Own {
    pub(super) square: Matrix6<f64>,
    pub(super) right: Vector6<f64>,
    /// With what is shared, in columns.
    shared: SMatrix<f64, 6, SHARED>,
}

/// What is said of what all share.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Beside {
    square: SMatrix<f64, SHARED, SHARED>,
    right: Shared,
}

impl Link {
    /// Adds a residual `e` with its derivatives by the two corrections.
    pub(super) fn add(&mut self, (by_first, by_second): (&Vector6<f64>, &Vector6<f64>), e: f64, weight: f64) {
        let scaled = by_first * weight;
        self.cross += scaled * by_second.transpose();
        self.first.add(by_first, e, weight);
        self.second.add(by_second, e, weight);
    }
}

impl Own {
    /// Adds a residual `e` with its derivative by the correction.
    pub(super) fn add(&mut self, by: &Vector6<f64>, e: f64, weight: f64) {
        let scaled = by * weight;
        self.square += scaled * by.transpose();
        self.right -= scaled * e;
    }

    /// Adds that a residual hangs on the correction and on what is shared.
    pub(super) fn add_shared(&mut self, by: &Vector6<f64>, by_shared: &Shared, weight: f64) {
        self.shared += by * (by_shared * weight).transpose();
    }

    /// Adds what another says.
    pub(super) fn merge(&mut self, other: &Self) {
        self.square += other.square;
        self.right += other.right;
        self.shared += other.shared;
    }
}

impl Beside {
    /// Adds a residual `e` with its derivative by what is shared.
    pub(super) fn add(&mut self, by: &Shared, e: f64, weight: f64) {
        let scaled = by * weight;
        self.square += scaled * by.transpose();
        self.right -= scaled * e;
    }

    /// Adds what another says.
    pub(super) fn merge(&mut self, other: &Self) {
        self.square += other.square;
        self.right += other.right;
    }
}

/// `H x = b` over the knots' corrections, each `[dr, dt]`, and beside them what is shared.
#[derive(Debug, Clone)]
pub(super) struct Equations {
    first_knot: i64,
    /// What is said of the knots of one segment, or of two neighbouring ones: positive semidefinite by itself.
    near: Blocks,
    /// What links segments that are no neighbours.
    far: Blocks,
    right: Vec<f64>,
    /// Of each knot, with what is shared, in columns.
    shared: Vec<SMatrix<f64, 6, SHARED>>,
    pub(super) beside: Beside,
}

impl Equations {
    /// Empty equations of `knots` knots from `first_knot` on, where neighbours hang together, and the knots of every
    /// two segments of `linked` (indices of their first knots).
    pub(super) fn new(first_knot: i64, knots: usize, linked: impl Iterator<Item = (i64, i64)>) -> Self {
        let reach = KNOTS - 1 + NEAR as usize;
        let near = (0..knots).map(|k| (k.saturating_sub(reach) as u32..=k as u32).collect()).collect();
        let mut far = vec![Vec::new(); knots];
        let mut segments: Vec<(i64, i64)> =
            linked.filter(|(a, b)| !is_near(*a, *b)).map(|(a, b)| (a.min(b), a.max(b))).collect();
        segments.sort_unstable();
        segments.dedup();
        for (early, late) in segments {
            let (early, late) = ((early - first_knot) as usize, (late - first_knot) as usize);
            for (row, column) in
                (late..late + KNOTS).flat_map(|row| (early..early + KNOTS).map(move |column| (row, column)))
            {
                far[row.max(column)].push(row.min(column) as u32);
            }
        }
        let shared = vec![SMatrix::zeros(); knots];
        let (near, far) = (Blocks::new(near), Blocks::new(far));
        Self { first_knot, near, far, right: vec![0.0; 6 * knots], shared, beside: Beside::default() }
    }

    /// Sets all numbers to zero.
    pub(super) fn clear(&mut self) {
        self.near.clear();
        self.far.clear();
        self.right.fill(0.0);
        self.shared.fill(SMatrix::zeros());
        self.beside = Beside::default();
    }

    fn knots_of(&self, basis: &Basis) -> [(usize, f64); KNOTS] {
        let first = (basis.first - self.first_knot) as usize;
        std::array::from_fn(|a| (first + a, basis.value[a]))
    }

    /// Adds what is said of the correction where `basis` is.
    pub(super) fn add_own(&mut self, basis: &Basis, own: &Own) {
        let knots = self.knots_of(basis);
        for (k, (row, value)) in knots.iter().enumerate() {
            for (sum, term) in self.right[6 * row..6 * row + 6].iter_mut().zip(own.right.iter()) {
                *sum += value * term;
            }
            for (column, other) in &knots[..=k] {
                // The diagonal is added with its transpose, which it equals.
                let by = value * other * if row == column { 0.5 } else { 1.0 };
                self.near.add(*row, *column, &(own.square * by));
            }
            self.shared[*row] += own.shared * *value;
        }
    }

    /// Adds how the corrections at two instants hang together.
    pub(super) fn add_cross(&mut self, first: &Basis, second: &Basis, cross: &Matrix6<f64>) {
        let (firsts, seconds) = (self.knots_of(first), self.knots_of(second));
        let into = if is_near(first.first, second.first) { &mut self.near } else { &mut self.far };
        for (row, value) in firsts {
            for (column, other) in seconds {
                into.add(row, column, &(cross * (value * other)));
            }
        }
    }

    /// Adds `value` to every diagonal entry.
    pub(super) fn add_diagonal(&mut self, value: f64) {
        self.near.add_diagonal(value);
        self.beside.square += SMatrix::identity() * value;
    }

    /// The solution, of the knots and of what is shared, or nothing where the equations do not determine one.
    pub(super) fn solve(&self) -> Option<(Vec<f64>, Shared)> {
        let system = InTime { equations: self, near: self.near.factor()?, beside: self.beside.square.cholesky()? };
        let mut right = self.right.clone();
        right.extend(self.beside.right.iter());
        let mut x = gradients::solve(&system, &right)?;
        let shared = Shared::from_iterator(x.drain(self.right.len()..));
        Some((x, shared))
    }
}

fn is_near(first: i64, second: i64) -> bool {
    (first - second).abs() <= NEAR
}

/// Equations, near which are those of what hangs together in time, and of what is shared apart from it.
struct InTime<'a> {
    equations: &'a Equations,
    near: Llt<usize, f64>,
    beside: Cholesky<f64, Const<SHARED>>,
}

impl System for InTime<'_> {
    fn add_product(&self, x: &[f64], sum: &mut [f64]) {
        let Equations { near, far, right, shared, beside, .. } = self.equations;
        let (knots, x_shared) = x.split_at(right.len());
        let (into, into_shared) = sum.split_at_mut(right.len());
        near.add_product(knots, into);
        far.add_product(knots, into);
        let x_shared = Shared::from_column_slice(x_shared);
        let mut by_shared = beside.square * x_shared;
        for (of_knot, (own, into)) in shared.iter().zip(knots.chunks_exact(6).zip(into.chunks_exact_mut(6))) {
            by_shared += of_knot.tr_mul(&Vector6::from_column_slice(own));
            into.iter_mut().zip(&(of_knot * x_shared)).for_each(|(sum, term)| *sum += term);
        }
        into_shared.iter_mut().zip(&by_shared).for_each(|(sum, term)| *sum += term);
    }

    fn solve_near(&self, z: &mut [f64]) {
        let (knots, shared) = z.split_at_mut(self.equations.right.len());
        let size = knots.len();
        self.near.solve_in_place(faer::MatMut::from_column_major_slice_mut(knots, size, 1));
        let solved = self.beside.solve(&Shared::from_column_slice(shared));
        shared.copy_from_slice(solved.as_slice());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::{DMatrix, DVector};

    fn wave(k: usize) -> Vector6<f64> {
        Vector6::from_fn(|r, _| ((k * 7 + r * r * 3 + r * k) as f64 * 0.41).sin())
    }

    /// Against the definition: a dense Jacobian of every residual, and `(J^T W J + I) x = -J^T W e` by another solver.
    #[test]
    fn the_solution_is_that_of_the_dense_equations() {
        let (h, knots, first_knot) = (0.7, 13, -1);
        let of_knots = 6 * knots;
        let instants = [(0.1, 5.9), (0.2, 0.4), (3.0, 3.6), (5.5, 1.2), (2.2, 4.1)];
        let bases = instants.map(|(a, b)| (Basis::at(a, h), Basis::at(b, h)));
        let mut equations = Equations::new(first_knot, knots, bases.iter().map(|(a, b)| (a.first, b.first)));
        let size = of_knots + SHARED;
        let (mut dense, mut right) = (DMatrix::<f64>::identity(size, size), DVector::<f64>::zeros(size));
        for (k, (a, b)) in bases.iter().enumerate() {
            let mut link = Link::default();
            for m in 0..5 {
                let (by_a, by_b, e, weight) = (wave(k + 9 * m), wave(k + 50 + m), 0.3 * m as f64 - 0.5, 2.0 + k as f64);
                let by_shared = Shared::from_fn(|r, _| ((k * 5 + r * 3 + m) as f64 * 0.7).cos());
                link.add((&by_a, &by_b), e, weight);
                link.first.add_shared(&by_a, &by_shared, weight);
                link.second.add_shared(&by_b, &by_shared, weight);
                equations.beside.add(&by_shared, e, weight);
                let mut row = DVector::<f64>::zeros(size);
                row.rows_mut(of_knots, SHARED).copy_from(&by_shared);
                for (basis, by) in [(a, by_a), (b, by_b)] {
                    for (c, value) in basis.value.iter().enumerate() {
                        let at = 6 * ((basis.first - first_knot) as usize + c);
                        let mut part = row.rows_mut(at, 6);
                        part += by * *value;
                    }
                }
                dense += &row * row.transpose() * weight;
                right -= row * (e * weight);
            }
            equations.add_own(a, &link.first);
            equations.add_own(b, &link.second);
            equations.add_cross(a, b, &link.cross);
        }
        equations.add_diagonal(1.0);
        let expected = dense.lu().solve(&right).unwrap();
        let (x, shared) = equations.solve().unwrap();
        let solved = DVector::from_iterator(size, x.iter().chain(shared.iter()).copied());
        assert!((&solved - &expected).norm() < 1e-6 * expected.norm(), "{solved} {expected}");
        // What is shared is the harder part: it hangs on all knots.
        for (x, y) in shared.iter().zip(expected.iter().skip(of_knots)) {
            assert_relative_eq!(x, y, max_relative = 1e-5);
        }
    }

    #[test]
    fn what_is_not_determined_has_no_solution() {
        assert_eq!(Equations::new(0, 5, std::iter::empty()).solve(), None);
    }
}
