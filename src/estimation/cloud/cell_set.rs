//! Sets of finest cells as bitmaps of 8 x 8 x 8 cells: successive cells along a beam are mostly in the same bitmap.

use super::cell::morton_code;
use ahash::AHasher;
use indexmap::IndexMap;
use std::hash::BuildHasherDefault;

/// Level of the cells that are stored as one bitmap (8 finest cells per edge).
const LEVEL: u32 = 3;

/// A set of finest cells.
#[derive(Debug, Default)]
pub(super) struct CellSet {
    /// By Morton code, in the order of their first cells: the order does not depend on the hash.
    cubes: IndexMap<u64, Cube, BuildHasherDefault<AHasher>>,
}

/// Bitmap of the finest cells in one cube.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Cube([u64; 8]);

/// Morton code of the cube that contains a finest cell.
pub(super) fn cube_of(cell: u64) -> u64 {
    cell >> (3 * LEVEL)
}

impl CellSet {
    /// Bitmap of the cube with the given Morton code.
    pub(super) fn cube(&self, morton_code: u64) -> Cube {
        self.cubes.get(&morton_code).copied().unwrap_or_default()
    }

    /// Set difference of `self` and `other`.
    pub(super) fn difference(mut self, other: &Self) -> Self {
        for (morton_code, cube) in &mut self.cubes {
            if let Some(others) = other.cubes.get(morton_code) {
                cube.0.iter_mut().zip(&others.0).for_each(|(word, other)| *word &= !other);
            }
        }
        self
    }

    fn add(&mut self, at: [i64; 3], more: &Cube) {
        let cube = self.cubes.entry(morton_code(at, LEVEL)).or_default();
        cube.0.iter_mut().zip(&more.0).for_each(|(word, more)| *word |= more);
    }
}

impl Cube {
    /// Whether the bitmap contains a cell, which must be inside the cube.
    pub(super) fn contains(&self, cell: [i64; 3]) -> bool {
        let (word, bit) = bit_position(cell);
        self.0[word] & bit != 0
    }
}

impl Extend<[i64; 3]> for CellSet {
    fn extend<I: IntoIterator<Item = [i64; 3]>>(&mut self, cells: I) {
        let mut last = ([0; 3], Cube::default());
        for cell in cells {
            let at = cell.map(|x| x >> LEVEL);
            if at != last.0 {
                self.add(last.0, &last.1);
                last = (at, Cube::default());
            }
            let (word, bit) = bit_position(cell);
            last.1.0[word] |= bit;
        }
        self.add(last.0, &last.1);
    }
}

/// Word and bit of a cell in its cube.
fn bit_position([x, y, z]: [i64; 3]) -> (usize, u64) {
    ((x & 7) as usize, 1 << ((y & 7) << 3 | (z & 7)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn set_contains_the_added_cells_without_the_removed_ones() {
        let cell = |k: i64| [k * 7 % 31 - 15, k * 5 % 23 - 11, k * 3 % 41 - 20];
        let (added, removed): (Vec<_>, Vec<_>) =
            ((0..500).map(cell).collect(), (300..900).step_by(3).map(cell).collect());
        let set = |of: &[[i64; 3]]| {
            let mut cells = CellSet::default();
            cells.extend(of.iter().copied());
            cells
        };
        let remaining = set(&added).difference(&set(&removed));
        let expected: BTreeSet<_> = added.iter().filter(|cell| !removed.contains(cell)).copied().collect();
        assert!(!expected.is_empty() && expected.len() < added.len());
        for k in 0..31 * 23 * 41 {
            let cell = [k % 31 - 15, k / 31 % 23 - 11, k / (31 * 23) - 20];
            let cube = remaining.cube(cube_of(morton_code(cell, 0)));
            assert_eq!(cube.contains(cell), expected.contains(&cell), "{cell:?}");
        }
    }
}
