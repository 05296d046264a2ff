//! Sets of finest cells: a bit each, in cubes of eight to an edge, of which next to all that a beam goes through are
//! near the last.

use super::cell::number;
use std::collections::BTreeMap;

/// Level of the cells that cubes are.
const LEVEL: u32 = 3;

/// A set of finest cells, by their coordinates.
#[derive(Debug, Default)]
pub(super) struct Cells {
    cubes: BTreeMap<u64, Cube>,
}

/// Those of its cells that a cube has.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Cube([u64; 8]);

/// The number of the cube that the finest cell of a number is in.
pub(super) fn cube_of(cell: u64) -> u64 {
    cell >> (3 * LEVEL)
}

impl Cells {
    /// What of a cube is in the set.
    pub(super) fn cube(&self, number: u64) -> Cube {
        self.cubes.get(&number).copied().unwrap_or_default()
    }

    /// Those of `self` that are not of `other`.
    pub(super) fn without(mut self, other: &Self) -> Self {
        for (number, cube) in &mut self.cubes {
            if let Some(others) = other.cubes.get(number) {
                cube.0.iter_mut().zip(&others.0).for_each(|(word, other)| *word &= !other);
            }
        }
        self
    }

    fn add(&mut self, at: [i64; 3], more: &Cube) {
        let cube = self.cubes.entry(number(at, LEVEL)).or_default();
        cube.0.iter_mut().zip(&more.0).for_each(|(word, more)| *word |= more);
    }
}

impl Cube {
    /// Whether it has a cell, of those that are in it.
    pub(super) fn has(&self, cell: [i64; 3]) -> bool {
        let (word, bit) = place(cell);
        self.0[word] & bit != 0
    }
}

impl Extend<[i64; 3]> for Cells {
    fn extend<I: IntoIterator<Item = [i64; 3]>>(&mut self, cells: I) {
        let mut last = ([0; 3], Cube::default());
        for cell in cells {
            let at = cell.map(|x| x >> LEVEL);
            if at != last.0 {
                self.add(last.0, &last.1);
                last = (at, Cube::default());
            }
            let (word, bit) = place(cell);
            last.1.0[word] |= bit;
        }
        self.add(last.0, &last.1);
    }
}

/// A cell's word and bit in its cube.
fn place([x, y, z]: [i64; 3]) -> (usize, u64) {
    ((x & 7) as usize, 1 << ((y & 7) << 3 | (z & 7)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn a_set_has_what_was_put_in_and_not_what_was_taken_out() {
        let cell = |k: i64| [k * 7 % 31 - 15, k * 5 % 23 - 11, k * 3 % 41 - 20];
        let (put, taken): (Vec<_>, Vec<_>) = ((0..500).map(cell).collect(), (300..900).step_by(3).map(cell).collect());
        let set = |of: &[[i64; 3]]| {
            let mut cells = Cells::default();
            cells.extend(of.iter().copied());
            cells
        };
        let left = set(&put).without(&set(&taken));
        let expected: BTreeSet<_> = put.iter().filter(|cell| !taken.contains(cell)).copied().collect();
        assert!(!expected.is_empty() && expected.len() < put.len());
        for k in 0..31 * 23 * 41 {
            let cell = [k % 31 - 15, k / 31 % 23 - 11, k / (31 * 23) - 20];
            let cube = left.cube(cube_of(number(cell, 0)));
            assert_eq!(cube.has(cell), expected.contains(&cell), "{cell:?}");
        }
    }
}
