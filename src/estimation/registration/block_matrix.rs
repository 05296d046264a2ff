//! Sparse symmetric matrix of 6 x 6 blocks.

use super::band_cholesky::BandCholesky;
use nalgebra::{Matrix6, Vector6};

/// Sparse symmetric matrix of 6 x 6 blocks; stores the lower triangle by rows.
#[derive(Debug, Clone)]
pub(super) struct BlockMatrix {
    /// Sorted columns of the non-zero blocks of each row.
    columns: Vec<Vec<u32>>,
    /// The blocks at these columns.
    blocks: Vec<Vec<Matrix6<f64>>>,
}

impl BlockMatrix {
    /// Zero matrix with the given pattern: the columns of each row up to the diagonal; unsorted, duplicates allowed.
    pub(super) fn new(mut columns: Vec<Vec<u32>>) -> Self {
        for row in &mut columns {
            row.sort_unstable();
            row.dedup();
        }
        let blocks = columns.iter().map(|row| vec![Matrix6::zeros(); row.len()]).collect();
        Self { columns, blocks }
    }

    /// Sets all blocks to zero.
    pub(super) fn clear(&mut self) {
        self.blocks.iter_mut().flatten().for_each(|block| block.fill(0.0));
    }

    /// Adds `block` at (`row`, `column`) and its transpose at (`column`, `row`); on the diagonal it adds both.
    ///
    /// A block outside of the pattern is ignored.
    pub(super) fn add(&mut self, row: usize, column: usize, block: &Matrix6<f64>) {
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

    /// Adds `value` to every diagonal entry.
    pub(super) fn add_diagonal(&mut self, value: f64) {
        for (row, blocks) in self.blocks.iter_mut().enumerate() {
            if let Ok(at) = self.columns[row].binary_search(&(row as u32)) {
                blocks[at] += Matrix6::identity() * value;
            }
        }
    }

    /// The blocks of the lower triangle: row, column, block.
    pub(super) fn iter(&self) -> impl Iterator<Item = (usize, usize, &Matrix6<f64>)> {
        let rows = self.columns.iter().zip(&self.blocks).enumerate();
        rows.flat_map(|(row, (columns, blocks))| columns.iter().zip(blocks).map(move |(k, b)| (row, *k as usize, b)))
    }

    /// Adds the product with `x` to `sum`.
    pub(super) fn add_product(&self, x: &[f64], sum: &mut [f64]) {
        let at = |knot: usize| Vector6::from_column_slice(&x[6 * knot..6 * knot + 6]);
        for (row, (columns, blocks)) in self.columns.iter().zip(&self.blocks).enumerate() {
            let own = at(row);
            let mut product = Vector6::zeros();
            for (column, block) in columns.iter().map(|k| *k as usize).zip(blocks) {
                product += block * at(column);
                if column != row {
                    add_to(&mut sum[6 * column..6 * column + 6], &block.tr_mul(&own));
                }
            }
            add_to(&mut sum[6 * row..6 * row + 6], &product);
        }
    }

    /// Cholesky factor, for blocks near the diagonal; `None` if the matrix is not positive definite.
    ///
    /// Every diagonal block is in the pattern.
    pub(super) fn factor(&self) -> Option<BandCholesky> {
        let rows = self.columns.iter().zip(&self.blocks);
        BandCholesky::new(rows.map(|(columns, blocks)| (columns.as_slice(), blocks.as_slice())))
    }
}

fn add_to(sum: &mut [f64], terms: &Vector6<f64>) {
    sum.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
}
