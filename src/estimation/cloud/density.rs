//! How many points are about a point.

use super::Hit;
use super::cell::{EDGE_M, coordinates, number};
use crate::geometry::Vector;

/// Up to this range the finest cells count, m; up to twice it the next, and so on: beams part as they go.
const FINEST_TO_M: f64 = 5.0;
/// Coarsest cells.
const COARSEST: u32 = 3;
/// Fewest points of a cell, the point itself among them.
const FEWEST: u32 = 4;

/// Points of a block by finest cells.
#[derive(Debug)]
pub(super) struct Crowd {
    /// Cells and their points, in order.
    cells: Vec<(u64, u32)>,
}

impl Crowd {
    pub(super) fn of(hits: &[Hit]) -> Self {
        let mut numbers: Vec<u64> = hits.iter().map(|hit| number(coordinates(&hit.point_in_map, 0), 0)).collect();
        numbers.sort_unstable();
        numbers.chunk_by(|a, b| a == b).map(|cell| (cell[0], cell.len() as u32)).collect()
    }

    /// Cells by their numbers, in order, and how many points each has.
    pub(super) fn cells(&self) -> impl Iterator<Item = (u64, u32)> {
        self.cells.iter().copied()
    }
}

impl FromIterator<(u64, u32)> for Crowd {
    /// Of cells in order.
    fn from_iter<I: IntoIterator<Item = (u64, u32)>>(cells: I) -> Self {
        Self { cells: cells.into_iter().collect() }
    }
}

/// Points of several blocks.
#[derive(Debug)]
pub(super) struct Support {
    numbers: Vec<u64>,
    /// Points before each cell, and of all.
    before: Vec<u32>,
}

impl Support {
    pub(super) fn of<'a>(crowds: impl Iterator<Item = &'a Crowd>) -> Self {
        let mut cells: Vec<(u64, u32)> = crowds.flat_map(|crowd| &crowd.cells).copied().collect();
        cells.sort_unstable();
        let mut before = Vec::with_capacity(cells.len() + 1);
        let mut sum = 0;
        for (_, count) in &cells {
            before.push(sum);
            sum += count;
        }
        before.push(sum);
        Self { numbers: cells.into_iter().map(|(number, _)| number).collect(), before }
    }

    /// Whether a point has others about it, in the eight cells of its range's level that are nearest to it.
    pub(super) fn holds(&self, hit: &Hit) -> bool {
        let level = (hit.range_m() / FINEST_TO_M).log2().ceil().clamp(0.0, f64::from(COARSEST)) as u32;
        // Most have enough in their own cell.
        self.count(&hit.point_in_map, level) >= FEWEST || self.count_about(&hit.point_in_map, level) >= FEWEST
    }

    /// Points in the cell of `level` that a point is in.
    fn count(&self, point: &Vector, level: u32) -> u32 {
        let number = number(coordinates(point, level), level);
        let (first, last) = (number << (3 * level), (number + 1) << (3 * level));
        let from = self.numbers.partition_point(|n| *n < first);
        let until = from + self.numbers[from..].partition_point(|n| *n < last);
        self.before[until] - self.before[from]
    }

    /// Points in the eight cells of `level` nearest to a point.
    pub(super) fn count_about(&self, point: &Vector, level: u32) -> u32 {
        let half_m = 0.5 * EDGE_M * f64::from(1_u32 << level);
        let corners = (0..8_u32).map(|corner| {
            let side = |bit: u32| if corner >> bit & 1 == 0 { -half_m } else { half_m };
            point + Vector::new(side(0), side(1), side(2))
        });
        corners.map(|corner| self.count(&corner, level)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Stamp;

    fn hit(point_in_map: Vector, range_m: f64) -> Hit {
        Hit { stamp: Stamp::default(), point_in_map, origin_in_map: point_in_map - Vector::x() * range_m }
    }

    #[test]
    fn a_point_alone_has_no_support_and_one_of_four_has_wherever_cells_begin() {
        for k in 0..100 {
            let at = Vector::new((k as f64 * 0.7).sin() * 20.0, (k as f64 * 0.9).cos() * 20.0, k as f64 * 0.1);
            let aside = |by_m: f64| hit(at + Vector::new(0.0, 0.6, 0.8) * by_m, 3.0);
            let holds = |hits: &[Hit]| Support::of([Crowd::of(hits)].iter()).holds(&hits[0]);
            assert!(!holds(&[aside(0.0)]));
            assert!(!holds(&[aside(0.0), aside(0.01), aside(0.02)]));
            assert!(holds(&[aside(0.0), aside(0.015), aside(0.03), aside(-0.03)]), "{at}");
            assert!(!holds(&[aside(0.0), aside(0.3), aside(-0.3), aside(0.35)]), "{at}");
        }
    }

    #[test]
    fn far_points_may_be_farther_from_each_other_and_blocks_add_up() {
        let at = Vector::new(7.0, 8.0, 9.0);
        let far = |by_m: f64| hit(at + Vector::z() * by_m, 18.0);
        let crowds = [0.0, 0.12, -0.12, 0.15].map(|by_m| Crowd::of(&[far(by_m)]));
        assert!(Support::of(crowds.iter()).holds(&far(0.0)));
        assert!(!Support::of(crowds[..3].iter()).holds(&far(0.0)));
        assert!(!Support::of(crowds.iter()).holds(&hit(at, 2.0)), "seen from near they would be closer");
    }
}
