//! Search region and acceptance thresholds of the relocalisation.

use super::localised_pose::{LocalisedPose, offset_pose, pose_distance};
use zsim_base::geometry::{Pose, Vector};

/// Spacing of the start poses, m and rad: within half of it the coarsest surfels converge.
const START_SPACING: (f64, f64) = (0.7, 14.0 / 180.0 * std::f64::consts::PI);
/// Search radius after a gap, m: initial value, growth per second of the gap, upper limit.
const GAP_RADIUS: (f64, f64, f64) = (0.3, 1.0, 2.5);
/// Start poses go no farther than this, m: from there the matching converges over the rest of the search radius.
const MAX_START_OFFSET_M: f64 = 1.4;
/// After a gap longer than this, s, the search region is large, and a pose must match more of the map and better.
const LONG_GAP_S: f64 = 1.5;
/// Vertical spacing of the start poses, m: stairs repeat every 0.3 m, and the coarsest surfels converge over more.
const START_SPACING_UP_M: f64 = 0.5;
/// Climbing speed of a person on stairs, m/s: vertical search after a gap.
const CLIMB_M_PER_S: f64 = 0.5;
/// Search range of the heading after a gap, degrees: initial value, growth per second of the gap, upper limit.
const GAP_HEADING_DEG: (f64, f64, f64) = (15.0, 60.0, 90.0);
/// Radius within which the head can be after a long gap, m: initial value, growth per second of the gap.
const RIVAL_REACH: (f64, f64) = (1.0, 2.0);

/// Search region around an expected pose, and thresholds for accepting a pose.
#[derive(Debug)]
pub(crate) struct RelocalisationLimits {
    /// Horizontal distance, m, and heading, rad, from the expected pose.
    reach: (f64, f64),
    /// Vertical distance of the start poses from the expected pose, m.
    reach_up_m: f64,
    /// Maximum distance of matched patches along their normals, m; `None` for a fixed fraction of the voxel edge.
    pub(super) gate_m: Option<f64>,
    /// A pose is accepted if it meets one of these.
    evidence: &'static [Evidence],
    /// Number of resolutions with which poses are evaluated, from the finest on.
    pub(super) levels: usize,
    /// Exponent of the agreement in the score of a pose.
    agreement_power: i32,
    /// Maximum root mean square residual of the matches, m.
    max_residual_m: f64,
    /// Whether the pose nearest to the expected one wins among equally good poses; if not, they are ambiguous.
    pub(super) nearest: bool,
    /// Distance that a pose of which nothing matches may be off, m.
    unmatched_reach_m: f64,
    /// Poses with any heading within this distance of the found one must not match about as well, m.
    pub(super) rival_reach_m: f64,
}

/// Evidence for a pose: minimum numbers of matches.
#[derive(Debug)]
struct Evidence {
    /// Fraction of the finest patches that match the map.
    inlier_ratio: f64,
    /// Number of the finest patches that match the map.
    matched: usize,
    /// Fraction of matches among the patches that have a neighbour in the map.
    agreement: f64,
}

/// Evidence in a complete map.
const IN_MAP: Evidence = Evidence { inlier_ratio: 0.4, matched: 0, agreement: 0.0 };
/// Evidence after a short gap, where the expected pose is known to half a metre: many matches, or fewer that agree better, as
/// outdoors, where the views before and after the gap share few surfaces.
const AFTER_SHORT_GAP: [Evidence; 2] = [
    Evidence { inlier_ratio: 0.1, matched: 0, agreement: 0.6 },
    Evidence { inlier_ratio: 0.03, matched: 50, agreement: 0.9 },
];
/// Evidence after a long gap.
const AFTER_LONG_GAP: Evidence = Evidence { inlier_ratio: 0.15, matched: 100, agreement: 0.9 };

impl Evidence {
    fn is_met_by(&self, found: &LocalisedPose) -> bool {
        found.inlier_ratio >= self.inlier_ratio && found.matched >= self.matched && found.agreement >= self.agreement
    }
}

/// Maximum residual in a map, m: correct poses have 3 to 7 mm, chance matches of surfaces 10 to 17 mm.
const MAX_RESIDUAL_M: f64 = 0.01;

/// Limits in a complete map: the starts cover the convergence range of the coarsest surfels, 1 m and 20 degrees.
pub(crate) const MAP_LIMITS: RelocalisationLimits = RelocalisationLimits {
    reach: START_SPACING,
    reach_up_m: 0.0,
    gate_m: None,
    evidence: &[IN_MAP],
    levels: 1,
    agreement_power: 0,
    max_residual_m: MAX_RESIDUAL_M,
    nearest: false,
    unmatched_reach_m: 0.0,
    rival_reach_m: f64::INFINITY,
};

impl RelocalisationLimits {
    /// Limits for the surfels observed before a gap of `seconds`; `sigma_m` is the standard deviation of a match.
    ///
    /// The two sets of surfels may overlap little, but where they overlap they must agree. The head cannot have gone far.
    pub(crate) fn after_gap(seconds: f64, sigma_m: f64) -> Self {
        let reach_m = (GAP_RADIUS.0 + GAP_RADIUS.1 * seconds).min(GAP_RADIUS.2);
        let reach_deg = (GAP_HEADING_DEG.0 + GAP_HEADING_DEG.1 * seconds).min(GAP_HEADING_DEG.2);
        let is_long = seconds > LONG_GAP_S;
        Self {
            reach: (reach_m, reach_deg.to_radians()),
            reach_up_m: if is_long { (CLIMB_M_PER_S * seconds).min(MAX_START_OFFSET_M) } else { 0.0 },
            gate_m: Some(1.5 * sigma_m),
            evidence: if is_long { &[AFTER_LONG_GAP] } else { &AFTER_SHORT_GAP },
            levels: 3,
            agreement_power: 6,
            max_residual_m: f64::INFINITY,
            nearest: true,
            unmatched_reach_m: if is_long { reach_m } else { 0.0 },
            rival_reach_m: if is_long { RIVAL_REACH.0 + RIVAL_REACH.1 * seconds } else { 0.0 },
        }
    }

    /// Limits after a lidar gap that the IMU bridged, which predicts the position to `predicted_sigma_m` and the heading.
    pub(crate) fn after_coasting(predicted_sigma_m: f64, sigma_m: f64) -> Self {
        let reach_m = (GAP_RADIUS.0 + 2.0 * predicted_sigma_m).min(GAP_RADIUS.2);
        Self {
            reach: (reach_m, GAP_HEADING_DEG.0.to_radians()),
            reach_up_m: reach_m.min(MAX_START_OFFSET_M),
            unmatched_reach_m: reach_m,
            rival_reach_m: 0.0,
            ..Self::after_gap(f64::INFINITY, sigma_m)
        }
    }

    /// Start poses on a grid around the expected pose, each as a pair (start, current pose).
    pub(super) fn starts(&self, map_from_query: &Pose, viewpoint: &Vector) -> Vec<(Pose, Pose)> {
        let steps = |reach: f64, spacing: f64| {
            let steps = (reach / spacing).floor() as i32;
            (-steps..=steps).map(move |k| f64::from(k) * spacing)
        };
        let reach_m = self.reach.0.min(MAX_START_OFFSET_M);
        let level =
            || steps(reach_m, START_SPACING.0).flat_map(|x| steps(reach_m, START_SPACING.0).map(move |y| (x, y)));
        let mut starts = Vec::new();
        for yaw in steps(self.reach.1, START_SPACING.1) {
            for z in steps(self.reach_up_m, START_SPACING_UP_M) {
                let poses = level().map(|(x, y)| offset_pose(map_from_query, viewpoint, yaw, Vector::new(x, y, z)));
                starts.extend(poses.map(|start| (start, start)));
            }
        }
        starts
    }

    /// Distance that the true position may be from that of a pose, because little of the query matches, m.
    pub(super) fn unmatched_m(&self, inlier_ratio: f64) -> f64 {
        self.unmatched_reach_m * (1.0 - inlier_ratio)
    }

    /// Whether a pose meets the acceptance thresholds.
    pub(super) fn accepts(&self, found: &LocalisedPose) -> bool {
        self.evidence.iter().any(|evidence| evidence.is_met_by(found)) && found.residual_rms_m <= self.max_residual_m
    }

    /// Likelihood of a pose by its matches, 0..1.
    pub(super) fn likelihood(&self, found: &LocalisedPose) -> f64 {
        found.inlier_ratio.powi(3) * found.agreement.powi(self.agreement_power)
    }

    /// Prior likelihood of the pose `found` by the distance from the expected one, 0..1.
    pub(super) fn prior(&self, found: &Pose, expected: &Pose, viewpoint: &Vector) -> f64 {
        if !self.nearest {
            return 1.0;
        }
        let (distance_m, angle) = pose_distance(found, expected, viewpoint);
        let sigmas = 2.0 * (distance_m / self.reach.0).max(angle / self.reach.1);
        if sigmas > 3.0 { 0.0 } else { (-0.5 * sigmas * sigmas).exp() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn after_two_seconds_the_search_covers_a_metre_up_and_down() {
        let limits = RelocalisationLimits::after_gap(2.0, 0.01);
        let heights: Vec<f64> =
            limits.starts(&Pose::identity(), &Vector::zeros()).iter().map(|(start, _)| start.translation.z).collect();
        let (lowest, highest) =
            (heights.iter().copied().fold(0.0, f64::min), heights.iter().copied().fold(0.0, f64::max));
        assert_eq!((lowest, highest), (-1.0, 1.0));
    }

    #[test]
    fn the_start_poses_after_a_gap_of_a_day_are_a_few_thousand_at_most() {
        let count = |seconds: f64| {
            RelocalisationLimits::after_gap(seconds, 0.01).starts(&Pose::identity(), &Vector::zeros()).len()
        };
        assert_eq!(count(86_400.0), count(10.0));
        assert!(count(86_400.0) < 3000, "{}", count(86_400.0));
        // A short gap is searched at the expected height only: 3 x 3 positions, 11 headings at 1 s.
        assert!(count(1.0) < 150, "{}", count(1.0));
    }
}
