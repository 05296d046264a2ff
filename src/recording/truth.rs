//! Reads the ground truth of a recording: for evaluation only, never for the estimator.

use crate::container::{ChannelId, Messages, RawMessage};
use crate::message::{clock, pose};
use crate::stamp_screen::StampScreen;
use crate::topics::Topic;
use crate::{Loss, Reader, RecordingError};
use std::collections::VecDeque;
use zsim_base::geometry::{Pose, Trajectory};
use zsim_base::time::Stamp;
use zsim_truth::ClockTruth;

/// One item of ground truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Truth {
    /// Pose of the head, at a time on the lidar's clock.
    Head(Stamp, Pose),
    /// Pose of the base that carries the spring, at a time on the lidar's clock.
    Base(Stamp, Pose),
    /// Clock errors, at a true time.
    Clock(Stamp, ClockTruth),
}

/// Reads ground truth in the order in which it was written, without the steps of the lidar's clock.
pub struct TruthReader<'r> {
    messages: Messages<'r>,
    heads: Vec<ChannelId>,
    bases: Vec<ChannelId>,
    clocks: Vec<ChannelId>,
    lidar: Option<clock::ClockReading<'static>>,
    head_stamps: StampScreen<(Stamp, Pose)>,
    base_stamps: StampScreen<(Stamp, Pose)>,
    ready: VecDeque<Truth>,
    loss: Loss,
    expected: Option<u64>,
    /// Whether all messages are read.
    at_end: bool,
    ended: bool,
}

impl Reader {
    /// Reads the ground truth under `/ground_truth/`; empty for a recording of real sensors.
    pub fn truth(&self) -> TruthReader<'_> {
        let ids = |topic: Topic| self.ids_of(topic.name());
        let (heads, bases, clocks) = (ids(Topic::TruthPose), ids(Topic::TruthBase), ids(Topic::TruthClock));
        TruthReader {
            messages: self.messages(),
            ended: heads.is_empty() && bases.is_empty() && clocks.is_empty(),
            heads,
            bases,
            clocks,
            lidar: None,
            head_stamps: StampScreen::default(),
            base_stamps: StampScreen::default(),
            ready: VecDeque::new(),
            loss: self.loss().clone(),
            expected: self.expected_messages(),
            at_end: false,
        }
    }

    /// Reads the head's true trajectory in lidar time into memory.
    ///
    /// # Errors
    /// When the file cannot be read, or the stamps do not increase.
    pub fn truth_trajectory(&self) -> Result<Trajectory, RecordingError> {
        let mut trajectory = Trajectory::new();
        for truth in self.truth() {
            if let Truth::Head(stamp, pose) = truth? {
                let name = format!("{} {}", self.name(), Topic::TruthPose.name());
                trajectory.push(stamp, pose).map_err(|source| RecordingError::Trajectory { name, source })?;
            }
        }
        Ok(trajectory)
    }
}

impl TruthReader<'_> {
    /// Data lost so far, the damage of the file included.
    pub fn loss(&self) -> &Loss {
        &self.loss
    }

    fn next_truth(&mut self) -> Result<Option<Truth>, RecordingError> {
        while self.ready.is_empty() && !self.at_end {
            self.step()?;
        }
        Ok(self.ready.pop_front())
    }

    /// Reads a message and adds the truths that are no longer in doubt to `ready`.
    fn step(&mut self) -> Result<(), RecordingError> {
        let Self { ready, head_stamps, base_stamps, .. } = self;
        let Some(message) = self.messages.next()? else {
            head_stamps.finish(&mut |(stamp, pose), shift| ready.push_back(Truth::Head(stamp - shift, pose)));
            base_stamps.finish(&mut |(stamp, pose), shift| ready.push_back(Truth::Base(stamp - shift, pose)));
            self.loss.add_pass(&self.messages, self.expected);
            self.at_end = true;
            return Ok(());
        };
        let log = Stamp::from_nanos(i64::try_from(message.log_time_ns).unwrap_or(i64::MAX));
        let is_read = if self.heads.contains(&message.channel) {
            let accept = &mut |(stamp, pose), shift| ready.push_back(Truth::Head(stamp - shift, pose));
            pose::decode(message.data).map(|read| head_stamps.push((log, read.0), read, None, accept)).is_ok()
        } else if self.bases.contains(&message.channel) {
            let accept = &mut |(stamp, pose), shift| ready.push_back(Truth::Base(stamp - shift, pose));
            pose::decode(message.data).map(|read| base_stamps.push((log, read.0), read, None, accept)).is_ok()
        } else if self.clocks.contains(&message.channel) {
            pair(&mut self.lidar, &message).map(|clock| ready.extend(clock)).is_some()
        } else {
            true
        };
        self.loss.unreadable_messages += u64::from(!is_read);
        Ok(())
    }
}

/// Combines the reading of the IMU's clock with the preceding reading of the lidar's.
fn pair(lidar: &mut Option<clock::ClockReading<'static>>, message: &RawMessage<'_>) -> Option<Option<Truth>> {
    let reading = clock::decode(message.data).ok()?;
    match (reading.source, lidar.take()) {
        ("lidar", _) => {
            *lidar = Some(clock::ClockReading { source: "lidar", ..reading });
            Some(None)
        }
        ("imu", Some(before)) if before.now == reading.now => {
            let clock = ClockTruth {
                lidar_offset: before.clock_time - before.now,
                imu_offset: reading.clock_time - reading.now,
            };
            Some(Some(Truth::Clock(reading.now, clock)))
        }
        _ => None,
    }
}

impl Iterator for TruthReader<'_> {
    type Item = Result<Truth, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            return None;
        }
        let item = self.next_truth().transpose();
        self.ended = !matches!(item, Some(Ok(_)));
        item
    }
}
