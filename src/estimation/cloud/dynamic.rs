//! What moved: cells that were hit at one time, and through which beams went at others, are of no surface that stands.
//!
//! The idea is that of occupancy grids (Moravec and Elfes 1985), kept a second a grid and a few seconds long. A cell is
//! small, so that few beams look at it; what it tells is therefore put together with what those around it tell.

use super::Hit;
use super::cell::{EDGE_M, coordinates, coordinates_of};
use super::cells::{Cells, Cube, cube_of};
use super::support::{Crowd, Support};
use crate::geometry::Vector;
use rayon::prelude::*;

/// Every so many-th beam carves.
const STRIDE: usize = 4;
/// Beams carve up to this share of their length, and to so far before their end, m: what they graze then is what they
/// hit.
const UNTIL: (f64, f64) = (0.9, 0.3);
/// But no farther than this, m.
const FARTHEST_M: f64 = 20.0;
/// A cell of what moves was free in at least so many blocks, and in no fewer than those in which it, or one beside it,
/// was hit; one of what stands was hit in so many, and in more than were free.
const BLOCKS: usize = 2;
/// A point is judged by the cells in the eight of this level that are nearest to it.
const LEVEL: u32 = 1;
/// It moved where about it so many times more points are in cells of what moved than in such of what stands.
const MORE: u32 = 2;

/// Cells that a block's beams hit, with those beside them, and those that were free in it: gone through, and none of
/// the former.
#[derive(Debug)]
pub(super) struct Carved {
    beside: Cells,
    free: Cells,
}

impl Carved {
    pub(super) fn by(hits: &[Hit], crowd: &Crowd) -> Self {
        let around = |(cell, _)| with_neighbours(coordinates_of(cell, 0));
        let beside = || cells(crowd.cells().flat_map(around));
        let through = || cells(hits.iter().step_by(STRIDE).filter_map(Way::of).flatten());
        let (beside, through) = rayon::join(beside, through);
        Self { free: through.without(&beside), beside }
    }
}

fn cells(of: impl Iterator<Item = [i64; 3]>) -> Cells {
    let mut cells = Cells::default();
    cells.extend(of);
    cells
}

/// What moved, and what stands, of what was hit in a block.
#[derive(Debug)]
pub(super) struct Moving {
    moved: Support,
    stood: Support,
}

impl Moving {
    /// Of what is in `block`, as what is `around` it, the block itself included, tells.
    pub(super) fn of(block: &Crowd, around: &[&Carved]) -> Self {
        let cells: Vec<(u64, u32)> = block.cells().collect();
        let cubes: Vec<&[(u64, u32)]> = cells.chunk_by(|a, b| cube_of(a.0) == cube_of(b.0)).collect();
        let judged: Vec<(u64, u32, bool)> =
            cubes.into_par_iter().with_min_len(32).flat_map_iter(|cells| judged(cells, around)).collect();
        let those = |that: bool| {
            let cells = judged.iter().filter(|(.., moved)| *moved == that);
            Support::of([Crowd::from_iter(cells.map(|(cell, points, _)| (*cell, *points)))].iter())
        };
        Self { moved: those(true), stood: those(false) }
    }

    /// Whether what is about a point moved.
    pub(super) fn has(&self, point: &Vector) -> bool {
        let moved = self.moved.count_about(point, LEVEL);
        moved > 0 && moved > MORE * self.stood.count_about(point, LEVEL)
    }
}

/// Of cells of one cube those that moved or stood, each with its points and whether it moved.
fn judged<'a>(cells: &'a [(u64, u32)], around: &[&Carved]) -> impl Iterator<Item = (u64, u32, bool)> + use<'a> {
    let cube = cube_of(cells[0].0);
    let seen: Vec<[Cube; 2]> = around.iter().map(|carved| [carved.free.cube(cube), carved.beside.cube(cube)]).collect();
    cells.iter().filter_map(move |(cell, points)| {
        let at = coordinates_of(*cell, 0);
        let [free, beside] = [0, 1].map(|which| seen.iter().filter(|cubes| cubes[which].has(at)).count());
        let moved = free >= BLOCKS && free >= beside;
        (moved || beside >= BLOCKS).then_some((*cell, *points, moved))
    })
}

fn with_neighbours([x, y, z]: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    (0..27).map(move |k| [x + k / 9 - 1, y + k / 3 % 3 - 1, z + k % 3 - 1])
}

/// The cells that a beam goes through, one after the other (Amanatides and Woo 1987).
struct Way {
    cell: Option<[i64; 3]>,
    /// Along each axis: whereto, the length at which the beam enters the next cell, m, and what each further one takes.
    side: [i64; 3],
    next_m: [f64; 3],
    step_m: [f64; 3],
    until_m: f64,
}

impl Way {
    /// `None` of beams that are too short.
    fn of(hit: &Hit) -> Option<Self> {
        let way = hit.point_in_map - hit.origin_in_map;
        let range_m = way.norm();
        let until_m = (range_m * UNTIL.0).min(range_m - UNTIL.1).min(FARTHEST_M);
        let step_m = [0, 1, 2].map(|axis| EDGE_M * range_m / way[axis].abs());
        let next_m = [0, 1, 2].map(|axis| {
            let at = hit.origin_in_map[axis] / EDGE_M;
            let ahead = if way[axis] > 0.0 { 1.0 - (at - at.floor()) } else { at - at.floor() };
            if way[axis] == 0.0 { f64::INFINITY } else { ahead * step_m[axis] }
        });
        let side = [0, 1, 2].map(|axis| if way[axis] > 0.0 { 1 } else { -1 });
        let cell = Some(coordinates(&hit.origin_in_map, 0));
        (until_m > 0.0).then_some(Self { cell, side, next_m, step_m, until_m })
    }
}

impl Iterator for Way {
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
        self.cell = (self.next_m[axis] <= self.until_m).then(|| {
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
    use crate::time::Stamp;

    fn beam(from: [f64; 3], to: [f64; 3]) -> Hit {
        Hit { stamp: Stamp::default(), point_in_map: to.into(), origin_in_map: from.into() }
    }

    #[test]
    fn a_beam_goes_through_the_cells_that_small_steps_along_it_find() {
        for k in 0..200 {
            let wave = |m: f64| (k as f64 * m).sin() * 7.0;
            let (from, to) = ([wave(0.7), wave(1.1), wave(1.9)], [wave(2.3), wave(2.9), wave(3.1)]);
            let hit = beam(from, to);
            let cells: Vec<[i64; 3]> = Way::of(&hit).into_iter().flatten().collect();
            let range_m = hit.range_m();
            let until_m = (0.9 * range_m).min(range_m - 0.3);
            let way = (hit.point_in_map - hit.origin_in_map) / range_m;
            let steps = (until_m / 1e-3).max(0.0) as usize;
            let at = |k: usize| coordinates(&(hit.origin_in_map + way * (k as f64 * 1e-3)), 0);
            let mut stepped: Vec<[i64; 3]> = (0..steps).map(at).collect();
            stepped.dedup();
            // Small steps miss the tips of cells, and no more.
            assert!(stepped.iter().all(|cell| cells.contains(cell)), "{from:?} {to:?}");
            assert!(cells.len() <= stepped.len() + 2 + stepped.len() / 20, "{} and {}", cells.len(), stepped.len());
        }
    }

    /// A wall at x = 6, seen from the origin in a fan, and in front of it, where `mover_y` says, a post.
    fn block(mover_y: Option<f64>) -> (Crowd, Carved) {
        let at = |k: usize| (-4.0 + 0.02 * (k % 400) as f64, 0.4 + 0.1 * (k / 400) as f64);
        let end = |(y, z): (f64, f64)| match mover_y {
            Some(mover_y) if (y / 2.0 - mover_y).abs() < 0.15 => [3.0, y / 2.0, z / 2.0],
            _ => [6.0, y, z],
        };
        let hits: Vec<Hit> = (0..4000).map(|k| beam([0.0; 3], end(at(k)))).collect();
        let crowd = Crowd::of(&hits);
        let carved = Carved::by(&hits, &crowd);
        (crowd, carved)
    }

    /// What moved in the fifth of blocks.
    fn moved_in(blocks: &[(Crowd, Carved)]) -> Moving {
        let around: Vec<&Carved> = blocks.iter().map(|(_, carved)| carved).collect();
        Moving::of(&blocks[4].0, &around)
    }

    #[test]
    fn what_stood_there_for_two_seconds_of_eleven_moved_and_what_stands_did_not() {
        let blocks: Vec<_> = (0..11).map(|k| block((4..6).contains(&k).then_some(0.9))).collect();
        let moving = moved_in(&blocks);
        assert!(moving.has(&Vector::new(3.0, 0.9, 0.4)));
        assert!(!moving.has(&Vector::new(6.0, 1.8, 0.8)), "the wall that it hid stands");
        assert!(!moving.has(&Vector::new(6.0, -2.0, 0.8)));
        // A post that stands all the time does not move.
        let blocks: Vec<_> = (0..11).map(|_| block(Some(0.9))).collect();
        assert!(!moved_in(&blocks).has(&Vector::new(3.0, 0.9, 0.4)));
    }
}
