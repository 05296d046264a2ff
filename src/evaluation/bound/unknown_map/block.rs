//! Blocks of 64 x 64 numbers, and the kernels of a Cholesky factorisation by blocks.
//!
//! A block is stored in strips of eight rows, and a strip by columns, so that the kernels read memory in order. All products are fused
//! multiply-adds in a fixed order, so the result does not depend on the processor. (A processor without this instruction, of before 2013,
//! computes the same numbers slowly.)

use pulp::{Arch, NullaryFnOnce};

/// Number of rows and columns of a block.
pub(super) const BLOCK: usize = 64;
/// Number of rows of a strip, and of rows and columns of a tile.
const TILE: usize = 8;
/// Number of strips of a block.
const STRIPS: usize = BLOCK / TILE;

/// Square matrix of eight columns, by columns.
type Tile = [[f64; TILE]; TILE];
/// Eight rows of a block, by columns.
type Strip = [[f64; TILE]; BLOCK];

/// Square matrix of 64 columns, strip by strip.
#[derive(Debug, Clone)]
pub(super) struct Block(Box<[Strip; STRIPS]>);

impl Block {
    /// Block of zeros.
    pub(super) fn zeros() -> Self {
        Self(Box::new([[[0.0; TILE]; BLOCK]; STRIPS]))
    }

    /// Returns an entry; `row` and `column` are below 64.
    pub(super) fn get(&self, row: usize, column: usize) -> f64 {
        self.0[row / TILE][column][row % TILE]
    }

    /// Returns an entry for writing; `row` and `column` are below 64.
    pub(super) fn get_mut(&mut self, row: usize, column: usize) -> &mut f64 {
        &mut self.0[row / TILE][column][row % TILE]
    }

    /// Replaces a symmetric matrix by its Cholesky factor `L`.
    ///
    /// Uses only the lower triangle; the numbers above the diagonal are arbitrary afterwards. `None` if the matrix is not positive
    /// definite.
    pub(super) fn factor(&mut self) -> Option<()> {
        Arch::new().dispatch(Factorisation(&mut self.0))
    }

    /// Replaces a matrix `X` by `X L^-T`, with the Cholesky factor `L`.
    pub(super) fn solve(&mut self, factor: &Self) {
        Arch::new().dispatch(Substitution { own: &mut self.0, factor: &factor.0 });
    }

    /// Subtracts `left right^T`.
    pub(super) fn subtract_product(&mut self, left: &Self, right: &Self) {
        Arch::new().dispatch(Product { own: &mut self.0, left: &left.0, right: &right.0 });
    }
}

// With a closure in place of these structs, `dispatch` calls code without vector instructions.

struct Factorisation<'a>(&'a mut [Strip; STRIPS]);

impl NullaryFnOnce for Factorisation<'_> {
    type Output = Option<()>;

    #[inline(always)]
    fn call(self) -> Option<()> {
        for at in 0..STRIPS {
            let (above, rest) = self.0.split_at_mut(at);
            substitute(&mut rest[0], above);
            let (before, own) = split(&mut rest[0], at);
            subtract_product(own, before, before);
            factor(own)?;
        }
        Some(())
    }
}

struct Substitution<'a> {
    own: &'a mut [Strip; STRIPS],
    factor: &'a [Strip; STRIPS],
}

impl NullaryFnOnce for Substitution<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for strip in self.own {
            substitute(strip, self.factor);
        }
    }
}

struct Product<'a> {
    own: &'a mut [Strip; STRIPS],
    left: &'a [Strip; STRIPS],
    right: &'a [Strip; STRIPS],
}

impl NullaryFnOnce for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for (own, left) in self.own.iter_mut().zip(self.left) {
            for (tile, right) in own.as_chunks_mut().0.iter_mut().zip(self.right) {
                subtract_product(tile, left, right);
            }
        }
    }
}

/// Replaces the first columns of a strip `X` by those of `X L^-T`, as many as `factor` has rows.
#[inline(always)]
fn substitute(strip: &mut Strip, factor: &[Strip]) {
    for (at, of_factor) in factor.iter().enumerate() {
        let (before, own) = split(strip, at);
        subtract_product(own, before, of_factor);
        let diagonal = &of_factor.as_chunks::<TILE>().0[at];
        for k in 0..TILE {
            own[k] = own[k].map(|x| x / diagonal[k][k]);
            eliminate(own, k, &diagonal[k]);
        }
    }
}

/// The columns before a tile of a strip, and the tile.
#[inline(always)]
fn split(strip: &mut Strip, tile: usize) -> (&[[f64; TILE]], &mut Tile) {
    let (before, rest) = strip.split_at_mut(TILE * tile);
    (before, &mut rest.as_chunks_mut().0[0])
}

/// Replaces a symmetric tile by its Cholesky factor; the numbers above the diagonal are arbitrary.
#[inline(always)]
fn factor(tile: &mut Tile) -> Option<()> {
    for k in 0..TILE {
        let pivot = tile[k][k];
        if !(pivot > 0.0 && pivot.is_finite()) {
            return None;
        }
        let root = pivot.sqrt();
        tile[k] = tile[k].map(|x| x / root);
        let column = tile[k];
        eliminate(tile, k, &column);
    }
    Some(())
}

/// Subtracts column `k`, times the entries of `factors`, from each later column.
#[inline(always)]
fn eliminate(tile: &mut Tile, k: usize, factors: &[f64; TILE]) {
    let by = tile[k];
    for column in k + 1..TILE {
        for row in 0..TILE {
            tile[column][row] = (-by[row]).mul_add(factors[column], tile[column][row]);
        }
    }
}

/// Number of columns whose sums are in registers at a time: eight vectors of four numbers.
const AT_ONCE: usize = 4;

/// Subtracts `left right^T` from a tile, over the columns that both have.
#[inline(always)]
fn subtract_product(tile: &mut Tile, left: &[[f64; TILE]], right: &[[f64; TILE]]) {
    for (half, columns) in tile.as_chunks_mut::<AT_ONCE>().0.iter_mut().enumerate() {
        let mut sums = [[0.0; TILE]; AT_ONCE];
        for (left, right) in left.iter().zip(right) {
            let right = &right.as_chunks::<AT_ONCE>().0[half];
            for (sums, right) in sums.iter_mut().zip(right) {
                for (sum, left) in sums.iter_mut().zip(left) {
                    *sum = left.mul_add(*right, *sum);
                }
            }
        }
        for (column, sums) in columns.iter_mut().zip(&sums) {
            column.iter_mut().zip(sums).for_each(|(entry, sum)| *entry -= sum);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    fn dense(shift: f64) -> DMatrix<f64> {
        DMatrix::from_fn(BLOCK, BLOCK, |row, column| ((row * row * 3 + column * 7 + row * column) as f64 + shift).sin())
    }

    fn block(dense: &DMatrix<f64>) -> Block {
        let mut block = Block::zeros();
        let entries = (0..BLOCK).flat_map(|row| (0..BLOCK).map(move |column| (row, column)));
        entries.for_each(|(row, column)| *block.get_mut(row, column) = dense[(row, column)]);
        block
    }

    fn difference(block: &Block, dense: &DMatrix<f64>) -> f64 {
        (DMatrix::from_fn(BLOCK, BLOCK, |row, column| block.get(row, column)) - dense).amax()
    }

    #[test]
    fn kernels_match_dense_algebra() {
        let (a, b) = (dense(0.0), dense(1.0));
        let square = &a * a.transpose() + DMatrix::identity(BLOCK, BLOCK);
        let expected = square.clone().cholesky().unwrap().l();
        let mut factor = block(&square);
        factor.factor().unwrap();
        let lower = DMatrix::from_fn(BLOCK, BLOCK, |r, c| if c <= r { factor.get(r, c) } else { 0.0 });
        assert!((lower - &expected).amax() < 1e-12);
        let mut solved = block(&b);
        solved.solve(&factor);
        assert!(difference(&solved, &(&b * expected.transpose().try_inverse().unwrap())) < 1e-12);
        let mut product = block(&a);
        product.subtract_product(&block(&a), &block(&b));
        assert!(difference(&product, &(&a - &a * b.transpose())) < 1e-12);
    }

    /// The results do not depend on the processor.
    #[test]
    fn bits_are_those_of_scalar_instructions() {
        let (a, b) = (block(&dense(0.0)), block(&dense(1.0)));
        let bits =
            |block: &Block| block.0.as_flattened().as_flattened().iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        let (mut vector, mut scalar) = (block(&(DMatrix::identity(BLOCK, BLOCK) * 99.0)), Block::zeros());
        scalar.0.clone_from(&vector.0);
        vector.subtract_product(&a, &b);
        Product { own: &mut scalar.0, left: &a.0, right: &b.0 }.call();
        assert_eq!(bits(&vector), bits(&scalar));
        assert_eq!((vector.factor(), Factorisation(&mut scalar.0).call()), (Some(()), Some(())));
        assert_eq!(bits(&vector), bits(&scalar));
        let factor = scalar.clone();
        let (mut vector, mut scalar) = (b.clone(), b);
        vector.solve(&factor);
        Substitution { own: &mut scalar.0, factor: &factor.0 }.call();
        assert_eq!(bits(&vector), bits(&scalar));
    }

    #[test]
    fn matrices_that_are_not_positive_definite_have_no_factor() {
        for (at, value) in [(0, 0.0), (17, -1e-3), (63, 0.0), (40, f64::NAN), (9, f64::INFINITY)] {
            let mut identity = DMatrix::identity(BLOCK, BLOCK);
            identity[(at, at)] = value;
            assert_eq!(block(&identity).factor(), None, "{value}");
        }
    }
}
