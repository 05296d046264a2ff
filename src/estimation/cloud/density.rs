//! Number of points in the neighbourhood of a point.

use super::ProjectedReturn;
use super::cell::{EDGE_M, coordinates, morton_code};
use zsim_base::geometry::Vector;

/// Range up to which the finest cells are used, m; each doubling uses the next level, as beams diverge with range.
const FINEST_RANGE_M: f64 = 5.0;
/// Level of the coarsest cells (edge 0.8 m).
const COARSEST_LEVEL: u32 = 3;
/// Minimum number of points in the neighbourhood, including the point itself.
const MIN_POINTS: u32 = 4;

/// Number of cells that are compared one by one in a search.
const NEXT_CELLS: usize = 12;

/// Level of the cells for a point at this range.
fn level_at(range_m: f64) -> u32 {
    let doublings = (1..=COARSEST_LEVEL).filter(|level| range_m > FINEST_RANGE_M * f64::from(1_u32 << (level - 1)));
    doublings.count() as u32
}

/// Number of points of a block in each finest cell.
#[derive(Debug)]
pub(super) struct BlockCounts {
    /// Morton codes and counts, sorted.
    cells: Vec<(u64, u32)>,
}

impl BlockCounts {
    pub(super) fn from_returns(hits: &[ProjectedReturn]) -> Self {
        let mut codes: Vec<u64> = hits.iter().map(|hit| morton_code(coordinates(&hit.point_in_map, 0), 0)).collect();
        codes.sort_unstable();
        codes.chunk_by(|a, b| a == b).map(|cell| (cell[0], cell.len() as u32)).collect()
    }

    /// Morton code and number of points of each cell, sorted.
    pub(super) fn cells(&self) -> impl Iterator<Item = (u64, u32)> {
        self.cells.iter().copied()
    }
}

impl FromIterator<(u64, u32)> for BlockCounts {
    /// Takes sorted cells.
    fn from_iter<I: IntoIterator<Item = (u64, u32)>>(cells: I) -> Self {
        Self { cells: cells.into_iter().collect() }
    }
}

/// Number of points of several blocks, for range queries on Morton codes.
#[derive(Debug)]
pub(super) struct Density {
    codes: Vec<u64>,
    /// Cumulative number of points before each cell, then the total.
    cumulative: Vec<u32>,
}

impl Density {
    pub(super) fn from_blocks<'a>(blocks: impl Iterator<Item = &'a BlockCounts>) -> Self {
        let mut cells: Vec<(u64, u32)> = blocks.flat_map(|block| &block.cells).copied().collect();
        // The blocks are sorted: a stable sort merges them.
        cells.sort();
        let mut cumulative = Vec::with_capacity(cells.len() + 1);
        let mut sum = 0;
        for (_, count) in &cells {
            cumulative.push(sum);
            sum += count;
        }
        cumulative.push(sum);
        Self { codes: cells.into_iter().map(|(code, _)| code).collect(), cumulative }
    }

    /// Number of points in the cell of `level` that contains `point`.
    fn count(&self, point: &Vector, level: u32) -> u32 {
        self.count_in(morton_code(coordinates(point, level), level), level)
    }

    /// Number of points in the cell of `level` with this Morton code.
    fn count_in(&self, code: u64, level: u32) -> u32 {
        let (first, last) = (code << (3 * level), (code + 1) << (3 * level));
        let from = self.codes.partition_point(|n| *n < first);
        // A cell contains few finest cells: look at the next ones before the others.
        let next = &self.codes[from..(from + NEXT_CELLS).min(self.codes.len())];
        let within = next.iter().take_while(|n| **n < last).count();
        let until = match within {
            NEXT_CELLS => from + self.codes[from..].partition_point(|n| *n < last),
            _ => from + within,
        };
        self.cumulative[until] - self.cumulative[from]
    }

    /// Number of points in the eight cells of `level` nearest to `point`.
    pub(super) fn count_around(&self, point: &Vector, level: u32) -> u32 {
        let half_m = 0.5 * EDGE_M * f64::from(1_u32 << level);
        let corners = (0..8_u32).map(|corner| {
            let side = |bit: u32| if corner >> bit & 1 == 0 { -half_m } else { half_m };
            point + Vector::new(side(0), side(1), side(2))
        });
        corners.map(|corner| self.count(&corner, level)).sum()
    }
}

/// Finds points with too few neighbours, one after the other: successive points are mostly in the same cell.
#[derive(Debug)]
pub(super) struct IsolationTest<'a> {
    /// Density of the block of the points, and of all blocks around it.
    of_block: &'a Density,
    around: &'a Density,
    /// The last cell, by level and Morton code, and whether the points in it suffice.
    last: Option<((u32, u64), bool)>,
}

impl<'a> IsolationTest<'a> {
    pub(super) fn new(of_block: &'a Density, around: &'a Density) -> Self {
        Self { of_block, around, last: None }
    }

    /// Whether a point has enough neighbours in the eight nearest cells of the level that fits its range.
    pub(super) fn is_sufficient_at(&mut self, hit: &ProjectedReturn) -> bool {
        let level = level_at(hit.range_m());
        let cell = (level, morton_code(coordinates(&hit.point_in_map, level), level));
        let is_dense = match self.last {
            Some((last, is_dense)) if last == cell => is_dense,
            // The points of its block in its own cell suffice for most points, and are counted fastest.
            _ => [self.of_block, self.around].iter().any(|density| density.count_in(cell.1, level) >= MIN_POINTS),
        };
        self.last = Some((cell, is_dense));
        is_dense || self.around.count_around(&hit.point_in_map, level) >= MIN_POINTS
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::time::Stamp;

    fn hit(point_in_map: Vector, range_m: f64) -> ProjectedReturn {
        ProjectedReturn { stamp: Stamp::default(), point_in_map, origin_in_map: point_in_map - Vector::x() * range_m }
    }

    #[test]
    fn isolated_points_are_found_independently_of_the_cell_boundaries() {
        for k in 0..100 {
            let at = Vector::new((k as f64 * 0.7).sin() * 20.0, (k as f64 * 0.9).cos() * 20.0, k as f64 * 0.1);
            let aside = |by_m: f64| hit(at + Vector::new(0.0, 0.6, 0.8) * by_m, 3.0);
            let sufficient = |hits: &[ProjectedReturn]| {
                let density = Density::from_blocks([BlockCounts::from_returns(hits)].iter());
                IsolationTest::new(&density, &density).is_sufficient_at(&hits[0])
            };
            assert!(!sufficient(&[aside(0.0)]));
            assert!(!sufficient(&[aside(0.0), aside(0.01), aside(0.02)]));
            assert!(sufficient(&[aside(0.0), aside(0.015), aside(0.03), aside(-0.03)]), "{at}");
            assert!(!sufficient(&[aside(0.0), aside(0.3), aside(-0.3), aside(0.35)]), "{at}");
        }
    }

    #[test]
    fn neighbourhood_grows_with_range_and_blocks_add_up() {
        let at = Vector::new(7.0, 8.0, 9.0);
        let far = |by_m: f64| hit(at + Vector::z() * by_m, 18.0);
        let blocks = [0.0, 0.12, -0.12, 0.15].map(|by_m| BlockCounts::from_returns(&[far(by_m)]));
        let of_block = Density::from_blocks(blocks[..1].iter());
        let sufficient = |blocks: &[BlockCounts], at: ProjectedReturn| {
            IsolationTest::new(&of_block, &Density::from_blocks(blocks.iter())).is_sufficient_at(&at)
        };
        assert!(sufficient(&blocks, far(0.0)));
        assert!(!sufficient(&blocks[..3], far(0.0)));
        assert!(!sufficient(&blocks, hit(at, 2.0)), "at short range the neighbourhood is smaller");
    }
}
