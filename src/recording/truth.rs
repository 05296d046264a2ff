//! A recording's truth: only for those who judge an estimate, never for the estimator.

use crate::geometry::{Pose, Trajectory};
use crate::recording::container::{ChannelId, Messages, RawMessage};
use crate::recording::message::{clock, pose};
use crate::recording::topics::Topic;
use crate::recording::{Loss, Reader, RecordingError};
use crate::time::Stamp;
use crate::truth::ClockTruth;

/// Something true at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Truth {
    /// Where the head was, at a time on the lidar's clock.
    Head(Stamp, Pose),
    /// Where the base that carries it was, at a time on the lidar's clock.
    Base(Stamp, Pose),
    /// What the clocks said, at a true time.
    Clock(Stamp, ClockTruth),
}

/// Reads the truth in the order in which it was written.
pub struct Truths<'r> {
    messages: Messages<'r>,
    heads: Vec<ChannelId>,
    bases: Vec<ChannelId>,
    clocks: Vec<ChannelId>,
    lidar: Option<clock::Reading<'static>>,
    loss: Loss,
    expected: Option<u64>,
    ended: bool,
}

impl Reader {
    /// The truth under `/ground_truth/`; nothing in a recording of the real world.
    pub fn truth(&self) -> Truths<'_> {
        let ids = |topic: Topic| self.ids_of(topic.name());
        let (heads, bases, clocks) = (ids(Topic::TruthPose), ids(Topic::TruthBase), ids(Topic::TruthClock));
        Truths {
            messages: self.messages(),
            ended: heads.is_empty() && bases.is_empty() && clocks.is_empty(),
            heads,
            bases,
            clocks,
            lidar: None,
            loss: self.loss().clone(),
            expected: self.expected_messages(),
        }
    }

    /// The head's true trajectory in lidar time, all of it in memory.
    ///
    /// # Errors
    /// When the file cannot be read, or its stamps do not increase.
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

impl Truths<'_> {
    /// What could not be read so far, the file's own loss with it.
    pub fn loss(&self) -> &Loss {
        &self.loss
    }

    fn next_truth(&mut self) -> Result<Option<Truth>, RecordingError> {
        loop {
            let Some(message) = self.messages.next()? else {
                self.loss.add_pass(&self.messages, self.expected);
                return Ok(None);
            };
            let posed = |truth: fn(Stamp, Pose) -> Truth| {
                pose::decode(message.data).map(|(stamp, pose)| Some(truth(stamp, pose))).ok()
            };
            let read = if self.heads.contains(&message.channel) {
                posed(Truth::Head)
            } else if self.bases.contains(&message.channel) {
                posed(Truth::Base)
            } else if self.clocks.contains(&message.channel) {
                pair(&mut self.lidar, &message)
            } else {
                continue;
            };
            match read {
                Some(Some(truth)) => return Ok(Some(truth)),
                Some(None) => {}
                None => self.loss.unreadable_messages += 1,
            }
        }
    }
}

/// Puts the reading of the IMU's clock together with that of the lidar's before it.
fn pair(lidar: &mut Option<clock::Reading<'static>>, message: &RawMessage<'_>) -> Option<Option<Truth>> {
    let reading = clock::decode(message.data).ok()?;
    match (reading.source, lidar.take()) {
        ("lidar", _) => {
            *lidar = Some(clock::Reading { source: "lidar", ..reading });
            Some(None)
        }
        ("imu", Some(before)) if before.now == reading.now => {
            let clock = ClockTruth { lidar_ahead: before.says - before.now, imu_ahead: reading.says - reading.now };
            Some(Some(Truth::Clock(reading.now, clock)))
        }
        _ => None,
    }
}

impl Iterator for Truths<'_> {
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
