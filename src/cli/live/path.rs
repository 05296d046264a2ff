//! Paths so far, and the pose at a time.

use super::growing::Growing;
use std::collections::VecDeque;
use zsim_base::geometry::Pose;
use zsim_report::page::{MAX_PAGE_POSES, TimedPose, TruePoses};

/// Time between the poses of a path at first, s.
const SPACING_S: f64 = 0.02;
/// Duration of the poses that scans are projected with, s: a scan waits for its poses for less than this.
const RECENT_S: f64 = 30.0;
/// A pose up to this much outside the recent poses is extrapolated as the nearest one, s.
const OUTSIDE_S: f64 = 0.02;

/// An item with a time.
pub(super) trait Timed: Copy {
    /// Time since the first measurement, s.
    fn t_s(&self) -> f64;
}

impl Timed for TimedPose {
    fn t_s(&self) -> f64 {
        self.t_s
    }
}

impl Timed for TruePoses {
    fn t_s(&self) -> f64 {
        self.t_s
    }
}

/// A path of limited length: poses have a larger spacing if there are too many.
#[derive(Debug)]
pub(super) struct GrowingPath<T> {
    spacing_s: f64,
    poses: Growing<T>,
}

impl<T> Default for GrowingPath<T> {
    fn default() -> Self {
        Self { spacing_s: SPACING_S, poses: Growing::default() }
    }
}

impl<T: Timed> GrowingPath<T> {
    pub(super) fn poses(&self) -> &Growing<T> {
        &self.poses
    }

    /// Adds a pose if it is late enough.
    pub(super) fn push(&mut self, pose: T) {
        // Half a pose period of tolerance, so that rounding does not skip a pose.
        let due_s = self.poses.items().last().map_or(f64::NEG_INFINITY, |last| last.t_s() + self.spacing_s - 0.005);
        if pose.t_s() < due_s {
            return;
        }
        if self.poses.items().len() >= MAX_PAGE_POSES {
            self.spacing_s *= 2.0;
            let mut is_kept = false;
            self.poses.restart_with(|_| {
                is_kept = !is_kept;
                is_kept
            });
        }
        self.poses.push(pose);
    }
}

/// The poses of the last seconds, in order of time.
#[derive(Debug, Default)]
pub(super) struct RecentPoses(VecDeque<TimedPose>);

impl RecentPoses {
    pub(super) fn push(&mut self, pose: TimedPose) {
        if self.0.back().is_some_and(|last| pose.t_s <= last.t_s) {
            return;
        }
        self.0.push_back(pose);
        while self.0.front().is_some_and(|first| first.t_s < pose.t_s - RECENT_S) {
            self.0.pop_front();
        }
    }

    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// Time of the newest pose, s.
    pub(super) fn end_s(&self) -> Option<f64> {
        self.0.back().map(|last| last.t_s)
    }

    /// Interpolates the pose at `t_s`; `None` outside the recent poses.
    pub(super) fn at(&self, t_s: f64) -> Option<Pose> {
        let after = self.0.partition_point(|pose| pose.t_s < t_s);
        match (after.checked_sub(1).and_then(|before| self.0.get(before)), self.0.get(after)) {
            (Some(before), Some(next)) => between(before, next, t_s),
            (Some(only), None) | (None, Some(only)) => ((only.t_s - t_s).abs() <= OUTSIDE_S).then_some(only.pose),
            (None, None) => None,
        }
    }
}

/// Interpolates between two poses; `None` if they differ by half a turn.
fn between(before: &TimedPose, next: &TimedPose, t_s: f64) -> Option<Pose> {
    before.pose.try_lerp_slerp(&next.pose, (t_s - before.t_s) / (next.t_s - before.t_s), 1e-6)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(t_s: f64) -> TimedPose {
        TimedPose { t_s, pose: Pose::translation(2.0 * t_s, 0.0, 0.0) }
    }

    #[test]
    fn a_path_has_50_poses_a_second_and_a_limited_number() {
        let mut path = GrowingPath::default();
        (0..=100).for_each(|k| path.push(pose(0.01 * f64::from(k))));
        assert_eq!(path.poses().items().len(), 51);
        (101..200_000).for_each(|k| path.push(pose(0.01 * f64::from(k))));
        // 2000 s of poses: at 50 and 25 a second they are more than 20,000, at 12.5 a second 25,000, at 6.25 12,500.
        let times: Vec<f64> = path.poses().items().iter().map(|pose| pose.t_s).collect();
        assert!(times.len() <= MAX_PAGE_POSES && times.len() >= 12_500, "{}", times.len());
        assert!(times.windows(2).all(|pair| pair[1] > pair[0]));
    }

    #[test]
    fn recent_poses_are_interpolated_and_old_ones_forgotten() {
        let mut recent = RecentPoses::default();
        (0..=10_000).for_each(|k| recent.push(pose(0.01 * f64::from(k))));
        let x_m = recent.at(99.995).unwrap().translation.x;
        assert!((x_m - 199.99).abs() < 1e-9, "{x_m}");
        assert!(recent.at(60.0).is_none() && recent.at(100.1).is_none());
    }
}
