//! Normal equations of a window and their solution by Cholesky factorisation.
//!
//! The unknowns are the knots in order of time, then the dense border (biases, gravity, clock, calibration). The lower
//! triangle is stored by rows, with the envelope of each row: from the first non-zero column to the diagonal. Cholesky
//! factorisation causes no fill-in outside the envelope (George and Liu 1981). So a band matrix, a dense border and a
//! full triangle each cost only the necessary work.

use crate::vectorised::vectorised;

/// `H x = b`, with `H` symmetric and positive definite.
#[derive(Debug, Clone)]
pub(super) struct NormalEquations {
    size: usize,
    /// First non-zero column of each row.
    first: Vec<usize>,
    /// Lower triangle, row-major in a full square; the upper part is zero.
    h: Vec<f64>,
    b: Vec<f64>,
}

/// The factor `H = L L^T`.
#[derive(Debug, Clone, Default)]
pub(super) struct Factor {
    size: usize,
    first: Vec<usize>,
    l: Vec<f64>,
}

/// The matrix is not positive definite: the unknown with this index is not determined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NotDetermined(pub(super) usize);

impl NormalEquations {
    /// Empty equations of `size` unknowns.
    pub(super) fn new(size: usize) -> Self {
        Self { size, first: (0..size).collect(), h: vec![0.0; size * size], b: vec![0.0; size] }
    }

    /// Resets the equations to `size` unknowns.
    pub(super) fn reset(&mut self, size: usize) {
        self.size = size;
        self.first.clear();
        self.first.extend(0..size);
        self.h.clear();
        self.h.resize(size * size, 0.0);
        self.b.clear();
        self.b.resize(size, 0.0);
    }

    /// Adds `value` to `H` at (`row`, `column`) and, by symmetry, (`column`, `row`).
    pub(super) fn add_entry(&mut self, row: usize, column: usize, value: f64) {
        let (row, column) = (row.max(column), row.min(column));
        self.first[row] = self.first[row].min(column);
        self.h[row * self.size + column] += value;
    }

    /// Adds consecutive entries to a row of `H`, starting at `column` and at most up to the diagonal.
    #[inline]
    pub(super) fn add_row(&mut self, row: usize, column: usize, entries: &[f64]) {
        debug_assert!(column + entries.len() <= row + 1, "the upper triangle is empty");
        if entries.is_empty() {
            return;
        }
        self.first[row] = self.first[row].min(column);
        axpy(&mut self.h[row * self.size + column..][..entries.len()], entries, 1.0);
    }

    /// Adds `value` to the right-hand side.
    pub(super) fn add_right(&mut self, row: usize, value: f64) {
        self.b[row] += value;
    }

    /// Factors `H`; reuses the memory of `into`.
    ///
    /// # Errors
    /// If an unknown is not determined.
    pub(super) fn factor(&self, into: &mut Factor) -> Result<(), NotDetermined> {
        into.size = self.size;
        into.first.clone_from(&self.first);
        into.l.clone_from(&self.h);
        vectorised!(into.decompose())
    }

    /// The solution, with the factor of these equations.
    pub(super) fn solve(&self, factor: &Factor) -> Vec<f64> {
        factor.solve(&self.b)
    }
}

impl Factor {
    /// Replaces the lower triangle of `H` by that of `L`, row by row within the envelope.
    #[inline(always)]
    fn decompose(&mut self) -> Result<(), NotDetermined> {
        let n = self.size;
        for i in 0..n {
            let from = self.first[i];
            let (above, row) = self.l.split_at_mut(i * n);
            for j in from..i {
                let common = from.max(self.first[j]);
                let other = &above[j * n..=j * n + j];
                let sum = row[j] - dot(&row[common..j], &other[common..j]);
                row[j] = sum / other[j];
            }
            let pivot = row[i] - dot(&row[from..i], &row[from..i]);
            if pivot.is_nan() || pivot <= 1e-14 * row[i].max(f64::MIN_POSITIVE) {
                return Err(NotDetermined(i));
            }
            row[i] = pivot.sqrt();
        }
        Ok(())
    }

    /// `H^-1 b`.
    pub(super) fn solve(&self, b: &[f64]) -> Vec<f64> {
        let mut x = b.to_vec();
        for i in 0..self.size {
            let row = self.row(i);
            x[i] = (x[i] - dot(&row[self.first[i]..i], &x[self.first[i]..i])) / row[i];
        }
        for i in (0..self.size).rev() {
            let row = self.row(i);
            x[i] /= row[i];
            let (scale, from) = (-x[i], self.first[i]);
            axpy(&mut x[from..i], &row[from..i], scale);
        }
        x
    }

    fn row(&self, i: usize) -> &[f64] {
        &self.l[i * self.size..=i * self.size + i]
    }

    /// Information on the last `N` unknowns, with all others marginalised: `L_bb L_bb^T`.
    pub(super) fn information_of_last<const N: usize>(&self) -> nalgebra::SMatrix<f64, N, N> {
        let from = self.size - N;
        let block =
            nalgebra::SMatrix::<f64, N, N>::from_fn(|r, c| if c <= r { self.row(from + r)[from + c] } else { 0.0 });
        block * block.transpose()
    }
}

#[cfg(test)]
impl NormalEquations {
    /// The full matrix `H`, for tests.
    pub(super) fn dense(&self) -> nalgebra::DMatrix<f64> {
        let n = self.size;
        nalgebra::DMatrix::from_fn(n, n, |r, c| self.h[r.max(c) * n + r.min(c)])
    }

    /// The right-hand side, for tests.
    pub(super) fn right(&self) -> nalgebra::DVector<f64> {
        nalgebra::DVector::from_column_slice(&self.b)
    }
}

/// `into += scale * from`.
fn axpy(into: &mut [f64], from: &[f64], scale: f64) {
    for (sum, term) in into.iter_mut().zip(from) {
        *sum += scale * term;
    }
}

/// Number of partial sums of a dot product: two independent vector registers of four.
const LANES: usize = 8;

/// Dot product in lanes: vectorises, with a fixed order of summation.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    let (whole_a, whole_b) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f64 = whole_a.remainder().iter().zip(whole_b.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in whole_a.zip(whole_b) {
        for lane in 0..LANES {
            lanes[lane] += x[lane] * y[lane];
        }
    }
    lanes.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::{DMatrix, DVector};

    /// Products `u v^T + v u^T` with their start indices, for 20 unknowns and a border of 3.
    fn products() -> Vec<(usize, [f64; 3], usize, [f64; 2])> {
        let wave = |k: usize, m: usize| ((k * k * 3 + m * m * 5 + k * m * 11) as f64 * 0.37).sin();
        (0..60_usize)
            .map(|k| {
                let start = k % 16;
                let other = [start + 2, start + 1, start, 20 + k % 2, (start + 5).min(18)][k % 5];
                (start, std::array::from_fn(|m| wave(k, m)), other, std::array::from_fn(|m| wave(k, m + 3)))
            })
            .collect()
    }

    fn add(equations: &mut NormalEquations, (start_u, u, start_v, v): &(usize, [f64; 3], usize, [f64; 2])) {
        for (row, by) in v.iter().enumerate().map(|(r, by)| (start_v + r, 0.7 * by)) {
            if start_u + u.len() <= row {
                equations.add_row(row, *start_u, &u.map(|entry| entry * by));
                continue;
            }
            for (column, entry) in u.iter().enumerate().map(|(c, entry)| (start_u + c, entry * by)) {
                equations.add_entry(row, column, if row == column { 2.0 * entry } else { entry });
            }
        }
    }

    fn with_diagonal(size: usize) -> NormalEquations {
        let mut equations = NormalEquations::new(size);
        for k in 0..size {
            equations.add_entry(k, k, 40.0);
            equations.add_right(k, (k as f64).cos());
        }
        equations
    }

    #[test]
    fn the_solution_is_that_of_dense_cholesky() {
        let mut equations = with_diagonal(23);
        let mut dense = DMatrix::<f64>::identity(23, 23) * 40.0;
        let right = DVector::<f64>::from_fn(23, |k, _| (k as f64).cos());
        for product in products() {
            add(&mut equations, &product);
            let (start_u, u, start_v, v) = product;
            let (mut whole_u, mut whole_v) = (DVector::<f64>::zeros(23), DVector::<f64>::zeros(23));
            whole_u.rows_mut(start_u, 3).copy_from_slice(&u);
            whole_v.rows_mut(start_v, 2).copy_from_slice(&v);
            dense += (&whole_u * whole_v.transpose() + &whole_v * whole_u.transpose()) * 0.7;
        }
        assert_relative_eq!(equations.dense(), dense, epsilon = 1e-12);
        let mut factor = Factor::default();
        equations.factor(&mut factor).unwrap();
        let x = DVector::from_vec(equations.solve(&factor));
        assert_relative_eq!(x, dense.clone().cholesky().unwrap().solve(&right), epsilon = 1e-9);
        // The marginal information of the border is the inverse of the border block of the covariance.
        let covariance = dense.try_inverse().unwrap().view((20, 20), (3, 3)).into_owned();
        let information = factor.information_of_last::<3>();
        let back = information.try_inverse().unwrap();
        for r in 0..3 {
            for c in 0..3 {
                assert_relative_eq!(back[(r, c)], covariance[(r, c)], epsilon = 1e-9);
            }
        }
    }

    #[test]
    fn an_undetermined_unknown_is_reported() {
        let mut equations = NormalEquations::new(3);
        equations.add_entry(0, 0, 1.0);
        equations.add_entry(1, 0, 0.15);
        equations.add_entry(1, 1, 1.0);
        assert_eq!(equations.factor(&mut Factor::default()), Err(NotDetermined(2)));
    }
}
