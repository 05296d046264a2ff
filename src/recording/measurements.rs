//! Reads a recording's measurements sequentially, without ground truth.

use crate::container::{ChannelId, Messages};
use crate::duplicates::DuplicateFilter;
use crate::message::scan::Projector;
use crate::message::{imu, livox, multi_echo, points, scan};
use crate::pairing::ImuPairing;
use crate::selection::{ImuDecoding, ImuLayout, LidarDecoding, LidarKind};
use crate::stamp_sorter::StampSorter;
use crate::wire::{DecodeError, Payload};
use crate::{Loss, Reader, RecordingError, Selection};
use zsim_base::measurement::{ImuSample, LidarScan, Measurement};

/// Reads measurements in order of their stamps, independent of log times.
///
/// Half a second of measurements is queued for sorting, up to 30 s if one sensor is logged later than the other.
///
/// An item is an error only if the file cannot be read further. Unusable messages are skipped and counted in
/// [`loss`](Self::loss), and so are duplicates.
pub struct Measurements<'r> {
    messages: Messages<'r>,
    lidar: Vec<ChannelId>,
    imu: Vec<ChannelId>,
    /// Channels of the accelerations, if they have their own topic.
    accelerations: Vec<ChannelId>,
    decoder: MeasurementDecoder,
    loss: Loss,
    expected: Option<u64>,
    sorter: StampSorter,
    duplicates: DuplicateFilter,
    ended: bool,
}

/// Sensor of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    Lidar,
    Imu,
    /// Accelerations that have their own topic.
    Acceleration,
}

/// Converts messages to measurements.
pub(super) struct MeasurementDecoder {
    lidar: LidarDecoding,
    imu: ImuDecoding,
    projector: Projector,
    pairing: ImuPairing,
}

impl Reader {
    /// Reads the measurements of the selected sensors, in order of their stamps.
    pub fn measurements(&self, selection: &Selection) -> Measurements<'_> {
        let accelerations = selection.acceleration_topic().map_or_else(Vec::new, |topic| self.ids_of(topic));
        Measurements {
            messages: self.messages(),
            lidar: self.ids_of(&selection.lidar_topic),
            imu: self.ids_of(&selection.imu_topic),
            accelerations,
            decoder: MeasurementDecoder::new(selection),
            loss: self.loss().clone(),
            expected: self.expected_messages(),
            sorter: StampSorter::default(),
            duplicates: DuplicateFilter::default(),
            ended: false,
        }
    }
}

impl LidarDecoding {
    /// Decodes a scan.
    ///
    /// # Errors
    /// When the bytes do not match the lidar's message type.
    pub fn decode(&self, message: Payload<'_>, projector: &mut Projector) -> Result<LidarScan, DecodeError> {
        let (stamp, planar) = match self.kind {
            LidarKind::Points => return points::decode(message, self.time_unit, self.no_return_range_m),
            LidarKind::Livox => return livox::decode(message, self.no_return_range_m),
            LidarKind::Scan => scan::decode(message)?,
            LidarKind::MultiEcho => multi_echo::decode(message)?,
        };
        Ok(projector.project(stamp, planar, self.no_return_range_m))
    }
}

impl Measurements<'_> {
    /// Data lost so far, the damage of the file included.
    pub fn loss(&self) -> &Loss {
        &self.loss
    }

    /// Reads one message of the sensors and queues its measurement, if it has one; `false` at the end of the recording.
    fn step(&mut self) -> Result<bool, RecordingError> {
        loop {
            let Some(message) = self.messages.next()? else {
                self.loss.add_pass(&self.messages, self.expected);
                return Ok(false);
            };
            let role = if self.imu.contains(&message.channel) {
                Role::Imu
            } else if self.accelerations.contains(&message.channel) {
                Role::Acceleration
            } else if self.lidar.contains(&message.channel) {
                Role::Lidar
            } else {
                continue;
            };
            self.decoder.take(role, message.data, &mut self.sorter, &mut self.loss);
            return Ok(true);
        }
    }
}

impl MeasurementDecoder {
    pub(super) fn new(selection: &Selection) -> Self {
        Self {
            lidar: selection.lidar,
            imu: selection.imu.clone(),
            projector: Projector::default(),
            pairing: ImuPairing::default(),
        }
    }

    /// Decodes a message and queues its measurement; a message that is not usable is counted.
    pub(super) fn take(&mut self, role: Role, message: Payload<'_>, sorter: &mut StampSorter, loss: &mut Loss) {
        if role == Role::Lidar {
            match self.lidar.decode(message, &mut self.projector) {
                Ok(scan) => sorter.put(Measurement::Lidar(scan)),
                Err(_) => loss.unreadable_messages += 1,
            }
            return;
        }
        match imu::decode(message, self.imu.unit) {
            Ok(sample) if !imu::is_finite(&sample) => loss.samples_not_finite += 1,
            Ok(sample) => self.imu_sample(sample, role == Role::Imu, sorter),
            Err(_) => loss.unreadable_messages += 1,
        }
    }

    /// Processes a message of the IMU topic (`is_imu`) or of the acceleration topic.
    fn imu_sample(&mut self, mut sample: ImuSample, is_imu: bool, sorter: &mut StampSorter) {
        sample.stamp += self.imu.shift;
        let ImuLayout::Separate { acceleration_topic, max_separation } = &self.imu.layout else {
            return sorter.put(Measurement::Imu(sample));
        };
        let (rate, force) = (sample.angular_velocity_rad_per_s, sample.specific_force_m_per_s2);
        let in_one_topic = acceleration_topic.is_none();
        if is_imu && rate.iter().any(|x| *x != 0.0) {
            self.pairing.put_rate(sample.stamp, rate);
        }
        if (in_one_topic || !is_imu) && force.iter().any(|x| *x != 0.0) {
            self.pairing.put_force(sample.stamp, force);
        }
        while let Some(pair) = self.pairing.take(*max_separation, false) {
            sorter.put(Measurement::Imu(pair));
        }
    }

    /// Queues the remaining pairs.
    fn finish(&mut self, sorter: &mut StampSorter) {
        if let ImuLayout::Separate { max_separation, .. } = &self.imu.layout {
            while let Some(pair) = self.pairing.take(*max_separation, true) {
                sorter.put(Measurement::Imu(pair));
            }
        }
    }
}

impl Iterator for Measurements<'_> {
    type Item = Result<Measurement, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(measurement) = self.sorter.take(self.ended) {
                if self.duplicates.is_new(&measurement) {
                    return Some(Ok(measurement));
                }
                (self.loss.repeated_scans, self.loss.repeated_samples) =
                    (self.duplicates.scans, self.duplicates.samples);
                continue;
            }
            if self.ended {
                return None;
            }
            match self.step() {
                Ok(true) => {}
                Ok(false) => {
                    self.ended = true;
                    self.decoder.finish(&mut self.sorter);
                }
                Err(error) => {
                    self.ended = true;
                    return Some(Err(error));
                }
            }
        }
    }
}
