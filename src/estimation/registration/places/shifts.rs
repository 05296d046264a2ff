//! How two places may lie beside each other: a search over turns and shifts in the plane.
//!
//! After E. Olson, Real-time correlative scan matching (ICRA 2009): the walls of one place are drawn into a grid, and
//! the other's are counted that fall into it, at every shift within reach and every turn near the one proposed. A wall
//! is drawn with the octants that its normal is nearest to, and counts where these agree.

use super::context::is_upright;
use super::fit::Alignment;
use crate::estimation::surfel::Patch;
use crate::geometry::{Rotation, Vector};

/// Edge of the grid's cells, m, and their number from the middle to the border.
const CELL_M: f64 = 0.5;
const HALF: i32 = 40;
/// Reach of the search: cells to every side, and turns to each with their step, rad.
const REACH: i32 = 6;
const TURNS: i32 = 3;
const TURN_STEP: f64 = 3.0 * std::f64::consts::PI / 180.0;
/// Most walls that are counted.
const WALLS: usize = 300;
/// Two starts are others when they differ by more, cells and turns.
const OTHER: (i32, i32) = (2, 3);

/// The `count` most promising alignments of `from` with `to`, turned by about `yaw` and lifted by `up_m`.
pub(super) fn starts(from: &[Patch], to: &[Patch], (yaw, up_m): (f64, f64), count: usize) -> Vec<Alignment> {
    let grid = Grid::of(to);
    let walls: Vec<&Patch> = from.iter().filter(|patch| is_upright(patch)).collect();
    let walls: Vec<&Patch> = walls.iter().step_by(walls.len().div_ceil(WALLS).max(1)).copied().collect();
    let mut found: Vec<(u32, [i32; 3])> = Vec::new();
    for turn in -TURNS..=TURNS {
        let rotation = Rotation::from_scaled_axis(Vector::z() * (yaw + f64::from(turn) * TURN_STEP));
        let cells: Vec<(i32, i32, u8)> = walls
            .iter()
            .map(|wall| {
                let (x, y) = cell(&(rotation * wall.centre));
                (x, y, 1 << octants(&(rotation * wall.normal)).0)
            })
            .collect();
        for (x, y) in (-REACH..=REACH).flat_map(|x| (-REACH..=REACH).map(move |y| (x, y))) {
            let hits = cells.iter().filter(|(u, v, octant)| grid.at(u + x, v + y) & octant != 0).count();
            found.push((hits as u32, [turn, x, y]));
        }
    }
    found.sort_by_key(|(hits, at)| (std::cmp::Reverse(*hits), *at));
    let mut chosen: Vec<[i32; 3]> = Vec::new();
    for (_, at) in found {
        let is_other = |one: &[i32; 3]| {
            (one[0] - at[0]).abs() > OTHER.1 || (one[1] - at[1]).abs().max((one[2] - at[2]).abs()) > OTHER.0
        };
        if chosen.len() < count && chosen.iter().all(is_other) {
            chosen.push(at);
        }
    }
    let start = |[turn, x, y]: [i32; 3]| Alignment {
        yaw: yaw + f64::from(turn) * TURN_STEP,
        shift: Vector::new(f64::from(x) * CELL_M, f64::from(y) * CELL_M, up_m),
    };
    chosen.into_iter().map(start).collect()
}

/// Walls from above: of each cell the octants of the normals in it and in its neighbours, a bit each.
struct Grid(Vec<u8>);

impl Grid {
    fn of(patches: &[Patch]) -> Self {
        let mut grid = Self(vec![0; (4 * HALF * HALF) as usize]);
        for patch in patches.iter().filter(|patch| is_upright(patch)) {
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
    let inside = (-HALF..HALF).contains(&x) && (-HALF..HALF).contains(&y);
    inside.then(|| ((x + HALF) * 2 * HALF + y + HALF) as usize)
}

fn cell(point: &Vector) -> (i32, i32) {
    ((point.x / CELL_M).floor() as i32, (point.y / CELL_M).floor() as i32)
}

/// The octant whose middle a direction is nearest to, and the one next to it, 0..8.
fn octants(direction: &Vector) -> (u8, u8) {
    let eighths = direction.y.atan2(direction.x) / std::f64::consts::FRAC_PI_4;
    let nearest = eighths.round();
    let next = if eighths < nearest { nearest - 1.0 } else { nearest + 1.0 };
    let wrap = |octant: f64| octant.rem_euclid(8.0) as u8 & 7;
    (wrap(nearest), wrap(next))
}
