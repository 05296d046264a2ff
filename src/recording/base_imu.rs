//! The IMU on the base, for those who tell where the base was.

use crate::geometry::Pose;
use crate::measurement::ImuSample;
use crate::recording::measurements::is_finite;
use crate::recording::message::imu;
use crate::recording::schema::MessageType;
use crate::recording::selection::imu_candidate;
use crate::recording::topics::{BASE, Topic};
use crate::recording::{Loss, Reader, RecordingError};

/// What the IMU on the base said.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseImuRecord {
    /// Its samples in the order of their log time, on its own clock.
    pub samples: Vec<ImuSample>,
    /// Its pose in the frame `base`, where `/tf_static` tells it.
    pub base_from_imu: Option<Pose>,
    /// What could not be read.
    pub loss: Loss,
}

impl Reader {
    /// All that the IMU on the base said on `topic` (`/base/imu` for `None`), in memory: 56 bytes a sample.
    ///
    /// # Errors
    /// When the file cannot be read, or has no such topic of an IMU.
    pub fn base_imu(&self, topic: Option<&str>) -> Result<BaseImuRecord, RecordingError> {
        let topic = topic.unwrap_or(Topic::BaseImu.name());
        let found = self.candidates(&[MessageType::Imu], Some(topic), imu_candidate)?;
        let frame = found.found.first().map_or("", |candidate| candidate.frame.as_str());
        let base_from_imu = self.frames()?.target_from_source(BASE, frame);
        let unit = found.found.first().map(|candidate| self.force_unit(candidate)).transpose()?.unwrap_or_default();
        let (ids, mut loss) = (self.ids_of(topic), self.loss().clone());
        let (mut samples, mut messages) = (Vec::new(), self.messages());
        while let Some(message) = messages.next()? {
            if !ids.contains(&message.channel) {
                continue;
            }
            match imu::decode(message.data, unit) {
                Ok(sample) if !is_finite(&sample) => loss.samples_not_finite += 1,
                Ok(sample) => samples.push(sample),
                Err(_) => loss.unreadable_messages += 1,
            }
        }
        loss.add_pass(&messages, self.expected_messages());
        Ok(BaseImuRecord { samples, base_from_imu, loss })
    }
}
