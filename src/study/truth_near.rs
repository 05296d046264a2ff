use crate::geometry::{Pose, Trajectory};
use crate::recording::{RecordingError, Truth, Truths};
use crate::time::{Span, Stamp};
use std::collections::VecDeque;

/// How far back it can be asked: scans may come late.
const KEPT: Span = Span::from_nanos(1_000_000_000);

/// The true pose at instants that go forward, but for a second: read as it is asked for, never held as a whole.
pub(super) struct TruthNear<'r> {
    truths: Truths<'r>,
    near: VecDeque<(Stamp, Pose)>,
}

impl<'r> TruthNear<'r> {
    pub(super) fn new(truths: Truths<'r>) -> Self {
        Self { truths, near: VecDeque::new() }
    }

    /// The true `world_from_head` at `stamp`; `None` where there is no truth, or no more.
    pub(super) fn at(&mut self, stamp: Stamp) -> Result<Option<Pose>, RecordingError> {
        while self.near.back().is_none_or(|(last, _)| *last < stamp) {
            match self.truths.next().transpose()? {
                Some(Truth::Head(at, pose)) => self.near.push_back((at, pose)),
                Some(Truth::Clock(..)) => {}
                None => return Ok(None),
            }
        }
        while self.near.front().is_some_and(|(first, _)| *first < stamp - KEPT) {
            self.near.pop_front();
        }
        let after = self.near.partition_point(|(at, _)| *at < stamp);
        let around = self.near.range(after.saturating_sub(1)..=after).copied();
        Ok(Trajectory::from_poses(around).unwrap_or_default().at(stamp))
    }
}
