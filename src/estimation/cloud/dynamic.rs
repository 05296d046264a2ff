//! Detection of dynamic objects: cells that are occupied at one time and free at others.
//!
//! Uses occupancy grids (Moravec and Elfes 1985), one per block of 1 s. Cells are small and few beams cross each of them, so
//! a point is classified by the cells around it together.

use super::ProjectedReturn;
use super::cell::{EDGE_M, coordinates, coordinates_of, morton_code};
use super::cell_set::{CellSet, Cube, cube_of};
use super::density::{BlockCounts, Density};
use rayon::prelude::*;
use zsim_base::geometry::Vector;

/// Only every fourth beam is traced, to save time; neighbouring beams cross the same cells.
const STRIDE: usize = 4;
/// A beam is traced up to this fraction of its range, and up to this distance before the hit, m: the cells behind
/// that limit belong to the surface that it hits.
const TRACE_LIMIT: (f64, f64) = (0.9, 0.3);
/// Maximum length of a traced beam, m: limits the computing time.
const MAX_TRACE_M: f64 = 20.0;
/// A cell is dynamic if it was free in at least this many blocks, and in at least as many as in which it or an adjacent
/// cell was hit. It is static if it was hit in at least this many blocks, and in more than in which it was free.
const MIN_BLOCKS: usize = 2;
/// A point is classified by the finest cells within the eight nearest cells of this level.
const LEVEL: u32 = 1;
/// A point is dynamic if more than this many times as many points around it are in dynamic cells as in static ones.
const DYNAMIC_RATIO: u32 = 2;

/// Occupied and free cells of a block.
#[derive(Debug)]
pub(super) struct FreeSpace {
    /// Cells that were hit, and their neighbours.
    occupied: CellSet,
    /// Cells that a beam crossed and that are not in `occupied`.
    free: CellSet,
}

impl FreeSpace {
    pub(super) fn from_returns(hits: &[ProjectedReturn], counts: &BlockCounts) -> Self {
        let around = |(cell, _)| with_neighbours(coordinates_of(cell, 0));
        let occupied = || collect(counts.cells().flat_map(around));
        let crossed = || collect(hits.iter().step_by(STRIDE).filter_map(Traversal::of).flatten());
        let (occupied, crossed) = rayon::join(occupied, crossed);
        Self { free: crossed.difference(&occupied), occupied }
    }
}

fn collect(cells_of: impl Iterator<Item = [i64; 3]>) -> CellSet {
    let mut cells = CellSet::default();
    cells.extend(cells_of);
    cells
}

/// The finest cells of a block whose points are on dynamic objects.
#[derive(Debug)]
pub(super) struct DynamicCells {
    /// Morton codes, sorted.
    cells: Vec<u64>,
}

impl DynamicCells {
    /// Classifies the cells of `block` by the blocks `around` it, including itself.
    pub(super) fn find(block: &BlockCounts, around: &[&FreeSpace]) -> Self {
        let cells: Vec<(u64, u32)> = block.cells().collect();
        let cubes: Vec<&[(u64, u32)]> = cells.chunk_by(|a, b| cube_of(a.0) == cube_of(b.0)).collect();
        let classified: Vec<(u64, u32, bool)> =
            cubes.into_par_iter().with_min_len(32).flat_map_iter(|cells| classify(cells, around)).collect();
        let density_of = |is_dynamic: bool| {
            let cells = classified.iter().filter(|(.., moved)| *moved == is_dynamic);
            Density::from_blocks([BlockCounts::from_iter(cells.map(|(cell, points, _)| (*cell, *points)))].iter())
        };
        let (dynamic, fixed) = (density_of(true), density_of(false));
        // The eight nearest cells of a point are those of all points of its finest cell, as a coarse cell has two on an edge.
        let is_dynamic = |(cell, _): &&(u64, u32)| {
            let centre = Vector::from(coordinates_of(*cell, 0).map(|x| (x as f64 + 0.5) * EDGE_M));
            let moved = dynamic.count_around(&centre, LEVEL);
            moved > 0 && moved > DYNAMIC_RATIO * fixed.count_around(&centre, LEVEL)
        };
        Self { cells: cells.par_iter().with_min_len(512).filter(is_dynamic).map(|(cell, _)| *cell).collect() }
    }

    /// Whether a point is on a dynamic object.
    pub(super) fn contains(&self, point: &Vector) -> bool {
        self.cells.binary_search(&morton_code(coordinates(point, 0), 0)).is_ok()
    }
}

/// Classifies the cells of one cube: code, number of points, whether it is dynamic; undecided cells are skipped.
fn classify<'a>(cells: &'a [(u64, u32)], around: &[&FreeSpace]) -> impl Iterator<Item = (u64, u32, bool)> + use<'a> {
    let cube = cube_of(cells[0].0);
    let cubes: Vec<[Cube; 2]> =
        around.iter().map(|free_space| [free_space.free.cube(cube), free_space.occupied.cube(cube)]).collect();
    cells.iter().filter_map(move |(cell, points)| {
        let at = coordinates_of(*cell, 0);
        let [free, occupied] = [0, 1].map(|which| cubes.iter().filter(|pair| pair[which].contains(at)).count());
        let moved = free >= MIN_BLOCKS && free >= occupied;
        (moved || occupied >= MIN_BLOCKS).then_some((*cell, *points, moved))
    })
}

fn with_neighbours([x, y, z]: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    (0..27).map(move |k| [x + k / 9 - 1, y + k / 3 % 3 - 1, z + k % 3 - 1])
}

/// Iterator over the cells that a beam crosses (Amanatides and Woo 1987).
struct Traversal {
    cell: Option<[i64; 3]>,
    /// For each axis: direction of the step, range at which the beam enters the next cell, m, and range per cell, m.
    side: [i64; 3],
    next_m: [f64; 3],
    step_m: [f64; 3],
    limit_m: f64,
}

impl Traversal {
    /// Starts at the lidar; `None` if the beam is too short to be traced.
    fn of(hit: &ProjectedReturn) -> Option<Self> {
        let ray = hit.point_in_map - hit.origin_in_map;
        let range_m = ray.norm();
        let limit_m = (range_m * TRACE_LIMIT.0).min(range_m - TRACE_LIMIT.1).min(MAX_TRACE_M);
        let step_m = [0, 1, 2].map(|axis| EDGE_M * range_m / ray[axis].abs());
        let next_m = [0, 1, 2].map(|axis| {
            let at = hit.origin_in_map[axis] / EDGE_M;
            let to_boundary = if ray[axis] > 0.0 { 1.0 - (at - at.floor()) } else { at - at.floor() };
            if ray[axis] == 0.0 { f64::INFINITY } else { to_boundary * step_m[axis] }
        });
        let side = [0, 1, 2].map(|axis| if ray[axis] > 0.0 { 1 } else { -1 });
        let cell = Some(coordinates(&hit.origin_in_map, 0));
        (limit_m > 0.0).then_some(Self { cell, side, next_m, step_m, limit_m })
    }
}

impl Iterator for Traversal {
    type Item = [i64; 3];

    fn next(&mut self) -> Option<[i64; 3]> {
        let cell = self.cell?;
        let [x, y, z] = self.next_m;
        let axis = if x < y {
            if x < z { 0 } else { 2 }
        } else if y < z {
            1
        } else {
            2
        };
        self.cell = (self.next_m[axis] <= self.limit_m).then(|| {
            let mut next = cell;
            next[axis] += self.side[axis];
            next
        });
        self.next_m[axis] += self.step_m[axis];
        Some(cell)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::time::Stamp;

    fn beam(from: [f64; 3], to: [f64; 3]) -> ProjectedReturn {
        ProjectedReturn { stamp: Stamp::default(), point_in_map: to.into(), origin_in_map: from.into() }
    }

    #[test]
    fn traversal_agrees_with_small_steps_along_the_beam() {
        for k in 0..200 {
            let wave = |m: f64| (k as f64 * m).sin() * 7.0;
            let (from, to) = ([wave(0.7), wave(1.1), wave(1.9)], [wave(2.3), wave(2.9), wave(3.1)]);
            let hit = beam(from, to);
            let cells: Vec<[i64; 3]> = Traversal::of(&hit).into_iter().flatten().collect();
            let range_m = hit.range_m();
            let limit_m = (0.9 * range_m).min(range_m - 0.3);
            let ray = (hit.point_in_map - hit.origin_in_map) / range_m;
            let steps = (limit_m / 1e-3).max(0.0) as usize;
            let at = |k: usize| coordinates(&(hit.origin_in_map + ray * (k as f64 * 1e-3)), 0);
            let mut stepped: Vec<[i64; 3]> = (0..steps).map(at).collect();
            stepped.dedup();
            // Small steps only miss the corners of cells.
            assert!(stepped.iter().all(|cell| cells.contains(cell)), "{from:?} {to:?}");
            assert!(cells.len() <= stepped.len() + 2 + stepped.len() / 20, "{} and {}", cells.len(), stepped.len());
        }
    }

    /// Returns of a wall at x = 6, seen from the origin, with a post in front of it at `mover_y`, if any.
    fn block(mover_y: Option<f64>) -> (BlockCounts, FreeSpace) {
        let at = |k: usize| (-4.0 + 0.02 * (k % 400) as f64, 0.4 + 0.1 * (k / 400) as f64);
        let end = |(y, z): (f64, f64)| match mover_y {
            Some(mover_y) if (y / 2.0 - mover_y).abs() < 0.15 => [3.0, y / 2.0, z / 2.0],
            _ => [6.0, y, z],
        };
        let hits: Vec<ProjectedReturn> = (0..4000).map(|k| beam([0.0; 3], end(at(k)))).collect();
        let counts = BlockCounts::from_returns(&hits);
        let free_space = FreeSpace::from_returns(&hits, &counts);
        (counts, free_space)
    }

    /// Dynamic cells of the fifth block.
    fn dynamic_cells_in(blocks: &[(BlockCounts, FreeSpace)]) -> DynamicCells {
        let around: Vec<&FreeSpace> = blocks.iter().map(|(_, free_space)| free_space).collect();
        DynamicCells::find(&blocks[4].0, &around)
    }

    #[test]
    fn object_present_for_2_of_11_seconds_is_dynamic_and_the_wall_is_not() {
        let blocks: Vec<_> = (0..11).map(|k| block((4..6).contains(&k).then_some(0.9))).collect();
        let dynamic = dynamic_cells_in(&blocks);
        assert!(dynamic.contains(&Vector::new(3.0, 0.9, 0.4)));
        assert!(!dynamic.contains(&Vector::new(6.0, 1.8, 0.8)), "the occluded wall is static");
        assert!(!dynamic.contains(&Vector::new(6.0, -2.0, 0.8)));
        // A post that is present all the time is static.
        let blocks: Vec<_> = (0..11).map(|_| block(Some(0.9))).collect();
        assert!(!dynamic_cells_in(&blocks).contains(&Vector::new(3.0, 0.9, 0.4)));
    }
}
