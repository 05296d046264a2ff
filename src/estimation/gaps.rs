//! Shortens long gaps in time, so that memory depends on the amount of data, not on the time span.
//!
//! If a clock is set by a day in the middle of a recording, there is a gap of a day. Quantities at regular times (knots,
//! nodes) would fill it. They are placed on a time axis on which no gap exceeds [`MAX_GAP_S`].

use super::observed::{LidarCorrectionPeriod, MotionByViews, ObservedSurfel, ObservedSurfels};
use zsim_base::geometry::{PoseCovariance, Trajectory, TrajectoryError};
use zsim_base::time::{Span, Stamp};

/// Longer gaps are shortened to this, s; it is longer than any interaction across a gap.
const MAX_GAP_S: f64 = 10.0;

/// The long gaps of a trajectory.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Gaps {
    /// The last stamp before each gap, and the total time removed up to the end of the gap.
    cuts: Vec<(Stamp, Span)>,
}

impl Gaps {
    /// The long gaps between stamps; `None` if there are none.
    pub(super) fn between(stamps: &[Stamp]) -> Option<Self> {
        let max_gap = Span::from_seconds(MAX_GAP_S);
        let mut removed = Span::default();
        let mut cuts = Vec::new();
        for pair in stamps.windows(2).filter(|pair| pair[1] - pair[0] > max_gap) {
            removed = removed + (pair[1] - pair[0]) - max_gap;
            cuts.push((pair[0], removed));
        }
        (!cuts.is_empty()).then_some(Self { cuts })
    }

    /// Converts a stamp to the shortened time; a stamp in a gap is at most at the end of the gap.
    fn shortened(&self, stamp: Stamp) -> Stamp {
        let passed = self.cuts.partition_point(|(from, _)| *from < stamp);
        let Some((from, removed)) = passed.checked_sub(1).map(|k| self.cuts[k]) else { return stamp };
        let before = passed.checked_sub(2).map_or(Span::default(), |k| self.cuts[k].1);
        // Near both ends of a gap, time differences do not change.
        (stamp - removed).max((from - before) + (stamp - from).min(Span::from_seconds(MAX_GAP_S)))
    }

    /// Converts a trajectory to the shortened time.
    pub(super) fn shorten(&self, trajectory: &Trajectory) -> Result<Trajectory, TrajectoryError> {
        let stamped = trajectory.iter().map(|(stamp, pose)| (self.shortened(stamp), *pose));
        Trajectory::from_poses(stamped)
    }

    /// Converts covariances to the shortened time.
    pub(super) fn shorten_covariances(&self, all: &[(Stamp, PoseCovariance)]) -> Vec<(Stamp, PoseCovariance)> {
        all.iter().map(|(stamp, covariance)| (self.shortened(*stamp), *covariance)).collect()
    }

    /// Converts observed surfels to the shortened time.
    pub(super) fn shorten_observed(&self, observed: &ObservedSurfels) -> ObservedSurfels {
        let origin = observed.origin;
        let seconds = |tau_s: f64| self.shortened(origin + Span::from_seconds(tau_s)).seconds_since(origin);
        let surfel = |one: &ObservedSurfel| ObservedSurfel { tau_s: seconds(one.tau_s), ..*one };
        let known = |one: &LidarCorrectionPeriod| LidarCorrectionPeriod { until_s: seconds(one.until_s), ..*one };
        let by_views =
            |one: &MotionByViews| MotionByViews { from_s: seconds(one.from_s), until_s: seconds(one.until_s), ..*one };
        ObservedSurfels {
            by_views: observed.by_views.iter().map(by_views).collect(),
            surfels: observed.surfels.iter().map(surfel).collect(),
            lidars: observed.lidars.iter().map(known).collect(),
            ..*observed
        }
    }
}

/// The poses of `shortened` at the original stamps.
pub(super) fn restored(shortened: &Trajectory, stamps: &[Stamp]) -> Result<Trajectory, TrajectoryError> {
    let stamped = stamps.iter().copied().zip(shortened.poses().iter().copied());
    Trajectory::from_poses(stamped)
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::geometry::Pose;

    fn at(seconds: f64) -> Stamp {
        Stamp::from_nanos(1_349_049_600_000_000_000) + Span::from_seconds(seconds)
    }

    #[test]
    fn a_gap_of_a_day_is_shortened_to_ten_seconds_and_restored() {
        let stamps: Vec<Stamp> = [0.0, 1.0, 86_401.0, 86_402.0, 86_500.0, 86_501.0].map(at).to_vec();
        let poses = (0..6).map(|k| Pose::translation(f64::from(k), 0.0, 0.0));
        let trajectory = Trajectory::from_poses(stamps.iter().copied().zip(poses)).unwrap();
        let gaps = Gaps::between(&stamps).unwrap();
        let short = gaps.shorten(&trajectory).unwrap();
        let expected: Vec<Stamp> = [0.0, 1.0, 11.0, 12.0, 22.0, 23.0].map(at).to_vec();
        assert_eq!(short.stamps(), expected);
        assert_eq!(restored(&short, &stamps).unwrap(), trajectory);
        // Times around the gap remain in order.
        let times = [0.5, 1.0, 1.2, 40_000.0, 86_400.8, 86_401.0, 86_401.3].map(|s| gaps.shortened(at(s)));
        assert!(times.windows(2).all(|pair| pair[0] <= pair[1]), "{times:?}");
        assert_eq!(times[2], at(1.2));
        assert_eq!(times[6], at(11.3));
        assert!(times[4] <= at(11.0));
    }

    #[test]
    fn short_gaps_are_not_shortened() {
        assert_eq!(Gaps::between(&[0.0, 9.0, 18.0].map(at)), None);
    }
}
