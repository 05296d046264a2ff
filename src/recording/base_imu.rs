//! Reads the IMU on the base, for the estimate of the base's motion.

use crate::message::imu;
use crate::schema::MessageType;
use crate::selection::probe_imu;
use crate::topics::{BASE, Topic};
use crate::{Loss, Reader, RecordingError};
use zsim_base::geometry::Pose;
use zsim_base::measurement::ImuSample;

/// Data of the IMU on the base.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseImuRecord {
    /// Samples in order of log time, stamped by this IMU's own clock.
    pub samples: Vec<ImuSample>,
    /// Pose of the IMU in the frame `base`, if `/tf_static` states it.
    pub base_from_imu: Option<Pose>,
    /// Data that could not be read.
    pub loss: Loss,
}

impl Reader {
    /// Reads all samples of the base's IMU on `topic` (default `/base/imu`) into memory: 56 bytes each.
    ///
    /// # Errors
    /// When the file cannot be read, or has no such IMU topic.
    pub fn base_imu(&self, topic: Option<&str>) -> Result<BaseImuRecord, RecordingError> {
        let topic = topic.unwrap_or(Topic::BaseImu.name());
        let candidates = self.candidates(&[MessageType::Imu], Some(topic), probe_imu)?;
        let frame = candidates.found.first().map_or("", |candidate| candidate.frame.as_str());
        let base_from_imu = self.frames()?.target_from_source(BASE, frame).map_err(|problem| {
            let problem = format!("the pose of the IMU {topic} is not known: {problem}");
            RecordingError::Frames { name: self.name().to_owned(), problem }
        })?;
        let unit =
            candidates.found.first().map(|candidate| self.force_unit(candidate)).transpose()?.unwrap_or_default();
        let (ids, mut loss) = (self.ids_of(topic), self.loss().clone());
        let (mut samples, mut messages) = (Vec::new(), self.messages());
        while let Some(message) = messages.next()? {
            if !ids.contains(&message.channel) {
                continue;
            }
            match imu::decode(message.data, unit) {
                Ok(sample) if !imu::is_finite(&sample) => loss.samples_not_finite += 1,
                Ok(sample) => samples.push(sample),
                Err(_) => loss.unreadable_messages += 1,
            }
        }
        loss.add_pass(&messages, self.expected_messages());
        Ok(BaseImuRecord { samples, base_from_imu, loss })
    }
}
