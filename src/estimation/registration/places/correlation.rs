//! Start alignments of two nodes by correlation over heading and horizontal translation.
//!
//! After E. Olson, Real-time correlative scan matching (ICRA 2009): the vertical surfaces of one node are entered into a grid
//! with the octants of their normals. For every translation in range and every heading around the given one, the surfaces of
//! the other node that fall into cells with the same octant are counted.

use super::alignment::Alignment;
use super::scan_context::is_wall;
use crate::surfel::Patch;
use zsim_base::geometry::{Rotation, Vector};

/// Edge of the grid cells, m.
const CELL_M: f64 = 0.5;
/// Number of cells from the centre to the border: 20 m, as the Scan Context descriptor.
const HALF_GRID_CELLS: i32 = 40;
/// Search range of the translation in cells to each side: 3 m, the maximum distance of two views of one node.
const SEARCH_CELLS: i32 = 6;
/// Number of heading steps to each side: 9 degrees, more than one sector of the descriptor.
const HEADING_STEPS: i32 = 3;
/// Heading step, rad.
const HEADING_STEP: f64 = 3.0 * std::f64::consts::PI / 180.0;
/// Maximum number of walls in the correlation.
const MAX_WALLS: usize = 300;
/// Alignments within this many cells and heading steps of a stronger one are suppressed.
const SUPPRESSION: (i32, i32) = (2, 3);

/// The `count` best alignments of `from` with `to`, at headings around `yaw` and with a vertical shift of `up_m`.
pub(super) fn start_alignments(from: &[Patch], to: &[Patch], yaw: f64, up_m: f64, count: usize) -> Vec<Alignment> {
    let grid = Grid::of(to);
    let walls: Vec<&Patch> = from.iter().filter(|patch| is_wall(patch)).collect();
    let walls: Vec<&Patch> = walls.iter().step_by(walls.len().div_ceil(MAX_WALLS).max(1)).copied().collect();
    let mut found: Vec<(u32, [i32; 3])> = Vec::new();
    for step in -HEADING_STEPS..=HEADING_STEPS {
        let rotation = Rotation::from_scaled_axis(Vector::z() * (yaw + f64::from(step) * HEADING_STEP));
        let cells: Vec<(i32, i32, u8)> = walls
            .iter()
            .map(|wall| {
                let (x, y) = cell(&(rotation * wall.centre));
                (x, y, 1 << octants(&(rotation * wall.normal)).0)
            })
            .collect();
        for (x, y) in (-SEARCH_CELLS..=SEARCH_CELLS).flat_map(|x| (-SEARCH_CELLS..=SEARCH_CELLS).map(move |y| (x, y))) {
            let hits = cells.iter().filter(|(u, v, octant)| grid.at(u + x, v + y) & octant != 0).count();
            found.push((hits as u32, [step, x, y]));
        }
    }
    found.sort_by_key(|(hits, at)| (std::cmp::Reverse(*hits), *at));
    let mut chosen: Vec<[i32; 3]> = Vec::new();
    for (_, at) in found {
        let is_other = |one: &[i32; 3]| {
            (one[0] - at[0]).abs() > SUPPRESSION.1 || (one[1] - at[1]).abs().max((one[2] - at[2]).abs()) > SUPPRESSION.0
        };
        if chosen.len() < count && chosen.iter().all(is_other) {
            chosen.push(at);
        }
    }
    let start = |[step, x, y]: [i32; 3]| Alignment {
        yaw: yaw + f64::from(step) * HEADING_STEP,
        shift: Vector::new(f64::from(x) * CELL_M, f64::from(y) * CELL_M, up_m),
    };
    chosen.into_iter().map(start).collect()
}

/// Horizontal grid: for each cell a bit per octant of the normals in the cell and its neighbours.
struct Grid(Vec<u8>);

impl Grid {
    fn of(patches: &[Patch]) -> Self {
        let mut grid = Self(vec![0; (4 * HALF_GRID_CELLS * HALF_GRID_CELLS) as usize]);
        for patch in patches.iter().filter(|patch| is_wall(patch)) {
            let (x, y) = cell(&patch.centre);
            let (nearest, next) = octants(&patch.normal);
            for (u, v) in (x - 1..=x + 1).flat_map(|u| (y - 1..=y + 1).map(move |v| (u, v))) {
                if let Some(index) = index(u, v) {
                    grid.0[index] |= 1 << nearest | 1 << next;
                }
            }
        }
        grid
    }

    fn at(&self, x: i32, y: i32) -> u8 {
        index(x, y).map_or(0, |index| self.0[index])
    }
}

fn index(x: i32, y: i32) -> Option<usize> {
    let inside = (-HALF_GRID_CELLS..HALF_GRID_CELLS).contains(&x) && (-HALF_GRID_CELLS..HALF_GRID_CELLS).contains(&y);
    inside.then(|| ((x + HALF_GRID_CELLS) * 2 * HALF_GRID_CELLS + y + HALF_GRID_CELLS) as usize)
}

fn cell(point: &Vector) -> (i32, i32) {
    ((point.x / CELL_M).floor() as i32, (point.y / CELL_M).floor() as i32)
}

/// The nearest and the second nearest octant of a direction, 0..8.
fn octants(direction: &Vector) -> (u8, u8) {
    let eighths = direction.y.atan2(direction.x) / std::f64::consts::FRAC_PI_4;
    let nearest = eighths.round();
    let next = if eighths < nearest { nearest - 1.0 } else { nearest + 1.0 };
    let wrap = |octant: f64| octant.rem_euclid(8.0) as u8 & 7;
    (wrap(nearest), wrap(next))
}
