//! Search of the map for a pose: for one that matches better than the accepted one, or without any knowledge of it.
//!
//! Rooms are symmetric and storeys look alike, so a wrong start can lead to a false pose at which most surfels match the
//! map: up to 82 % in the mocap room rotated by 180 degrees, against 99 % at the correct pose. If the map covers little of
//! the query, no property of the false pose separates it from the correct one; the comparison with all other poses does.
//! Candidate poses come from correlative matching (Olson, ICRA 2009), here in 3-D and with the normals of all surfaces.

use super::limits::{MAP_LIMITS, RelocalisationLimits};
use super::localised_pose::{LocalisedPose, offset_pose, pose_distance};
use super::relocaliser::{COMPETING_SCORE, Relocaliser, check_size, is_different_pose};
use crate::surfel::Patch;
use rayon::prelude::*;
use std::cmp::Reverse;
use std::f64::consts::{FRAC_PI_4, TAU};
use zsim_base::geometry::{Pose, Rotation, Vector};

/// Edge of the grid cells, m: the correlation tolerates about one cell of error.
const CELL_M: f64 = 0.5;
/// The region about an accepted pose: the grid has the search radius plus the range of the lidar indoors, and the radius bounds
/// the computing time.
const ABOUT_A_POSE: Region = Region { grid_m: (50.0, 12.0), search_m: (25.0, 8.0), up: (2, 2), candidates: (8, 32) };
/// Maximum number of cells that the search of a whole map may test, for each heading: a site of 400 m by 400 m, 3 m high.
const MAX_SEARCHED_CELLS: usize = 4_000_000;
/// Candidates in a whole map, per heading and refined: the correct pose must be among the refined, or a similar one elsewhere
/// would be taken for it.
const IN_A_MAP: (usize, usize) = (32, 512);
/// Heading steps per full circle (4.5 degrees each).
const HEADINGS: usize = 80;
/// Maximum number of query patches in the correlation.
const MAX_CORRELATED: usize = 100;
/// Candidates within this many cells and heading steps of a stronger one are suppressed.
const SUPPRESSION: (i32, i32) = (2, 2);
/// A surface is horizontal if the vertical component of the unit normal exceeds this (37 degrees).
const HORIZONTAL_NORMAL_Z: f64 = 0.8;
/// An accepted pose is rejected if another has more than this multiple of its inlier ratio. In 144 starts in office, mocap
/// room, courtyard and stairwell the best false pose has at most 0.88 times the inlier ratio of the correct one.
const MAX_OTHER_INLIER_RATIO: f64 = 1.05;
/// After a gap a pose is rejected if another has more than this multiple of its likelihood.
const MIN_RIVAL_LIKELIHOOD: f64 = 0.5;

/// Candidate pose on the search grid: heading steps and cells relative to the accepted pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct GridPose {
    heading_step: i32,
    cells: [i32; 3],
}

impl GridPose {
    fn is_near(&self, other: &Self, up: i32) -> bool {
        let turns = (self.heading_step - other.heading_step).rem_euclid(HEADINGS as i32);
        let [x, y, z] = [0, 1, 2].map(|axis| (self.cells[axis] - other.cells[axis]).abs());
        turns.min(HEADINGS as i32 - turns) <= SUPPRESSION.1 && x.max(y) <= SUPPRESSION.0 && z <= up
    }
}

/// The region of a search about a point, horizontal and vertical distances, m.
#[derive(Debug, Clone, Copy)]
struct Region {
    /// Patches of the map within this distance are in the grid.
    grid_m: (f64, f64),
    /// Poses are searched within this distance.
    search_m: (f64, f64),
    /// Vertical step of the search, cells; and the vertical distance up to which a stronger candidate suppresses another.
    up: (i32, i32),
    /// Number of candidates per heading, and of those that are refined.
    candidates: (usize, usize),
}

impl Region {
    /// The region of all patches of a map, and its centre; `None` without patches.
    fn of_map(map: &[Patch]) -> Option<(Self, Vector)> {
        let corner = |pick: fn(f64, f64) -> f64| map.iter().map(|p| p.centre).reduce(|a, b| a.zip_map(&b, pick));
        let (low, high) = (corner(f64::min)?, corner(f64::max)?);
        let half = (high - low) * 0.5;
        let (level_m, up_m) = (half.xy().norm() + CELL_M, half.z + CELL_M);
        Some((
            Self { grid_m: (level_m, up_m), search_m: (half.x.max(half.y), half.z), up: (1, 0), candidates: IN_A_MAP },
            low + half,
        ))
    }
}

/// Maximum standard deviation of the position of a pose in a whole map, m: along an unobserved direction, such as the vertical
/// of a level scan of walls, a pose stays where the grid of candidates put it.
const MAX_POSITION_SIGMA_M: f64 = 0.05;

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

impl Relocaliser {
    /// Returns a pose of `query`, observed from the point `from`, that matches clearly better than `found`.
    pub(crate) fn find_better_elsewhere(
        &self,
        query: &[Patch],
        from: &Vector,
        found: &LocalisedPose,
    ) -> Option<LocalisedPose> {
        let best = self.find_elsewhere(query, from, found, &MAP_LIMITS)?;
        (best.inlier_ratio > MAX_OTHER_INLIER_RATIO * found.inlier_ratio).then_some(best)
    }

    /// Refuses the pose `found` after a gap if another pose that the head can have reached, with any heading, matches about
    /// as well.
    ///
    /// # Errors
    /// The distance of the other pose.
    pub(crate) fn refuse_ambiguous(
        &self,
        query: &[Patch],
        from: &Vector,
        found: &LocalisedPose,
        limits: &RelocalisationLimits,
    ) -> Result<(), String> {
        if limits.rival_reach_m <= 0.0 {
            return Ok(());
        }
        match self.find_elsewhere(query, from, found, limits) {
            Some(other) if limits.likelihood(&other) > MIN_RIVAL_LIKELIHOOD * limits.likelihood(found) => {
                let (distance_m, angle) = pose_distance(&other.map_from_query, &found.map_from_query, from);
                Err(format!(
                    "ambiguous: another pose at a distance of {distance_m:.1} m and {:.0} degrees matches about as well",
                    angle.to_degrees()
                ))
            }
            _ => Ok(()),
        }
    }

    /// Returns the pose of `query`, observed from the point `from`, that matches best according to `limits`, with any
    /// heading, among those that differ from `found`.
    fn find_elsewhere(
        &self,
        query: &[Patch],
        from: &Vector,
        found: &LocalisedPose,
        limits: &RelocalisationLimits,
    ) -> Option<LocalisedPose> {
        let here = found.map_from_query;
        let is_rival = |other: &LocalisedPose| {
            let (distance_m, _) = pose_distance(&other.map_from_query, &here, from);
            distance_m < limits.rival_reach_m && is_different_pose(other, found, from)
        };
        let found = self.find_all(query, from, &here, ABOUT_A_POSE, limits);
        let others = found.into_iter().filter(is_rival);
        others.max_by(|a, b| limits.likelihood(a).total_cmp(&limits.likelihood(b)))
    }

    /// Returns the accepted poses of `query` in a region about the pose `here`, with any heading.
    fn find_all(
        &self,
        query: &[Patch],
        from: &Vector,
        here: &Pose,
        region: Region,
        limits: &RelocalisationLimits,
    ) -> Vec<LocalisedPose> {
        let patches_by_level = self.patches_by_level(query);
        let candidates_here = candidates(self.patches(), &patches_by_level[0], from, here, region);
        let starts = candidates_here.iter().map(|by| {
            let shift = Vector::from(by.cells.map(|cells| f64::from(cells) * CELL_M));
            let start = offset_pose(here, from, f64::from(by.heading_step) * TAU / HEADINGS as f64, shift);
            (start, start)
        });
        let poses = self.refine_all(&patches_by_level, starts.collect(), from);
        let levels = limits.levels.min(patches_by_level.len());
        let evaluated = self.evaluate_all(&patches_by_level[..levels], from, &poses, limits.gate_m);
        evaluated.filter(|found| limits.accepts(found)).collect()
    }

    /// Finds the pose of `query`, observed from the point `from`, in the whole map; the pose of the head in the query's frame is
    /// `query_from_head`.
    ///
    /// # Errors
    /// The reason, and what to do, if the map is too large, no pose is accepted, the matches leave a direction open, or another
    /// pose matches about as well.
    pub(crate) fn find_anywhere(
        &self,
        query: &[Patch],
        from: &Vector,
        query_from_head: &Pose,
    ) -> Result<LocalisedPose, String> {
        check_size(query)?;
        let (region, centre) = Region::of_map(self.patches()).ok_or("the map has no surfels")?;
        let (level_m, up_m) = region.search_m;
        if (2.0 * level_m / CELL_M).powi(2) * (2.0 * up_m / CELL_M) / f64::from(region.up.0) > MAX_SEARCHED_CELLS as f64
        {
            let (width_m, height_m) = (2.0 * level_m, 2.0 * up_m);
            return Err(format!(
                "the map is {width_m:.0} m wide and {height_m:.0} m high, too large to be searched; pass --start"
            ));
        }
        let here = Pose::from_parts((centre - from).into(), Rotation::identity());
        let mut found = self.find_all(query, from, &here, region, &MAP_LIMITS);
        found.sort_by(|a, b| b.inlier_ratio.total_cmp(&a.inlier_ratio));
        let Some(best) = found.first() else {
            let why =
                "nowhere in the map do enough of the observed surfels match; if the place is in the map, pass --start";
            return Err(why.to_owned());
        };
        let competes = |other: &&LocalisedPose| {
            is_different_pose(best, other, from) && other.inlier_ratio > COMPETING_SCORE * best.inlier_ratio
        };
        if let Some(other) = found.iter().find(competes) {
            let (best, other) = (best.at_head(query_from_head), other.at_head(query_from_head));
            return Err(format!("ambiguous: {best}, and {other}; pass the right one as --start"));
        }
        if best.position_sigma_m() > MAX_POSITION_SIGMA_M {
            return Err(format!(
                "{}, but the surfaces seen do not determine the position along one direction, such as the height in a level \
                 scan; pass the position as --start",
                best.at_head(query_from_head)
            ));
        }
        Ok(best.clone())
    }
}

/// Candidate poses of the query by correlation with the map, relative to the pose `here`.
fn candidates(map: &[Patch], query: &[Patch], from: &Vector, here: &Pose, region: Region) -> Vec<GridPose> {
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
        let pose = offset_pose(here, from, f64::from(heading_step) * TAU / HEADINGS as f64, Vector::zeros());
        let rotated = correlated.iter().map(|patch| {
            let centre = pose.transform_point(&patch.centre.into()).coords;
            (cell(&centre), directions(&(pose.rotation * patch.normal)).0)
        });
        let rotated: Vec<([i32; 3], u16)> = rotated.collect();
        let hits = cells.iter().map(|by| (grid.hits(&rotated, *by), GridPose { heading_step, cells: *by }));
        suppress_non_maxima(hits.collect(), region.candidates.0, region.up.1)
    };
    let all: Vec<(usize, GridPose)> = (0..HEADINGS as i32).into_par_iter().flat_map_iter(at_heading).collect();
    suppress_non_maxima(all, region.candidates.1, region.up.1).into_iter().map(|(_, shift)| shift).collect()
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
