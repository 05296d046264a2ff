//! Dense information matrices and their Schur complements.

use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, Mat, MatRef, Par, Side};
use nalgebra::SMatrix;

/// A symmetric matrix, of which only the lower triangle is used.
#[derive(Debug, Clone)]
pub(super) struct Information {
    lower: Mat<f64>,
}

impl Information {
    pub(super) fn zeros(size: usize) -> Self {
        Self { lower: Mat::zeros(size, size) }
    }

    /// Adds a symmetric block at the variables `at`, all different.
    pub(super) fn add<const M: usize>(&mut self, at: &[usize; M], block: &SMatrix<f64, M, M>) {
        for (column, b) in at.iter().enumerate() {
            for (row, a) in at.iter().enumerate().filter(|(_, a)| *a >= b) {
                self.lower[(*a, *b)] += block[(row, column)];
            }
        }
    }

    /// Adds another matrix, whose variables are `at` here.
    pub(super) fn add_all(&mut self, at: &[usize], other: &Self) {
        for (column, b) in at.iter().enumerate() {
            for (row, a) in at.iter().enumerate().skip(column) {
                self.lower[(*a.max(b), *a.min(b))] += other.lower[(row, column)];
            }
        }
    }

    /// Subtracts `factor^T factor`, whose columns are the variables `at`.
    pub(super) fn subtract_square(&mut self, at: &[usize], factor: &nalgebra::Matrix3xX<f64>) {
        for (column, b) in at.iter().enumerate() {
            for (row, a) in at.iter().enumerate().filter(|(_, a)| *a >= b) {
                self.lower[(*a, *b)] -= factor.column(row).dot(&factor.column(column));
            }
        }
    }

    /// Adds the inverse square of `sigma` to the diagonal at a variable.
    pub(super) fn add_prior(&mut self, at: usize, sigma: f64) {
        self.lower[(at, at)] += 1.0 / (sigma * sigma);
    }

    /// Marginalises the first `count` variables. `None` if their information is singular.
    pub(super) fn without_first(self, count: usize) -> Option<Self> {
        if count == 0 {
            return Some(self);
        }
        let (leading, _, cross, trailing) = self.lower.split_at(count, count);
        let factor = leading.llt(Side::Lower).ok()?;
        let mut across = cross.transpose().to_owned();
        solve_lower_triangular_in_place(factor.L(), across.as_mut(), Par::Seq);
        let mut rest = trailing.to_owned();
        matmul(
            rest.as_mut(),
            BlockStructure::TriangularLower,
            Accum::Add,
            across.transpose(),
            BlockStructure::Rectangular,
            across.as_ref(),
            BlockStructure::Rectangular,
            -1.0,
            Par::Seq,
        );
        Some(Self { lower: rest })
    }

    /// `L^-1 across` with the Cholesky factor `L`: the inner products of its columns are covariances. `None` if the
    /// matrix is singular.
    pub(super) fn whiten(&self, across: MatRef<'_, f64>) -> Option<Mat<f64>> {
        let factor = self.lower.llt(Side::Lower).ok()?;
        let mut white = across.to_owned();
        solve_lower_triangular_in_place(factor.L(), white.as_mut(), Par::Seq);
        Some(white)
    }
}
