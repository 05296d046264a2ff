//! Measurements from messages that arrive one after another, as on a running robot.

use crate::duplicates::DuplicateFilter;
use crate::measurements::{MeasurementDecoder, Role};
use crate::stamp_sorter::StampSorter;
use crate::wire::{Payload, WireFormat};
use crate::{Loss, Selection};
use zsim_base::measurement::Measurement;

/// Decodes the messages of the selected sensors as they arrive.
///
/// Unlike [`super::Measurements`] it does not wait in order to sort by stamps: the estimator sorts measurements that arrive
/// up to 0.1 s too late. Nor does it remove steps of the clocks: a recording that is played again begins with a step back.
pub struct Incoming {
    lidar_topic: String,
    imu_topic: String,
    acceleration_topic: Option<String>,
    decoder: MeasurementDecoder,
    sorter: StampSorter,
    duplicates: DuplicateFilter,
    loss: Loss,
}

impl Incoming {
    /// Decodes the messages of the sensors of `selection`.
    pub fn new(selection: &Selection) -> Self {
        Self {
            lidar_topic: selection.lidar_topic.clone(),
            imu_topic: selection.imu_topic.clone(),
            acceleration_topic: selection.acceleration_topic().map(str::to_owned),
            decoder: MeasurementDecoder::new(selection),
            sorter: StampSorter::default(),
            duplicates: DuplicateFilter::default(),
            loss: Loss::default(),
        }
    }

    /// The measurements that the CDR `message` of `topic` completes: none if the topic is not that of a sensor, the message
    /// is not usable, or the measurement is a duplicate.
    pub fn message(&mut self, topic: &str, message: &[u8]) -> Vec<Measurement> {
        let role = if topic == self.lidar_topic {
            Role::Lidar
        } else if topic == self.imu_topic {
            Role::Imu
        } else if Some(topic) == self.acceleration_topic.as_deref() {
            Role::Acceleration
        } else {
            return Vec::new();
        };
        let payload = Payload { bytes: message, wire: WireFormat::Cdr };
        self.decoder.take(role, None, payload, &mut self.sorter, &mut self.loss);
        let decoded = std::iter::from_fn(|| self.sorter.take(true));
        let new = decoded.filter(|measurement| self.duplicates.is_new(measurement)).collect();
        (self.loss.repeated_scans, self.loss.repeated_samples) = (self.duplicates.scans, self.duplicates.samples);
        new
    }

    /// Messages that were not usable so far, and duplicates.
    pub fn loss(&self) -> &Loss {
        &self.loss
    }
}
