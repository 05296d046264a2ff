//! Whether what was seen fits another place of the map better than the one that was found near a start.
//!
//! Rooms are symmetric and storeys alike: from a wrong start a wrong place is found in which most of what was seen lies
//! on the map (up to 82 % in the mocap room turned by 180 degrees, where the right place has 99 %). No property of the
//! wrong place alone separates it from the right one in a map that shows little of what is seen; the comparison with
//! all other places of the map does. These are proposed by correlation (Olson, ICRA 2009), in three dimensions and by
//! all surfaces, with their normals.

use super::locate::{Located, Locator, is_elsewhere, tried};
use super::search::IN_MAP;
use crate::estimation::surfel::Patch;
use crate::geometry::{Pose, Vector};
use rayon::prelude::*;
use std::cmp::Reverse;
use std::f64::consts::{FRAC_PI_4, TAU};

/// Edge of the grid's cells, m.
const CELL_M: f64 = 0.5;
/// Patches of the map farther than this from the place found are left out, m: on the level, and in height.
const WITHIN_M: (f64, f64) = (50.0, 12.0);
/// Places farther than this from it are not looked at, m, nor those that differ in height by more.
const REACH_M: (f64, f64) = (25.0, 8.0);
/// Steps between places: cells on the level and in height, and turns a full circle.
const STEPS: (i32, i32) = (1, 2);
const TURNS: usize = 80;
/// Patches of what was seen that are counted.
const COUNTED: usize = 100;
/// Places that are refined, overall and of one turn.
const REFINED: usize = 32;
const OF_A_TURN: usize = 8;
/// Two proposals are others when they differ by more, cells and turns.
const OTHER: (i32, i32) = (2, 2);
/// A surface is level when its normal leaves the vertical by less than this cosine.
const LEVEL: f64 = 0.8;
/// A place found near a start is the right one unless another has more than so many times its share of surfels on the
/// map. Of 144 starts in office, mocap room, courtyard and stairwell the best wrong place has at most 0.88 times the
/// share of the right one.
const BETTER: f64 = 1.05;

/// A turn by so many steps and a shift by so many cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Shift {
    turn: i32,
    cells: [i32; 3],
}

impl Shift {
    fn is_near(&self, other: &Self) -> bool {
        let turns = (self.turn - other.turn).rem_euclid(TURNS as i32);
        let apart = (0..3).map(|axis| (self.cells[axis] - other.cells[axis]).abs()).fold(0, i32::max);
        turns.min(TURNS as i32 - turns) <= OTHER.1 && apart <= OTHER.0
    }
}

/// Surfaces of the map about a place: of each cell the directions of the normals in it and in its neighbours, a bit
/// each.
struct Volume {
    first: [i32; 3],
    size: [i32; 3],
    cells: Vec<u16>,
}

impl Volume {
    /// Of the finest of `patches` around `centre`; `None` where there are none.
    fn about(centre: &Vector, patches: &[Patch]) -> Option<Self> {
        let is_near = |patch: &&Patch| {
            let apart = patch.centre - centre;
            patch.level == 0 && apart.xy().norm() < WITHIN_M.0 && apart.z.abs() < WITHIN_M.1
        };
        let near: Vec<([i32; 3], u16)> = patches
            .iter()
            .filter(is_near)
            .map(|patch| {
                let (nearest, next) = directions(&patch.normal);
                (cell(&patch.centre), nearest | next)
            })
            .collect();
        let end = |axis: usize, pick: fn(i32, i32) -> i32| near.iter().map(|(cell, _)| cell[axis]).reduce(pick);
        let (mut first, mut size) = ([0; 3], [0; 3]);
        for axis in 0..3 {
            first[axis] = end(axis, i32::min)? - 1;
            size[axis] = end(axis, i32::max)? + 2 - first[axis];
        }
        let mut volume = Self { first, size, cells: vec![0; size.iter().map(|n| *n as usize).product()] };
        for (at, bits) in near {
            for k in 0..27 {
                let beside = [at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1];
                if let Some(index) = volume.index(beside) {
                    volume.cells[index] |= bits;
                }
            }
        }
        Some(volume)
    }

    fn index(&self, at: [i32; 3]) -> Option<usize> {
        let [x, y, z] = [0, 1, 2].map(|axis| at[axis] - self.first[axis]);
        let inside = [x, y, z].iter().zip(self.size).all(|(x, n)| (0..n).contains(x));
        inside.then(|| ((z * self.size[1] + y) * self.size[0] + x) as usize)
    }

    fn contains(&self, at: [i32; 3]) -> bool {
        self.index(at).is_some()
    }

    /// How many of some cells with directions fall onto surfaces when they are shifted.
    fn hits(&self, seen: &[([i32; 3], u16)], by: [i32; 3]) -> usize {
        let is_hit = |(at, bit): &&([i32; 3], u16)| {
            self.index([at[0] + by[0], at[1] + by[1], at[2] + by[2]]).is_some_and(|index| self.cells[index] & bit != 0)
        };
        seen.iter().filter(is_hit).count()
    }
}

fn cell(point: &Vector) -> [i32; 3] {
    [point.x, point.y, point.z].map(|x| (x / CELL_M).floor() as i32)
}

/// Bits of the direction that a normal is nearest to and of the one next to it: eight on the level, up and down.
fn directions(normal: &Vector) -> (u16, u16) {
    if normal.z.abs() > LEVEL {
        let bit = if normal.z > 0.0 { 1 << 8 } else { 1 << 9 };
        return (bit, bit);
    }
    let eighths = normal.y.atan2(normal.x) / FRAC_PI_4;
    let nearest = eighths.round();
    let next = if eighths < nearest { nearest - 1.0 } else { nearest + 1.0 };
    let bit = |octant: f64| 1 << (octant.rem_euclid(8.0) as u16 & 7);
    (bit(nearest), bit(next))
}

impl Locator {
    /// A place of the map that `seen`, looked at from `from`, fits clearly better than the place `found`.
    pub(in crate::estimation) fn better_elsewhere(
        &self,
        seen: &[Patch],
        from: &Vector,
        found: &Located,
    ) -> Option<Located> {
        let here = found.map_from_seen;
        let by_level = self.by_level(seen);
        let proposed = proposals(self.patches(), &by_level[0], from, &here);
        let starts = proposed.iter().map(|by| {
            let shift = Vector::from(by.cells.map(|cells| f64::from(cells) * CELL_M));
            let start = tried(&here, from, f64::from(by.turn) * TAU / TURNS as f64, shift);
            (start, start)
        });
        let places = self.settled(&by_level, starts.collect(), from);
        let believed = self.judged(&by_level[0], from, &places, None).filter(|place| IN_MAP.believes(place));
        let best = believed.max_by(|a, b| a.share.total_cmp(&b.share))?;
        (best.share > BETTER * found.share && is_elsewhere(&best, found, from)).then_some(best)
    }
}

/// The most promising places of what was `seen` from `from`, as turns and shifts of the pose `here`.
fn proposals(map: &[Patch], seen: &[Patch], from: &Vector, here: &Pose) -> Vec<Shift> {
    let centre = here.transform_point(&(*from).into()).coords;
    let Some(volume) = Volume::about(&centre, map) else { return Vec::new() };
    let counted: Vec<&Patch> = seen.iter().step_by(seen.len().div_ceil(COUNTED).max(1)).collect();
    let (aside, up) = ((REACH_M.0 / CELL_M) as i32, (REACH_M.1 / CELL_M) as i32);
    let steps = |most: i32, step: i32| (-most / step..=most / step).map(move |k| k * step);
    let level = || steps(aside, STEPS.0).flat_map(move |x| steps(aside, STEPS.0).map(move |y| (x, y)));
    let at = cell(&centre);
    let cells: Vec<[i32; 3]> = steps(up, STEPS.1)
        .flat_map(|z| level().map(move |(x, y)| [x, y, z]))
        .filter(|by| volume.contains([at[0] + by[0], at[1] + by[1], at[2] + by[2]]))
        .collect();
    let of_turn = |turn: i32| {
        let pose = tried(here, from, f64::from(turn) * TAU / TURNS as f64, Vector::zeros());
        let turned = counted.iter().map(|patch| {
            let centre = pose.transform_point(&patch.centre.into()).coords;
            (cell(&centre), directions(&(pose.rotation * patch.normal)).0)
        });
        let turned: Vec<([i32; 3], u16)> = turned.collect();
        let hits = cells.iter().map(|by| (volume.hits(&turned, *by), Shift { turn, cells: *by }));
        strongest(hits.collect(), OF_A_TURN)
    };
    let all: Vec<(usize, Shift)> = (0..TURNS as i32).into_par_iter().flat_map_iter(of_turn).collect();
    strongest(all, REFINED).into_iter().map(|(_, shift)| shift).collect()
}

/// The `count` with the most hits of which none is near to another.
fn strongest(mut all: Vec<(usize, Shift)>, count: usize) -> Vec<(usize, Shift)> {
    let most = all.iter().map(|(hits, _)| *hits).max().unwrap_or(0);
    all.retain(|(hits, _)| 2 * hits > most);
    all.sort_unstable_by_key(|(hits, shift)| (Reverse(*hits), *shift));
    let mut chosen: Vec<(usize, Shift)> = Vec::new();
    for one in all {
        if chosen.len() == count {
            break;
        }
        if chosen.iter().all(|(_, other)| !other.is_near(&one.1)) {
            chosen.push(one);
        }
    }
    chosen
}
