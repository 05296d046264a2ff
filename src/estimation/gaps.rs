//! Long gaps in time, shortened, so that memory follows the data and not the time that it spans.
//!
//! A clock that is set by a day in the middle of a recording leaves a gap of a day. What is laid out evenly over time
//! (knots, posts, chapters) would fill it. So it is laid out over a time in which every gap is [`KEPT_S`] at most.

use super::survey::{KnownLidar, Sighting, Survey};
use crate::geometry::{PoseCovariance, Trajectory};
use crate::time::{Span, Stamp};

/// A gap is shortened to this, s: nothing of one side reaches the other across it.
const KEPT_S: f64 = 10.0;

/// The long gaps of a trajectory.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Gaps {
    /// The last stamp before each gap, and how much of all time up to its end is left out.
    cuts: Vec<(Stamp, Span)>,
}

impl Gaps {
    /// Those between stamps; `None` where no gap is longer than what is kept.
    pub(super) fn of(stamps: &[Stamp]) -> Option<Self> {
        let kept = Span::from_seconds(KEPT_S);
        let mut left_out = Span::default();
        let mut cuts = Vec::new();
        for pair in stamps.windows(2).filter(|pair| pair[1] - pair[0] > kept) {
            left_out = left_out + (pair[1] - pair[0]) - kept;
            cuts.push((pair[0], left_out));
        }
        (!cuts.is_empty()).then_some(Self { cuts })
    }

    /// A stamp in the shortened time; within a gap it is not later than the gap's end.
    fn shortened(&self, stamp: Stamp) -> Stamp {
        let passed = self.cuts.partition_point(|(from, _)| *from < stamp);
        let Some((from, left_out)) = passed.checked_sub(1).map(|k| self.cuts[k]) else { return stamp };
        let before = passed.checked_sub(2).map_or(Span::default(), |k| self.cuts[k].1);
        // Shortly after the gap's start time goes on as it does, and shortly before its end.
        (stamp - left_out).max((from - before) + (stamp - from).min(Span::from_seconds(KEPT_S)))
    }

    /// A trajectory in the shortened time.
    pub(super) fn shorten(&self, trajectory: &Trajectory) -> Trajectory {
        let stamped = trajectory.iter().map(|(stamp, pose)| (self.shortened(stamp), *pose));
        Trajectory::from_poses(stamped).unwrap_or_default()
    }

    /// Covariances in the shortened time.
    pub(super) fn shorten_covariances(&self, all: &[(Stamp, PoseCovariance)]) -> Vec<(Stamp, PoseCovariance)> {
        all.iter().map(|(stamp, covariance)| (self.shortened(*stamp), *covariance)).collect()
    }

    /// A survey in the shortened time.
    pub(super) fn shorten_survey(&self, survey: &Survey) -> Survey {
        let origin = survey.origin;
        let seconds = |tau_s: f64| self.shortened(origin + Span::from_seconds(tau_s)).seconds_since(origin);
        let sighting = |one: &Sighting| Sighting { tau_s: seconds(one.tau_s), ..*one };
        let known = |one: &KnownLidar| KnownLidar { until_s: seconds(one.until_s), ..*one };
        Survey {
            sightings: survey.sightings.iter().map(sighting).collect(),
            lidars: survey.lidars.iter().map(known).collect(),
            ..*survey
        }
    }
}

/// `shortened` at the stamps that it had before.
pub(super) fn restored(shortened: &Trajectory, stamps: &[Stamp]) -> Trajectory {
    let stamped = stamps.iter().copied().zip(shortened.poses().iter().copied());
    Trajectory::from_poses(stamped).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;

    fn at(seconds: f64) -> Stamp {
        Stamp::from_nanos(1_349_049_600_000_000_000) + Span::from_seconds(seconds)
    }

    #[test]
    fn a_day_becomes_ten_seconds_and_comes_back() {
        let stamps: Vec<Stamp> = [0.0, 1.0, 86_401.0, 86_402.0, 86_500.0, 86_501.0].map(at).to_vec();
        let poses = (0..6).map(|k| Pose::translation(f64::from(k), 0.0, 0.0));
        let trajectory = Trajectory::from_poses(stamps.iter().copied().zip(poses)).unwrap();
        let gaps = Gaps::of(&stamps).unwrap();
        let short = gaps.shorten(&trajectory);
        let expected: Vec<Stamp> = [0.0, 1.0, 11.0, 12.0, 22.0, 23.0].map(at).to_vec();
        assert_eq!(short.stamps(), expected);
        assert_eq!(restored(&short, &stamps), trajectory);
        // Around the gap times stay in order.
        let times = [0.5, 1.0, 1.2, 40_000.0, 86_400.8, 86_401.0, 86_401.3].map(|s| gaps.shortened(at(s)));
        assert!(times.windows(2).all(|pair| pair[0] <= pair[1]), "{times:?}");
        assert_eq!(times[2], at(1.2));
        assert_eq!(times[6], at(11.3));
        assert!(times[4] <= at(11.0));
    }

    #[test]
    fn without_a_long_gap_there_is_nothing_to_shorten() {
        assert_eq!(Gaps::of(&[0.0, 9.0, 18.0].map(at)), None);
    }
}
