//! Forward-only access to the recorded truth.

use std::collections::VecDeque;
use zsim_base::geometry::{Pose, Trajectory};
use zsim_base::time::{Span, Stamp};
use zsim_recording::{RecordingError, Truth, TruthReader};
use zsim_simulation::EPOCH;

/// Duration of the buffered truth: scans can be recorded out of order by up to this time.
const BUFFER: Span = Span::from_nanos(1_000_000_000);

/// True poses at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TrueState {
    /// Pose of the head.
    pub world_from_head: Pose,
    /// Pose of the base; `None` if the recording does not contain it.
    pub world_from_base: Option<Pose>,
    /// True time since the start of the run, s.
    pub t_s: f64,
}

/// Interpolates the recorded truth at increasing times, with a tolerance of 1 s backwards.
///
/// The truth is read on demand; memory does not grow with the length of the recording.
pub(super) struct TruthCursor<'r> {
    truths: TruthReader<'r>,
    heads: PoseBuffer,
    bases: PoseBuffer,
    /// Offset of the lidar clock at the last clock message; it changes by microseconds between messages.
    lidar_offset: Span,
}

/// Poses of the last second.
#[derive(Default)]
struct PoseBuffer(VecDeque<(Stamp, Pose)>);

impl<'r> TruthCursor<'r> {
    pub(super) fn new(truths: TruthReader<'r>) -> Self {
        Self { truths, heads: PoseBuffer::default(), bases: PoseBuffer::default(), lidar_offset: Span::ZERO }
    }

    /// The true state at `stamp` on the lidar clock; `None` if the truth does not cover it.
    pub(super) fn at(&mut self, stamp: Stamp) -> Result<Option<TrueState>, RecordingError> {
        // The base pose of a time follows the head pose in the recording.
        while self.heads.last().is_none_or(|last| last < stamp) || self.bases.last().is_some_and(|last| last < stamp) {
            match self.truths.next().transpose()? {
                Some(Truth::Head(at, pose)) => self.heads.0.push_back((at, pose)),
                Some(Truth::Base(at, pose)) => self.bases.0.push_back((at, pose)),
                Some(Truth::Clock(_, clock)) => self.lidar_offset = clock.lidar_offset,
                None => break,
            }
        }
        self.heads.remove_before(stamp - BUFFER);
        self.bases.remove_before(stamp - BUFFER);
        let t_s = (stamp - self.lidar_offset).seconds_since(EPOCH);
        let state = |world_from_head| TrueState { world_from_head, world_from_base: self.bases.at(stamp), t_s };
        Ok(self.heads.at(stamp).map(state))
    }
}

impl PoseBuffer {
    fn last(&self) -> Option<Stamp> {
        self.0.back().map(|(last, _)| *last)
    }

    fn remove_before(&mut self, oldest: Stamp) {
        while self.0.front().is_some_and(|(first, _)| *first < oldest) {
            self.0.pop_front();
        }
    }

    fn at(&self, stamp: Stamp) -> Option<Pose> {
        let after = self.0.partition_point(|(at, _)| *at < stamp);
        let adjacent = self.0.range(after.saturating_sub(1)..self.0.len().min(after + 1)).copied();
        Trajectory::from_poses(adjacent).unwrap_or_default().at(stamp)
    }
}
