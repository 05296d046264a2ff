//! Search of the map for a pose: for one that matches better than the accepted one, or without any knowledge of it.
//!
//! Rooms are symmetric and storeys look alike, so a wrong start can lead to a false pose at which most surfels match the
//! map: up to 82 % in the mocap room rotated by 180 degrees, against 99 % at the correct pose. If the map covers little of
//! the query, no property of the false pose separates it from the correct one; the comparison with all other poses does.
//! Candidate poses come from correlative matching.

use super::limits::{MAP_LIMITS, RelocalisationLimits};
use super::localised_pose::{LocalisedPose, offset_pose, pose_distance};
use super::relocaliser::{COMPETING_SCORE, Relocaliser, check_size, is_different_pose};
use crate::correlation::{Region, candidates};
use crate::surfel::Patch;
use zsim_base::geometry::{Pose, Rotation, Vector};

/// The region about an accepted pose: the grid has the search radius plus the range of the lidar indoors, and the radius bounds
/// the computing time.
const ABOUT_A_POSE: Region = Region {
    grid_m: (50.0, 12.0),
    search_m: (25.0, 8.0),
    headings: Region::ALL_HEADINGS,
    up: (2, 2),
    candidates: (8, 32),
};
/// Maximum number of cells that the search of a whole map may test, for each heading: a site of 400 m by 400 m, 3 m high.
const MAX_SEARCHED_CELLS: f64 = 4e6;
/// Candidates in a whole map, per heading and refined: the correct pose must be among the refined, or a similar one elsewhere
/// would be taken for it.
const IN_A_MAP: (usize, usize) = (32, 512);
/// An accepted pose is rejected if another has more than this multiple of its inlier ratio. In 144 starts in office, mocap
/// room, courtyard and stairwell the best false pose has at most 0.88 times the inlier ratio of the correct one.
const MAX_OTHER_INLIER_RATIO: f64 = 1.05;
/// After a gap a pose is rejected if another has more than this multiple of its likelihood.
const MIN_RIVAL_LIKELIHOOD: f64 = 0.5;

/// Maximum standard deviation of the position of a pose in a whole map, m: along an unobserved direction, such as the vertical
/// of a level scan of walls, a pose stays where the grid of candidates put it.
const MAX_POSITION_SIGMA_M: f64 = 0.05;

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
            let start = offset_pose(here, from, by.yaw, by.shift);
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
        let (region, centre) = Region::of_map(self.patches(), IN_A_MAP).ok_or("the map has no surfels")?;
        if region.cells() > MAX_SEARCHED_CELLS {
            let (width_m, height_m) = (2.0 * region.search_m.0, 2.0 * region.search_m.1);
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
