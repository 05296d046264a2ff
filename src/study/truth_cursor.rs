use crate::geometry::{Pose, Trajectory};
use crate::recording::{RecordingError, Truth, TruthReader};
use crate::simulation::EPOCH;
use crate::time::{Span, Stamp};
use std::collections::VecDeque;

/// How far back it can be asked: scans may come late.
const KEPT: Span = Span::from_nanos(1_000_000_000);

/// What is true at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TrueState {
    /// Where the head is.
    pub world_from_head: Pose,
    /// Where the base is that carries it; `None` in a recording that does not tell.
    pub world_from_base: Option<Pose>,
    /// True time since the run's start, s.
    pub t_s: f64,
}

/// The truth at instants that go forward, but for a second: read as it is asked for, never held as a whole.
pub(super) struct TruthCursor<'r> {
    truths: TruthReader<'r>,
    heads: Near,
    bases: Near,
    /// As the clocks said it last; they drift by microseconds from one time to the next.
    lidar_ahead: Span,
}

/// Poses of the last second.
#[derive(Default)]
struct Near(VecDeque<(Stamp, Pose)>);

impl<'r> TruthCursor<'r> {
    pub(super) fn new(truths: TruthReader<'r>) -> Self {
        Self { truths, heads: Near::default(), bases: Near::default(), lidar_ahead: Span::ZERO }
    }

    /// What is true at `stamp`, on the lidar's clock; `None` where there is no truth, or no more.
    pub(super) fn at(&mut self, stamp: Stamp) -> Result<Option<TrueState>, RecordingError> {
        // The base of an instant is told after the head.
        while self.heads.last().is_none_or(|last| last < stamp) || self.bases.last().is_some_and(|last| last < stamp) {
            match self.truths.next().transpose()? {
                Some(Truth::Head(at, pose)) => self.heads.0.push_back((at, pose)),
                Some(Truth::Base(at, pose)) => self.bases.0.push_back((at, pose)),
                Some(Truth::Clock(_, clock)) => self.lidar_ahead = clock.lidar_ahead,
                None => break,
            }
        }
        self.heads.forget_before(stamp - KEPT);
        self.bases.forget_before(stamp - KEPT);
        let t_s = (stamp - self.lidar_ahead).seconds_since(EPOCH);
        let instant = |world_from_head| TrueState { world_from_head, world_from_base: self.bases.at(stamp), t_s };
        Ok(self.heads.at(stamp).map(instant))
    }
}

impl Near {
    fn last(&self) -> Option<Stamp> {
        self.0.back().map(|(last, _)| *last)
    }

    fn forget_before(&mut self, oldest: Stamp) {
        while self.0.front().is_some_and(|(first, _)| *first < oldest) {
            self.0.pop_front();
        }
    }

    fn at(&self, stamp: Stamp) -> Option<Pose> {
        let after = self.0.partition_point(|(at, _)| *at < stamp);
        let around = self.0.range(after.saturating_sub(1)..self.0.len().min(after + 1)).copied();
        Trajectory::from_poses(around).unwrap_or_default().at(stamp)
    }
}
