//! Information matrices and their Schur complements.

use super::block::BLOCK;
use super::block_triangle::BlockTriangle;
use nalgebra::{DMatrix, Matrix3xX, SMatrix};

/// A symmetric matrix, of which only the lower triangle is used. Some first variables can be marginalised.
#[derive(Debug, Clone)]
pub(super) struct Information {
    /// Number of the first variables, and of the others.
    sizes: (usize, usize),
    /// The first variables, then the others; both fill whole blocks, with ones on the diagonal for the missing variables.
    lower: BlockTriangle,
}

impl Information {
    /// Zero information on `first` variables, which can be marginalised, and `others`.
    pub(super) fn zeros(first: usize, others: usize) -> Self {
        let padded = first.next_multiple_of(BLOCK);
        let all = padded + others.next_multiple_of(BLOCK);
        let mut lower = BlockTriangle::zeros(all / BLOCK);
        (first..padded).chain(padded + others..all).for_each(|k| *lower.get_mut(k, k) = 1.0);
        Self { sizes: (first, others), lower }
    }

    /// Row and column of a variable.
    fn place(&self, variable: usize) -> usize {
        let first = self.sizes.0;
        if variable < first { variable } else { variable - first + first.next_multiple_of(BLOCK) }
    }

    fn places<const M: usize>(&self, at: &[usize; M]) -> [usize; M] {
        at.map(|variable| self.place(variable))
    }

    /// Adds a symmetric block at the variables `at`, all different.
    pub(super) fn add<const M: usize>(&mut self, at: &[usize; M], block: &SMatrix<f64, M, M>) {
        let at = self.places(at);
        for (column, b) in at.iter().enumerate() {
            for (row, a) in at.iter().enumerate().filter(|(_, a)| *a >= b) {
                *self.lower.get_mut(*a, *b) += block[(row, column)];
            }
        }
    }

    /// Adds another matrix, whose variables are `at` here.
    pub(super) fn add_all(&mut self, at: &[usize], other: &Self) {
        let at: Vec<usize> = at.iter().map(|variable| self.place(*variable)).collect();
        for (column, b) in at.iter().enumerate() {
            for (row, a) in at.iter().enumerate().skip(column) {
                let value = other.lower.get(other.place(row), other.place(column));
                if value != 0.0 {
                    *self.lower.get_mut(*a.max(b), *a.min(b)) += value;
                }
            }
        }
    }

    /// Subtracts `factor^T factor`, whose columns are the variables `at`.
    pub(super) fn subtract_square(&mut self, at: &[usize], factor: &Matrix3xX<f64>) {
        let at: Vec<usize> = at.iter().map(|variable| self.place(*variable)).collect();
        for (column, b) in at.iter().enumerate() {
            for (row, a) in at.iter().enumerate().filter(|(_, a)| *a >= b) {
                *self.lower.get_mut(*a, *b) -= factor.column(row).dot(&factor.column(column));
            }
        }
    }

    /// Adds the inverse square of `sigma` to the diagonal at a variable.
    pub(super) fn add_prior(&mut self, at: usize, sigma: f64) {
        let at = self.place(at);
        *self.lower.get_mut(at, at) += 1.0 / (sigma * sigma);
    }

    /// Marginalises the first variables. `None` if their information is singular.
    pub(super) fn marginalised(mut self) -> Option<Self> {
        let blocks = self.sizes.0.div_ceil(BLOCK);
        self.lower.eliminate(blocks)?;
        Some(Self { sizes: (0, self.sizes.1), lower: self.lower.without_first(blocks) })
    }

    /// `L^-1 across` with the Cholesky factor `L`: the inner products of its columns are covariances. `None` if the
    /// matrix is singular.
    pub(super) fn whitened(mut self, across: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        // Elimination replaces rows below a matrix by their products with `L^-T`.
        let blocks = (self.place(self.sizes.0 + self.sizes.1)).div_ceil(BLOCK);
        let below = |column: usize| BLOCK * blocks + column;
        (0..across.ncols().div_ceil(BLOCK)).for_each(|_| self.lower.append_row(blocks));
        for (column, of_column) in across.column_iter().enumerate() {
            for (row, value) in of_column.iter().enumerate().filter(|(_, value)| **value != 0.0) {
                let at = self.place(row);
                *self.lower.get_mut(below(column), at) = *value;
            }
        }
        self.lower.eliminate(blocks)?;
        let white = |row, column| self.lower.get(below(column), self.place(row));
        Some(DMatrix::from_fn(across.nrows(), across.ncols(), white))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The same information on `size` variables, of which `first` can be marginalised, by blocks and dense: a prior and
    /// residuals of three variables each.
    fn example(size: usize, first: usize, residuals: &[[usize; 3]]) -> (Information, DMatrix<f64>) {
        let mut information = Information::zeros(first, size - first);
        let mut dense = DMatrix::identity(size, size) * 4.0;
        (0..size).for_each(|at| information.add_prior(at, 0.5));
        for (k, at) in residuals.iter().enumerate() {
            let by = SMatrix::<f64, 2, 3>::from_fn(|row, column| ((k * k + 5 * row + 3 * column) as f64).sin());
            let block = by.tr_mul(&by);
            information.add(at, &block);
            at.iter().enumerate().for_each(|(column, b)| {
                at.iter().enumerate().for_each(|(row, a)| dense[(*a, *b)] += block[(row, column)]);
            });
        }
        (information, dense)
    }

    /// Sizes around multiples of a block, and residuals of near variables and a far one.
    fn examples() -> impl Strategy<Value = (usize, usize, Vec<[usize; 3]>)> {
        (5..200_usize).prop_flat_map(|size| {
            let residual = (0..size - 4, 0..size).prop_filter_map("distinct", move |(near, far)| {
                (!(near..near + 3).contains(&far)).then_some([near, near + 2, far])
            });
            (Just(size), 0..size, proptest::collection::vec(residual, 0..size))
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 30, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn covariances_are_those_of_the_dense_inverse((size, first, residuals) in examples()) {
            let (information, dense) = example(size, first, &residuals);
            let kept = size - first;
            let covariance = dense.try_inverse().unwrap().view((first, first), (kept, kept)).into_owned();
            let across = DMatrix::from_fn(kept, kept.min(70), |row, column| ((row * 3 + column) as f64).cos());
            let white = information.marginalised().unwrap().whitened(&across).unwrap();
            let expected = across.tr_mul(&covariance) * &across;
            prop_assert!((white.tr_mul(&white) - &expected).amax() < 1e-11 * expected.amax());
        }

        /// The sum of two matrices, one of them with its first variables marginalised.
        #[test]
        fn marginal_information_adds((size, first, residuals) in examples()) {
            let (information, dense) = example(size, first, &residuals);
            let (mut sum, kept) = (Information::zeros(3, size), size - first);
            let at: Vec<usize> = (0..kept).map(|k| 3 + (k * 7 + 2) % kept).collect();
            prop_assume!(kept % 7 != 0);
            sum.add_all(&at, &information.marginalised().unwrap());
            let marginal = dense.try_inverse().unwrap().view((first, first), (kept, kept)).into_owned().try_inverse().unwrap();
            let largest = marginal.amax();
            for (row, a) in at.iter().enumerate() {
                for (column, b) in at.iter().enumerate() {
                    let found = sum.lower.get(sum.place(*a.max(b)), sum.place(*a.min(b)));
                    prop_assert!((found - marginal[(row, column)]).abs() < 1e-10 * largest);
                }
            }
        }
    }

    #[test]
    fn a_square_is_subtracted() {
        let (mut information, dense) = example(90, 20, &[[3, 70, 80], [70, 71, 80]]);
        let factor = Matrix3xX::from_fn(2, |row, column| (row + 2 * column) as f64 * 0.3);
        information.subtract_square(&[70, 80], &factor);
        let found = information.lower.get(information.place(80), information.place(70));
        assert!((found - dense[(80, 70)] + factor.column(0).dot(&factor.column(1))).abs() < 1e-15);
    }

    #[test]
    fn singular_and_indefinite_information_is_refused() {
        let of = |first: usize, change: fn(&mut Information)| {
            let (mut information, _) = example(100, first, &[]);
            change(&mut information);
            information.marginalised()?.whitened(&DMatrix::identity(100 - first, 1)).map(|_| ())
        };
        assert_eq!(of(70, |_| ()), Some(()));
        for first in [0, 30, 70] {
            assert_eq!(of(first, |it| it.add(&[50], &SMatrix::<f64, 1, 1>::new(-4.0))), None, "singular");
            assert_eq!(of(first, |it| it.add(&[99], &SMatrix::<f64, 1, 1>::new(-4.1))), None, "indefinite");
            assert_eq!(of(first, |it| it.add(&[0, 60], &SMatrix::<f64, 2, 2>::repeat(f64::NAN))), None, "not finite");
        }
        assert!(Information::zeros(2, 3).marginalised().is_none());
    }
}
