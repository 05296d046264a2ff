//! A recording's measurements, one after the other, without its truth.

use crate::measurement::{ImuSample, LidarScan, Measurement};
use crate::recording::wire::DecodeError;
use crate::recording::container::{ChannelId, Messages, RawMessage};
use crate::recording::message::scan::Projector;
use crate::recording::message::{imu, points, scan};
use crate::recording::order::InOrder;
use crate::recording::selection::LidarKind;
use crate::recording::{Loss, Reader, RecordingError, Selection};

/// Reads measurements in the order of their stamps, whenever they were logged: half a second of them waits for its
/// turn, and where one of the sensors lags behind the other as much as thirty.
///
/// An item is an error only where the file cannot be read on. Messages that cannot be used are left out and counted in
/// [`loss`](Self::loss).
pub struct Measurements<'r> {
    messages: Messages<'r>,
    lidar: Vec<ChannelId>,
    lidar_kind: LidarKind,
    point_times: Option<points::Unit>,
    imu: Vec<ChannelId>,
    force_unit: imu::ForceUnit,
    projector: Projector,
    loss: Loss,
    expected: Option<u64>,
    order: InOrder,
    ended: bool,
}

impl Reader {
    /// The measurements of the selected sensors, in the order of their stamps.
    pub fn measurements(&self, selection: &Selection) -> Measurements<'_> {
        Measurements {
            messages: self.messages(),
            lidar: self.ids_of(&selection.lidar_topic),
            lidar_kind: selection.lidar_kind,
            point_times: selection.point_times,
            imu: self.ids_of(&selection.imu_topic),
            force_unit: selection.force_unit,
            projector: Projector::default(),
            loss: self.loss().clone(),
            expected: self.expected_messages(),
            order: InOrder::default(),
            ended: false,
        }
    }
}

impl Measurements<'_> {
    /// What could not be read so far, the file's own loss with it.
    pub fn loss(&self) -> &Loss {
        &self.loss
    }

    fn next_measurement(&mut self) -> Result<Option<Measurement>, RecordingError> {
        loop {
            let message = self.messages.next()?;
            let Some(message) = message else {
                self.loss.add_pass(&self.messages, self.expected);
                return Ok(None);
            };
            let decoded = if self.imu.contains(&message.channel) {
                imu::decode(message.data, self.force_unit).map(Measurement::Imu)
            } else if self.lidar.contains(&message.channel) {
                lidar((self.lidar_kind, self.point_times), &mut self.projector, &message).map(Measurement::Lidar)
            } else {
                continue;
            };
            match decoded {
                Ok(Measurement::Imu(sample)) if !is_finite(&sample) => self.loss.samples_not_finite += 1,
                Ok(measurement) => return Ok(Some(measurement)),
                Err(_) => self.loss.unreadable_messages += 1,
            }
        }
    }
}

fn lidar(
    (kind, point_times): (LidarKind, Option<points::Unit>),
    projector: &mut Projector,
    message: &RawMessage<'_>,
) -> Result<LidarScan, DecodeError> {
    match kind {
        LidarKind::Points => points::decode(message.data, point_times),
        LidarKind::Scan => scan::decode(message.data).map(|(stamp, planar)| projector.project(stamp, planar)),
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
                return Some(Ok(measurement));
            }
            if self.ended {
                return None;
            }
            match self.next_measurement().transpose() {
                Some(Ok(measurement)) => self.order.put(measurement),
                Some(Err(error)) => {
                    self.ended = true;
                    return Some(Err(error));
                }
                None => self.ended = true,
            }
        }
    }
}
