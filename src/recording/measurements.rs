//! A recording's measurements, one after the other, without its truth.

use crate::measurement::{ImuSample, LidarScan, Measurement};
use crate::recording::container::{ChannelId, Messages, RawMessage};
use crate::recording::message::scan::Projector;
use crate::recording::message::{imu, livox, multi_echo, points, scan};
use crate::recording::order::InOrder;
use crate::recording::pairing::Pairing;
use crate::recording::repeats::Repeats;
use crate::recording::selection::{ImuReading, Layout, LidarKind, LidarReading};
use crate::recording::wire::DecodeError;
use crate::recording::{Loss, Reader, RecordingError, Selection};

/// Reads measurements in the order of their stamps, whenever they were logged: half a second of them waits for its
/// turn, and where one of the sensors lags behind the other as much as thirty.
///
/// An item is an error only where the file cannot be read on. Messages that cannot be used are left out and counted in
/// [`loss`](Self::loss); so are those that repeat the one before.
pub struct Measurements<'r> {
    messages: Messages<'r>,
    lidar: Vec<ChannelId>,
    imu: Vec<ChannelId>,
    /// Where accelerations are, where that is another topic.
    accelerations: Vec<ChannelId>,
    decoding: Decoding,
    loss: Loss,
    expected: Option<u64>,
    order: InOrder,
    repeats: Repeats,
    ended: bool,
}

/// How messages become measurements.
struct Decoding {
    lidar: LidarReading,
    imu: ImuReading,
    projector: Projector,
    pairing: Pairing,
}

impl Reader {
    /// The measurements of the selected sensors, in the order of their stamps.
    pub fn measurements(&self, selection: &Selection) -> Measurements<'_> {
        let accelerations = match &selection.imu.layout {
            Layout::Separate { acceleration_topic: Some(topic), .. } => self.ids_of(topic),
            _ => Vec::new(),
        };
        Measurements {
            messages: self.messages(),
            lidar: self.ids_of(&selection.lidar_topic),
            imu: self.ids_of(&selection.imu_topic),
            accelerations,
            decoding: Decoding {
                lidar: selection.lidar,
                imu: selection.imu.clone(),
                projector: Projector::default(),
                pairing: Pairing::default(),
            },
            loss: self.loss().clone(),
            expected: self.expected_messages(),
            order: InOrder::default(),
            repeats: Repeats::default(),
            ended: false,
        }
    }
}

impl LidarReading {
    /// Reads a scan.
    ///
    /// # Errors
    /// When the bytes are not what the lidar's type says.
    pub fn decode(&self, message: &RawMessage<'_>, projector: &mut Projector) -> Result<LidarScan, DecodeError> {
        let (stamp, planar) = match self.kind {
            LidarKind::Points => return points::decode(message.data, self.point_times, self.farthest_m),
            LidarKind::Livox => return livox::decode(message.data, self.farthest_m),
            LidarKind::Scan => scan::decode(message.data)?,
            LidarKind::MultiEcho => multi_echo::decode(message.data)?,
        };
        Ok(projector.project(stamp, planar, self.farthest_m))
    }
}

impl Measurements<'_> {
    /// What could not be read so far, the file's own loss with it.
    pub fn loss(&self) -> &Loss {
        &self.loss
    }

    /// Reads one message of the sensors, and hands what it makes to the order; `false` after the last.
    fn step(&mut self) -> Result<bool, RecordingError> {
        loop {
            let Some(message) = self.messages.next()? else {
                self.loss.add_pass(&self.messages, self.expected);
                return Ok(false);
            };
            let is_imu = self.imu.contains(&message.channel);
            if is_imu || self.accelerations.contains(&message.channel) {
                match imu::decode(message.data, self.decoding.imu.unit) {
                    Ok(sample) if !is_finite(&sample) => self.loss.samples_not_finite += 1,
                    Ok(sample) => self.decoding.imu_sample(sample, is_imu, &mut self.order),
                    Err(_) => self.loss.unreadable_messages += 1,
                }
            } else if self.lidar.contains(&message.channel) {
                match self.decoding.lidar.decode(&message, &mut self.decoding.projector) {
                    Ok(scan) => self.order.put(Measurement::Lidar(scan)),
                    Err(_) => self.loss.unreadable_messages += 1,
                }
            } else {
                continue;
            }
            return Ok(true);
        }
    }
}

impl Decoding {
    /// Takes a message of the IMU (`is_imu`), or of the topic of its accelerations.
    fn imu_sample(&mut self, mut sample: ImuSample, is_imu: bool, order: &mut InOrder) {
        sample.stamp += self.imu.shift;
        let Layout::Separate { acceleration_topic, apart } = &self.imu.layout else {
            return order.put(Measurement::Imu(sample));
        };
        let (rate, force) = (sample.angular_velocity_rad_per_s, sample.specific_force_m_per_s2);
        let in_one_topic = acceleration_topic.is_none();
        if is_imu && rate.iter().any(|x| *x != 0.0) {
            self.pairing.put_rate(sample.stamp, rate);
        }
        if (in_one_topic || !is_imu) && force.iter().any(|x| *x != 0.0) {
            self.pairing.put_force(sample.stamp, force);
        }
        while let Some(pair) = self.pairing.take(*apart, false) {
            order.put(Measurement::Imu(pair));
        }
    }

    /// Hands on the pairs that are left.
    fn finish(&mut self, order: &mut InOrder) {
        if let Layout::Separate { apart, .. } = &self.imu.layout {
            while let Some(pair) = self.pairing.take(*apart, true) {
                order.put(Measurement::Imu(pair));
            }
        }
    }
}

pub(super) fn is_finite(sample: &ImuSample) -> bool {
    let numbers = sample.angular_velocity_rad_per_s.iter().chain(sample.specific_force_m_per_s2.iter());
    numbers.into_iter().all(|x| x.is_finite())
}

impl Iterator for Measurements<'_> {
    type Item = Result<Measurement, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(measurement) = self.order.take(self.ended) {
                if self.repeats.is_new(&measurement) {
                    return Some(Ok(measurement));
                }
                (self.loss.repeated_scans, self.loss.repeated_samples) = (self.repeats.scans, self.repeats.samples);
                continue;
            }
            if self.ended {
                return None;
            }
            match self.step() {
                Ok(true) => {}
                Ok(false) => {
                    self.ended = true;
                    self.decoding.finish(&mut self.order);
                }
                Err(error) => {
                    self.ended = true;
                    return Some(Err(error));
                }
            }
        }
    }
}
