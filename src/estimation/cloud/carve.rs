//! What moved: a cell that was hit at one time, and through which beams went at others, is none of a surface that
//! stands.
//!
//! The idea is that of occupancy grids (Moravec and Elfes 1985), kept a second a grid and a few seconds long.

use super::Hit;
use super::cell::{EDGE_M, coordinates, coordinates_of, number};
use crate::geometry::Vector;

/// Level of the cells that are carved.
const LEVEL: u32 = 2;
/// Every so many-th beam carves.
const STRIDE: usize = 4;
/// Beams carve up to this share of their length, and to a cell before their end: what they graze then is what they hit.
const SHARE: f64 = 0.9;
/// But no farther than this, m.
const FARTHEST_M: f64 = 50.0;
/// Fewest beams that make a cell free.
const BEAMS: usize = 2;
/// A cell of what moves was free in at least so many blocks, and in so many times the number of those in which it was
/// hit.
const FREE: (usize, usize) = (3, 2);

/// Cells that a block's beams hit, and those that were free in it: gone through, and not hit, nor beside one that was
/// hit.
#[derive(Debug)]
pub(super) struct Carved {
    hit: Vec<u64>,
    free: Vec<u64>,
}

impl Carved {
    pub(super) fn by(hits: &[Hit]) -> Self {
        let mut hit: Vec<u64> = hits.iter().map(|hit| cell_of(&hit.point_in_map)).collect();
        sort_once(&mut hit);
        let mut through = Vec::new();
        hits.iter().step_by(STRIDE).for_each(|hit| go_through(hit, &mut through));
        through.sort_unstable();
        let mut beside: Vec<u64> = hit.iter().flat_map(|cell| with_neighbours(*cell)).collect();
        sort_once(&mut beside);
        let mut free = Vec::new();
        let mut next = 0;
        for run in through.chunk_by(|a, b| a == b).filter(|run| run.len() >= BEAMS) {
            while beside.get(next).is_some_and(|cell| *cell < run[0]) {
                next += 1;
            }
            if beside.get(next) != Some(&run[0]) {
                free.push(run[0]);
            }
        }
        Self { hit, free }
    }
}

/// Cells in which what was hit is of something that moved.
#[derive(Debug)]
pub(super) struct Moving(Vec<u64>);

impl Moving {
    pub(super) fn has(&self, point: &Vector) -> bool {
        self.0.binary_search(&cell_of(point)).is_ok()
    }
}

/// Of the cells that `block` hit, those that what is `around` it, `block` included, tells to be of something that
/// moved.
pub(super) fn moving(block: &Carved, around: &[&Carved]) -> Moving {
    let count = |list: fn(&Carved) -> &[u64], cell: &u64| {
        around.iter().filter(|carved| list(carved).binary_search(cell).is_ok()).count()
    };
    let moved = |cell: &&u64| {
        let free = count(|carved| &carved.free, cell);
        free >= FREE.0 && free >= FREE.1 * count(|carved| &carved.hit, cell)
    };
    Moving(block.hit.iter().filter(moved).copied().collect())
}

fn cell_of(point: &Vector) -> u64 {
    number(coordinates(point, LEVEL), LEVEL)
}

fn sort_once(cells: &mut Vec<u64>) {
    cells.sort_unstable();
    cells.dedup();
}

fn with_neighbours(cell: u64) -> impl Iterator<Item = u64> {
    let [x, y, z] = coordinates_of(cell, LEVEL);
    let beside = -1..=1_i64;
    beside.clone().flat_map(move |i| {
        let beside = -1..=1_i64;
        beside.flat_map(move |j| (-1..=1_i64).map(move |k| number([x + i, y + j, z + k], LEVEL)))
    })
}

/// Adds the cells that a beam goes through, one after the other (Amanatides and Woo 1987).
fn go_through(hit: &Hit, into: &mut Vec<u64>) {
    let edge_m = EDGE_M * f64::from(1_u32 << LEVEL);
    let way = hit.point_in_map - hit.origin_in_map;
    let range_m = way.norm();
    let until_m = (range_m * SHARE).min(range_m - edge_m).min(FARTHEST_M);
    if until_m.is_nan() || until_m <= 0.0 {
        return;
    }
    let mut cell = coordinates(&hit.origin_in_map, LEVEL);
    // Along each axis: the length at which the beam enters the next cell, and what each further one takes.
    let step = [0, 1, 2].map(|axis| edge_m * range_m / way[axis].abs());
    let mut next = [0, 1, 2].map(|axis| {
        let at = hit.origin_in_map[axis] / edge_m;
        let ahead = if way[axis] > 0.0 { 1.0 - (at - at.floor()) } else { at - at.floor() };
        if way[axis] == 0.0 { f64::INFINITY } else { ahead * step[axis] }
    });
    loop {
        into.push(number(cell, LEVEL));
        let axis = if next[0] < next[1] {
            if next[0] < next[2] { 0 } else { 2 }
        } else if next[1] < next[2] {
            1
        } else {
            2
        };
        if next[axis] > until_m {
            return;
        }
        cell[axis] += if way[axis] > 0.0 { 1 } else { -1 };
        next[axis] += step[axis];
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
            let mut cells = Vec::new();
            go_through(&hit, &mut cells);
            let range_m = hit.range_m();
            let until_m = (0.9 * range_m).min(range_m - 0.4);
            let way = (hit.point_in_map - hit.origin_in_map) / range_m;
            let steps = (until_m / 1e-3).max(0.0) as usize;
            let mut stepped: Vec<u64> =
                (0..steps).map(|k| cell_of(&(hit.origin_in_map + way * (k as f64 * 1e-3)))).collect();
            stepped.dedup();
            // Small steps miss the tips of cells, and no more.
            assert!(stepped.iter().all(|cell| cells.contains(cell)), "{from:?} {to:?}");
            assert!(cells.len() <= stepped.len() + 2 + stepped.len() / 20, "{} and {}", cells.len(), stepped.len());
        }
    }

    /// A wall at x = 6, seen from the origin in a fan, and in front of it, where `mover_y` says, a post.
    fn block(mover_y: Option<f64>) -> Carved {
        let at = |k: usize| (-4.0 + 0.02 * (k % 400) as f64, 0.4 + 0.1 * (k / 400) as f64);
        let end = |(y, z): (f64, f64)| match mover_y {
            Some(mover_y) if (y / 2.0 - mover_y).abs() < 0.15 => [3.0, y / 2.0, z / 2.0],
            _ => [6.0, y, z],
        };
        let hits: Vec<Hit> = (0..4000).map(|k| beam([0.0; 3], end(at(k)))).collect();
        Carved::by(&hits)
    }

    #[test]
    fn what_stood_there_for_two_seconds_of_eleven_moved_and_what_stands_did_not() {
        let blocks: Vec<Carved> = (0..11).map(|k| block((4..6).contains(&k).then_some(0.9))).collect();
        let around: Vec<&Carved> = blocks.iter().collect();
        let moving = moving(&blocks[4], &around);
        assert!(moving.has(&Vector::new(3.0, 0.9, 0.4)));
        assert!(!moving.has(&Vector::new(6.0, 1.8, 0.8)), "the wall that it hid stands");
        assert!(!moving.has(&Vector::new(6.0, -2.0, 0.8)));
        // A post that stands all the time does not move.
        let blocks: Vec<Carved> = (0..11).map(|_| block(Some(0.9))).collect();
        let around: Vec<&Carved> = blocks.iter().collect();
        assert!(!super::moving(&blocks[4], &around).has(&Vector::new(3.0, 0.9, 0.4)));
    }
}
