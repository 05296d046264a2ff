//! Normal equations of the whole trajectory: blocks of six by six, knot by knot, where knots hang together; solved by a
//! sparse Cholesky factor with a fill-reducing order.

use super::lidar::{SHARED, Shared};
use crate::estimation::spline::Basis;
use faer::Side;
use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use nalgebra::{Matrix6, SMatrix, Vector6};

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
    /// Of each knot, the knots up to itself that it hangs together with, in order.
    columns: Vec<Vec<u32>>,
    /// One block each, rows of the later knot.
    blocks: Vec<Vec<Matrix6<f64>>>,
    right: Vec<f64>,
    /// Of each knot, with what is shared, in columns.
    shared: Vec<SMatrix<f64, 6, SHARED>>,
    pub(super) beside: Beside,
}

impl Equations {
    /// Empty equations of `knots` knots from `first_knot` on, where neighbours hang together, and the knots of every two
    /// segments of `linked` (indices of their first knots).
    pub(super) fn new(first_knot: i64, knots: usize, linked: impl Iterator<Item = (i64, i64)>) -> Self {
        // Every segment has four knots, and residuals link neighbouring segments.
        let mut columns: Vec<Vec<u32>> =
            (0..knots).map(|k| (k.saturating_sub(4) as u32..=k as u32).collect()).collect();
        let mut segments: Vec<(i64, i64)> = linked.map(|(a, b)| (a.min(b), a.max(b))).collect();
        segments.sort_unstable();
        segments.dedup();
        for (early, late) in segments {
            let (early, late) = ((early - first_knot) as usize, (late - first_knot) as usize);
            for (row, column) in (late..late + 4).flat_map(|row| (early..early + 4).map(move |column| (row, column))) {
                columns[row.max(column)].push(row.min(column) as u32);
            }
        }
        for row in &mut columns {
            row.sort_unstable();
            row.dedup();
        }
        let blocks = columns.iter().map(|row| vec![Matrix6::zeros(); row.len()]).collect();
        let shared = vec![SMatrix::zeros(); knots];
        Self { first_knot, columns, blocks, right: vec![0.0; 6 * knots], shared, beside: Beside::default() }
    }

    /// Sets all numbers to zero.
    pub(super) fn clear(&mut self) {
        self.blocks.iter_mut().flatten().for_each(|block| block.fill(0.0));
        self.right.fill(0.0);
        self.shared.fill(SMatrix::zeros());
        self.beside = Beside::default();
    }

    fn knots_of<'a>(&self, basis: &'a Basis) -> impl Iterator<Item = (usize, f64)> + 'a {
        let first = (basis.first - self.first_knot) as usize;
        basis.value.iter().enumerate().map(move |(a, value)| (first + a, *value))
    }

    /// Adds `block` at (`row`, `column`), and by symmetry its transpose at (`column`, `row`).
    fn add_block(&mut self, row: usize, column: usize, block: &Matrix6<f64>) {
        let (late, early) = (row.max(column), row.min(column));
        if let Ok(at) = self.columns[late].binary_search(&(early as u32)) {
            let into = &mut self.blocks[late][at];
            match row.cmp(&column) {
                std::cmp::Ordering::Greater => *into += block,
                std::cmp::Ordering::Less => *into += block.transpose(),
                std::cmp::Ordering::Equal => *into += block + block.transpose(),
            }
        }
    }

    /// Adds what is said of the correction where `basis` is.
    pub(super) fn add_own(&mut self, basis: &Basis, own: &Own) {
        let knots: [(usize, f64); 4] =
            std::array::from_fn(|a| ((basis.first - self.first_knot) as usize + a, basis.value[a]));
        for (k, (row, value)) in knots.iter().enumerate() {
            for (sum, term) in self.right[6 * row..6 * row + 6].iter_mut().zip(own.right.iter()) {
                *sum += value * term;
            }
            for (column, other) in &knots[..=k] {
                // The diagonal is added with its transpose, which it equals.
                let by = value * other * if row == column { 0.5 } else { 1.0 };
                self.add_block(*row, *column, &(own.square * by));
            }
            self.shared[*row] += own.shared * *value;
        }
    }

    /// Adds how the corrections at two instants hang together.
    pub(super) fn add_cross(&mut self, first: &Basis, second: &Basis, cross: &Matrix6<f64>) {
        let seconds: Vec<(usize, f64)> = self.knots_of(second).collect();
        let firsts: Vec<(usize, f64)> = self.knots_of(first).collect();
        for (row, value) in firsts {
            for (column, other) in &seconds {
                self.add_block(row, *column, &(cross * (value * other)));
            }
        }
    }

    /// Adds `value` to every diagonal entry.
    pub(super) fn add_diagonal(&mut self, value: f64) {
        for row in &mut self.blocks {
            if let Some(diagonal) = row.last_mut() {
                *diagonal += Matrix6::identity() * value;
            }
        }
        self.beside.square += SMatrix::identity() * value;
    }

    /// The solution, of the knots and of what is shared, or nothing where the equations do not determine one. What is shared is
    /// few and hangs on all: it is solved for last, by the Schur complement of the knots.
    pub(super) fn solve(&self) -> Option<(Vec<f64>, Shared)> {
        let (starts, rows, values) = self.upper_by_columns();
        let size = self.right.len();
        let pattern = SymbolicSparseColMatRef::new_checked(size, size, &starts, None, &rows);
        let symbolic = SymbolicLlt::try_new(pattern, Side::Upper).ok()?;
        let matrix = SparseColMatRef::new(pattern, &values);
        let factor = Llt::try_new_with_symbolic(symbolic, matrix, Side::Upper).ok()?;
        let mut solved = self.right.clone();
        for column in 0..SHARED {
            solved.extend(self.shared.iter().flat_map(|of_knot| of_knot.column(column).into_iter().copied()));
        }
        factor.solve_in_place(faer::MatMut::from_column_major_slice_mut(&mut solved, size, 1 + SHARED));
        let (x, by_shared) = solved.split_at_mut(size);
        let transposed = |column: &[f64]| -> Shared {
            let knots = self.shared.iter().zip(column.chunks_exact(6));
            knots.map(|(of_knot, part)| of_knot.tr_mul(&Vector6::from_column_slice(part))).sum()
        };
        let mut left = self.beside.square;
        for (k, column) in by_shared.chunks_exact(size).enumerate() {
            let mut into = left.column_mut(k);
            into -= transposed(column);
        }
        let shared = left.cholesky()?.solve(&(self.beside.right - transposed(x)));
        for (k, column) in by_shared.chunks_exact(size).enumerate() {
            x.iter_mut().zip(column).for_each(|(sum, term)| *sum -= shared[k] * term);
        }
        let is_finite = x.iter().chain(shared.iter()).all(|value| value.is_finite());
        is_finite.then(|| (x.to_vec(), shared))
    }

    /// `H` on and above its diagonal, column by column: where each column begins, rows, values. A row of blocks below the
    /// diagonal is a column above it.
    fn upper_by_columns(&self) -> (Vec<usize>, Vec<usize>, Vec<f64>) {
        let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
        for (knot, (columns, blocks)) in self.columns.iter().zip(&self.blocks).enumerate() {
            for axis in 0..6 {
                for (other, block) in columns.iter().map(|k| *k as usize).zip(blocks) {
                    let until = if other == knot { axis + 1 } else { 6 };
                    rows.extend((0..until).map(|k| 6 * other + k));
                    values.extend((0..until).map(|k| block[(axis, k)]));
                }
                starts.push(rows.len());
            }
        }
        (starts, rows, values)
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
        for (x, y) in x.iter().chain(shared.iter()).zip(expected.iter()) {
            assert_relative_eq!(x, y, epsilon = 1e-10);
        }
    }

    #[test]
    fn what_is_not_determined_has_no_solution() {
        assert_eq!(Equations::new(0, 5, std::iter::empty()).solve(), None);
    }
}
