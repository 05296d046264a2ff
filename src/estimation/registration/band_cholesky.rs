//! Cholesky factor of a symmetric matrix of 6 x 6 blocks near its diagonal.

use nalgebra::{Matrix6, Vector6};

/// The factor `L` of `H = L L^T`, by rows.
///
/// A row has the blocks from the first non-zero one to the diagonal. The factorisation causes no other non-zero blocks (George and Liu 1981), so its cost is linear in the length of a band.
#[derive(Debug, Clone, Default)]
pub(super) struct BandCholesky {
    rows: Vec<Row>,
}

/// The blocks of a row of `L`.
#[derive(Debug, Clone)]
struct Row {
    /// Column of the first block.
    first: usize,
    /// Blocks before the diagonal.
    before: Vec<Matrix6<f64>>,
    /// Inverse of the block on the diagonal.
    inverse: Matrix6<f64>,
}

impl BandCholesky {
    /// Factors the matrix with these rows of its lower triangle.
    ///
    /// A row has sorted columns up to the diagonal, and their blocks. `None` if the matrix is not positive definite.
    pub(super) fn new<'a>(rows: impl Iterator<Item = (&'a [u32], &'a [Matrix6<f64>])>) -> Option<Self> {
        let mut factor = Self::default();
        for (columns, blocks) in rows {
            factor.append(columns, blocks)?;
        }
        Some(factor)
    }

    fn append(&mut self, columns: &[u32], blocks: &[Matrix6<f64>]) -> Option<()> {
        let (first, (diagonal, others)) = (*columns.first()? as usize, blocks.split_last()?);
        let (mut diagonal, mut row) = (*diagonal, vec![Matrix6::zeros(); self.rows.len() - first]);
        columns.iter().zip(others).for_each(|(column, block)| row[*column as usize - first] = *block);
        for (k, other) in self.rows[first..].iter().enumerate() {
            let common = first.max(other.first);
            let (before, rest) = row.split_at_mut(k);
            for (own, other) in before[common - first..].iter().zip(&other.before[common - other.first..]) {
                rest[0] -= own * other.transpose();
            }
            rest[0] *= other.inverse.transpose();
            diagonal -= rest[0] * rest[0].transpose();
        }
        let mut inverse = Matrix6::identity();
        diagonal.cholesky()?.l_dirty().solve_lower_triangular_mut(&mut inverse).then_some(())?;
        self.rows.push(Row { first, before: row, inverse });
        Some(())
    }

    /// Replaces `x`, six numbers a row, by `H^-1 x`.
    pub(super) fn solve_in_place(&self, x: &mut [f64]) {
        let x = x.as_chunks_mut::<6>().0;
        for (at, row) in self.rows.iter().enumerate() {
            let (before, own) = x[row.first..=at].split_at_mut(at - row.first);
            let mut sum = Vector6::from(own[0]);
            row.before.iter().zip(before).for_each(|(block, x)| sum -= block * Vector6::from(*x));
            own[0] = (row.inverse * sum).into();
        }
        for (at, row) in self.rows.iter().enumerate().rev() {
            let (before, own) = x[row.first..=at].split_at_mut(at - row.first);
            let solved = row.inverse.tr_mul(&Vector6::from(own[0]));
            for (block, x) in row.before.iter().zip(before) {
                *x = (Vector6::from(*x) - block.tr_mul(&solved)).into();
            }
            own[0] = solved.into();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::block_matrix::BlockMatrix;
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    /// The same matrix by blocks and dense, `sum J^T J + damping I` with a Jacobian of six rows for each pair of `pairs`.
    fn matrices(size: usize, pairs: &[(usize, usize, u64)], damping: f64) -> (BlockMatrix, DMatrix<f64>) {
        let mut columns: Vec<Vec<u32>> = (0..size).map(|row| vec![row as u32]).collect();
        pairs.iter().for_each(|(a, b, _)| columns[*a.max(b)].push(*a.min(b) as u32));
        let mut sparse = BlockMatrix::new(columns);
        let mut dense = DMatrix::identity(6 * size, 6 * size) * damping;
        sparse.add_diagonal(damping);
        for (a, b, seed) in pairs {
            let wave = |shift: f64| Matrix6::from_fn(|r, c| ((r * 7 + c * c) as f64 + shift + *seed as f64).sin());
            let (by_a, by_b) = (wave(0.0), if a == b { Matrix6::zeros() } else { wave(2.5) });
            let mut jacobian = DMatrix::<f64>::zeros(6, 6 * size);
            let mut add = |at: usize, by: &Matrix6<f64>| {
                let mut view = jacobian.fixed_view_mut::<6, 6>(0, 6 * at);
                view += by;
            };
            add(*a, &by_a);
            add(*b, &by_b);
            dense += jacobian.transpose() * jacobian;
            sparse.add(*a, *a, &(by_a.tr_mul(&by_a) * 0.5));
            sparse.add(*b, *b, &(by_b.tr_mul(&by_b) * 0.5));
            if a != b {
                sparse.add(*a, *b, &by_a.tr_mul(&by_b));
            }
        }
        (sparse, dense)
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

        /// Pairs of near and far blocks, in any pattern, against LU with pivoting of the dense matrix.
        #[test]
        fn solutions_are_those_of_the_dense_matrix(
            near in proptest::collection::vec((0..12_usize, 0..5_usize, 0..99_u64), 0..30),
            far in proptest::collection::vec((0..12_usize, 0..12_usize, 0..99_u64), 0..3),
        ) {
            let near = near.into_iter().map(|(a, apart, seed)| (a, (a + apart).min(11), seed));
            let (sparse, dense) = matrices(12, &near.chain(far).collect::<Vec<_>>(), 0.3);
            let right = DVector::from_fn(72, |k, _| (k as f64 * 1.7).cos());
            let mut x = right.clone();
            sparse.factor().unwrap().solve_in_place(x.as_mut_slice());
            let expected = dense.clone().lu().solve(&right).unwrap();
            prop_assert!((&x - &expected).norm() < 1e-11 * expected.norm());
            prop_assert!((dense * x - &right).norm() < 1e-11 * right.norm());
        }
    }

    #[test]
    fn a_loop_over_the_whole_length_is_solved() {
        let pairs: Vec<_> = (0..40).map(|k| (k, (k + 1) % 40, k as u64)).collect();
        let (sparse, dense) = matrices(40, &pairs, 1e-3);
        let right = DVector::from_element(240, 1.0);
        let mut x = right.clone();
        sparse.factor().unwrap().solve_in_place(x.as_mut_slice());
        assert!((dense * x - &right).norm() < 1e-10 * right.norm());
    }

    #[test]
    fn singular_indefinite_and_non_finite_matrices_have_no_factor() {
        let pairs = [(0, 1, 3), (1, 2, 5)];
        assert!(matrices(3, &pairs, 0.1).0.factor().is_some());
        for damping in [-1e-3, -5.0, f64::NAN] {
            assert!(matrices(3, &pairs, damping).0.factor().is_none(), "{damping}");
        }
        assert!(matrices(3, &pairs[..1], 0.0).0.factor().is_none());
    }
}
