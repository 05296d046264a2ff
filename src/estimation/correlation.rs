//! Correlative search: poses of surfaces in a region of others, by cells and directions of normals.
//!
//! After E. Olson, Real-time correlative scan matching (ICRA 2009), in 3-D: the surfaces of a map are entered into a grid with the
//! directions of their normals. For every translation and heading of a region, the surfaces of the query that fall into cells
//! with the same direction are counted.

use crate::surfel::Patch;
use rayon::prelude::*;
use std::cmp::Reverse;
use std::f64::consts::{FRAC_PI_4, TAU};
use zsim_base::geometry::{Pose, Rotation, Vector};

/// Edge of the grid cells, m: the correlation tolerates about one cell of error.
const CELL_M: f64 = 0.5;
/// Heading steps per full circle (4.5 degrees each).
const HEADINGS: i32 = 80;
/// Maximum number of query patches in the correlation.
const MAX_CORRELATED: usize = 100;
/// Candidates within this many cells and heading steps of a stronger one are suppressed.
const SUPPRESSION: (i32, i32) = (2, 2);
/// A surface is horizontal if the vertical component of the unit normal exceeds this (37 degrees).
const HORIZONTAL_NORMAL_Z: f64 = 0.8;

/// Candidate pose on the search grid: heading steps and cells relative to the centre of the region.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct GridPose {
    heading_step: i32,
    cells: [i32; 3],
}

impl GridPose {
    fn is_near(&self, other: &Self, up: i32) -> bool {
        let turns = (self.heading_step - other.heading_step).rem_euclid(HEADINGS);
        let [x, y, z] = [0, 1, 2].map(|axis| (self.cells[axis] - other.cells[axis]).abs());
        turns.min(HEADINGS - turns) <= SUPPRESSION.1 && x.max(y) <= SUPPRESSION.0 && z <= up
    }
}

/// The region of a search about a pose, horizontal and vertical distances, m.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Region {
    /// Patches of the map within this distance are in the grid.
    pub(crate) grid_m: (f64, f64),
    /// Poses are searched within this distance.
    pub(crate) search_m: (f64, f64),
    /// First and last heading, steps of 4.5 degrees from that of the pose.
    pub(crate) headings: (i32, i32),
    /// Vertical step of the search, cells; and the vertical distance up to which a stronger candidate suppresses another.
    pub(crate) up: (i32, i32),
    /// Number of candidates per heading, and in total.
    pub(crate) candidates: (usize, usize),
}

impl Region {
    /// All headings.
    pub(crate) const ALL_HEADINGS: (i32, i32) = (0, HEADINGS - 1);

    /// The region of all patches of a map, with any heading, and its centre; `None` without patches.
    pub(crate) fn of_map(map: &[Patch], candidates: (usize, usize)) -> Option<(Self, Vector)> {
        let corner = |pick: fn(f64, f64) -> f64| map.iter().map(|p| p.centre).reduce(|a, b| a.zip_map(&b, pick));
        let (low, high) = (corner(f64::min)?, corner(f64::max)?);
        let half = (high - low) * 0.5;
        let grid_m = (half.xy().norm() + CELL_M, half.z + CELL_M);
        let search_m = (half.x.max(half.y), half.z);
        Some((Self { grid_m, search_m, headings: Self::ALL_HEADINGS, up: (1, 0), candidates }, low + half))
    }

    /// Number of cells that are tested for each heading.
    pub(crate) fn cells(&self) -> f64 {
        let [level, up] = [self.search_m.0, self.search_m.1].map(|reach_m| 2.0 * reach_m / CELL_M);
        level * level * up / f64::from(self.up.0)
    }
}

/// A candidate: the pose turned about the vertical through the viewpoint, rad, and then moved, m.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Offset {
    pub(crate) yaw: f64,
    pub(crate) shift: Vector,
}

/// Occupancy grid of normal directions around a pose: for each cell a bit per direction present in the cell or its neighbours.
struct NormalGrid {
    first: [i32; 3],
    size: [i32; 3],
    cells: Vec<u16>,
}

impl NormalGrid {
    /// Grid of the finest `patches` of the region around `centre`; `None` if there are none.
    fn around(centre: &Vector, patches: &[Patch], region: Region) -> Option<Self> {
        let is_near = |patch: &&Patch| {
            let offset = patch.centre - centre;
            patch.level == 0 && offset.xy().norm() < region.grid_m.0 && offset.z.abs() < region.grid_m.1
        };
        let occupied: Vec<([i32; 3], u16)> = patches
            .iter()
            .filter(is_near)
            .map(|patch| {
                let (nearest, next) = directions(&patch.normal);
                (cell(&patch.centre), nearest | next)
            })
            .collect();
        let end = |axis: usize, pick: fn(i32, i32) -> i32| occupied.iter().map(|(cell, _)| cell[axis]).reduce(pick);
        let (mut first, mut size) = ([0; 3], [0; 3]);
        for axis in 0..3 {
            first[axis] = end(axis, i32::min)? - 1;
            size[axis] = end(axis, i32::max)? + 2 - first[axis];
        }
        let mut grid = Self { first, size, cells: vec![0; size.iter().map(|n| *n as usize).product()] };
        for (at, bits) in occupied {
            for k in 0..27 {
                let neighbour = [at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1];
                if let Some(index) = grid.index(neighbour) {
                    grid.cells[index] |= bits;
                }
            }
        }
        Some(grid)
    }

    fn index(&self, at: [i32; 3]) -> Option<usize> {
        let [x, y, z] = [0, 1, 2].map(|axis| at[axis] - self.first[axis]);
        let inside = [x, y, z].iter().zip(self.size).all(|(x, n)| (0..n).contains(x));
        inside.then(|| ((z * self.size[1] + y) * self.size[0] + x) as usize)
    }

    fn contains(&self, at: [i32; 3]) -> bool {
        self.index(at).is_some()
    }

    /// Number of cells with directions that hit a surface of the same direction when translated.
    fn hits(&self, query: &[([i32; 3], u16)], by: [i32; 3]) -> usize {
        let is_hit = |(at, bit): &&([i32; 3], u16)| {
            self.index([at[0] + by[0], at[1] + by[1], at[2] + by[2]]).is_some_and(|index| self.cells[index] & bit != 0)
        };
        query.iter().filter(is_hit).count()
    }
}

fn cell(point: &Vector) -> [i32; 3] {
    [point.x, point.y, point.z].map(|x| (x / CELL_M).floor() as i32)
}

/// Bits of the nearest and the second nearest direction of a normal: eight horizontal ones, up, down.
fn directions(normal: &Vector) -> (u16, u16) {
    if normal.z.abs() > HORIZONTAL_NORMAL_Z {
        let bit = if normal.z > 0.0 { 1 << 8 } else { 1 << 9 };
        return (bit, bit);
    }
    let eighths = normal.y.atan2(normal.x) / FRAC_PI_4;
    let nearest = eighths.round();
    let next = if eighths < nearest { nearest - 1.0 } else { nearest + 1.0 };
    let bit = |octant: f64| 1 << (octant.rem_euclid(8.0) as u16 & 7);
    (bit(nearest), bit(next))
}

/// Returns candidate poses of `query`, observed from the point `from`, by correlation with `map`, the best first.
///
/// They are relative to the pose `here`, the centre of the region.
pub(crate) fn candidates(map: &[Patch], query: &[Patch], from: &Vector, here: &Pose, region: Region) -> Vec<Offset> {
    let centre = here.transform_point(&(*from).into()).coords;
    let Some(grid) = NormalGrid::around(&centre, map, region) else { return Vec::new() };
    let correlated: Vec<&Patch> = query.iter().step_by(query.len().div_ceil(MAX_CORRELATED).max(1)).collect();
    let (horizontal, up) = ((region.search_m.0 / CELL_M) as i32, (region.search_m.1 / CELL_M) as i32);
    let steps = |reach: i32, step: i32| (-reach / step..=reach / step).map(move |k| k * step);
    let level = || steps(horizontal, 1).flat_map(move |x| steps(horizontal, 1).map(move |y| (x, y)));
    let at = cell(&centre);
    let cells: Vec<[i32; 3]> = steps(up, region.up.0)
        .flat_map(|z| level().map(move |(x, y)| [x, y, z]))
        .filter(|by| grid.contains([at[0] + by[0], at[1] + by[1], at[2] + by[2]]))
        .collect();
    let at_heading = |heading_step: i32| {
        let turn = Rotation::from_scaled_axis(Vector::z() * yaw(heading_step)) * here.rotation;
        let rotated = correlated.iter().map(|patch| {
            let centre = turn * (patch.centre - from) + centre;
            (cell(&centre), directions(&(turn * patch.normal)).0)
        });
        let rotated: Vec<([i32; 3], u16)> = rotated.collect();
        let hits = cells.iter().map(|by| (grid.hits(&rotated, *by), GridPose { heading_step, cells: *by }));
        suppress_non_maxima(hits.collect(), region.candidates.0, region.up.1)
    };
    let headings = (region.headings.0..=region.headings.1).into_par_iter();
    let all: Vec<(usize, GridPose)> = headings.flat_map_iter(at_heading).collect();
    let offset = |(_, at): (usize, GridPose)| Offset {
        yaw: yaw(at.heading_step),
        shift: Vector::from(at.cells.map(|cells| f64::from(cells) * CELL_M)),
    };
    suppress_non_maxima(all, region.candidates.1, region.up.1).into_iter().map(offset).collect()
}

fn yaw(heading_step: i32) -> f64 {
    f64::from(heading_step) * TAU / f64::from(HEADINGS)
}

/// The `count` candidates with the most hits, after non-maximum suppression.
fn suppress_non_maxima(mut all: Vec<(usize, GridPose)>, count: usize, up: i32) -> Vec<(usize, GridPose)> {
    let max_hits = all.iter().map(|(hits, _)| *hits).max().unwrap_or(0);
    all.retain(|(hits, _)| 2 * hits > max_hits);
    all.sort_unstable_by_key(|(hits, shift)| (Reverse(*hits), *shift));
    let mut chosen: Vec<(usize, GridPose)> = Vec::new();
    for one in all {
        if chosen.len() == count {
            break;
        }
        if chosen.iter().all(|(_, other)| !other.is_near(&one.1, up)) {
            chosen.push(one);
        }
    }
    chosen
}
