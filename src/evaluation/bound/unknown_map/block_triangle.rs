//! Lower triangle of a symmetric matrix by blocks, and the elimination of its first variables.
//!
//! Elimination is a Cholesky factorisation that ends early: it leaves the Schur complement of the eliminated variables. Blocks of zeros are
//! neither stored nor multiplied, so a matrix that is sparse in this order of its variables costs less (George and Liu 1981).

use super::block::{BLOCK, Block};
use rayon::prelude::*;

/// Number of rows of a task; they share the blocks of `right` in the cache.
const ROWS: usize = 4;

/// Rows of blocks, from the first column on; `None` is a block of zeros.
///
/// Row `i` of a triangle has the blocks `0..=i`; later rows may have fewer blocks than that.
#[derive(Debug, Clone, Default)]
pub(super) struct BlockTriangle {
    rows: Vec<Vec<Option<Block>>>,
}

impl BlockTriangle {
    /// Triangle of zeros, with `blocks` blocks on the diagonal.
    pub(super) fn zeros(blocks: usize) -> Self {
        Self { rows: (1..=blocks).map(|blocks| vec![None; blocks]).collect() }
    }

    /// Appends a row of zeros with `blocks` blocks.
    pub(super) fn append_row(&mut self, blocks: usize) {
        self.rows.push(vec![None; blocks]);
    }

    /// Returns an entry; `row >= column`.
    pub(super) fn get(&self, row: usize, column: usize) -> f64 {
        let block = self.rows[row / BLOCK][column / BLOCK].as_ref();
        block.map_or(0.0, |block| block.get(row % BLOCK, column % BLOCK))
    }

    /// Returns an entry for writing; `row >= column`.
    pub(super) fn get_mut(&mut self, row: usize, column: usize) -> &mut f64 {
        let block = self.rows[row / BLOCK][column / BLOCK].get_or_insert_with(Block::zeros);
        block.get_mut(row % BLOCK, column % BLOCK)
    }

    /// Eliminates the variables of the first `blocks` blocks.
    ///
    /// Replaces their columns by those of the Cholesky factor `L`, and the others by the Schur complement. One number of threads gives
    /// the same bits as another, because each block is the work of one thread and the columns are eliminated in order.
    ///
    /// `None` if the matrix of the eliminated variables is not positive definite.
    pub(super) fn eliminate(&mut self, blocks: usize) -> Option<()> {
        for k in 0..blocks {
            let (row, later) = self.rows[k..].split_first_mut()?;
            let diagonal = row[k].as_mut()?;
            diagonal.factor()?;
            let mut column: Vec<Option<Block>> = later.iter_mut().map(|row| row[k].take()).collect();
            column.par_iter_mut().flatten().for_each(|block| block.solve(diagonal));
            later
                .par_chunks_mut(ROWS)
                .zip(column.par_chunks(ROWS))
                .for_each(|(rows, left)| subtract_products(rows, left, &column, k + 1));
            later.iter_mut().zip(column).for_each(|(row, block)| row[k] = block);
        }
        Some(())
    }

    /// Removes the first `blocks` rows and columns.
    pub(super) fn without_first(self, blocks: usize) -> Self {
        let rest = |mut row: Vec<Option<Block>>| row.split_off(blocks);
        Self { rows: self.rows.into_iter().skip(blocks).map(rest).collect() }
    }
}

/// Subtracts the products of `left` and the transposed `right` from some rows.
///
/// Each block of `left` belongs to a row, and each of `right` to a column, from column `first` on.
fn subtract_products(rows: &mut [Vec<Option<Block>>], left: &[Option<Block>], right: &[Option<Block>], first: usize) {
    for (column, right) in right.iter().enumerate().filter_map(|(at, right)| Some((first + at, right.as_ref()?))) {
        for (row, left) in rows.iter_mut().zip(left).filter_map(|(row, left)| Some((row, left.as_ref()?))) {
            if let Some(block) = row.get_mut(column) {
                block.get_or_insert_with(Block::zeros).subtract_product(left, right);
            }
        }
    }
}
