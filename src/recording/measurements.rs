//! Reads a recording's measurements sequentially, without ground truth.

use crate::container::{ChannelId, Messages};
use crate::duplicates::DuplicateFilter;
use crate::message::point_times::{CloudTimes, PointTimes, RawCloud, TimedScan};
use crate::message::scan::Projector;
use crate::message::transforms::is_frame;
use crate::message::{imu, livox, multi_echo, points, scan};
use crate::pairing::ImuPairing;
use crate::selection::{ImuDecoding, ImuLayout, LidarDecoding, LidarKind};
use crate::stamp_screen::StampScreen;
use crate::stamp_sorter::StampSorter;
use crate::wire::{DecodeError, Decoder, Payload};
use crate::{Loss, Reader, RecordingError, Selection};
use zsim_base::measurement::{ImuSample, LidarScan, Measurement};
use zsim_base::time::{Span, Stamp};

/// Reads measurements in order of their stamps, independent of log times.
///
/// Half a second of measurements is queued for sorting, up to 30 s if one sensor is logged later than the other. Messages
/// with outlying stamps are dropped, and steps of the sensors' clocks removed; both are counted in [`loss`](Self::loss).
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
    selection: Selection,
    projector: Projector,
    scans: StampScreen<LidarScan>,
    samples: StampScreen<ImuSample>,
    /// Accelerations that have their own topic.
    accelerations: StampScreen<ImuSample>,
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
    pub fn decode(&self, message: Payload<'_>, projector: &mut Projector) -> Result<TimedScan, DecodeError> {
        let (stamp, planar) = match self.kind {
            LidarKind::Points => {
                let source = self.times.and_then(|times| times.source());
                return Ok(self.timed(points::decode(message, source, self.no_return_range_m)?));
            }
            LidarKind::Livox => return Ok(self.timed(livox::decode(message, self.no_return_range_m)?)),
            LidarKind::Scan => scan::decode(message)?,
            LidarKind::MultiEcho => multi_echo::decode(message)?,
        };
        let scan = projector.project(stamp, planar, self.no_return_range_m);
        Ok(TimedScan { scan, impossible_times: 0 })
    }

    /// Converts the times of a cloud; without times of the lidar they are detected from this cloud.
    fn timed(&self, cloud: RawCloud) -> TimedScan {
        let of_cloud = || Some(PointTimes::detect(&[CloudTimes::of(&cloud)?])?.0);
        let times = self.times.or_else(of_cloud).unwrap_or(PointTimes::AtStamp);
        times.scan(cloud)
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
            let log = Stamp::from_nanos(i64::try_from(message.log_time_ns).unwrap_or(i64::MAX));
            self.decoder.take(role, Some(log), message.data, &mut self.sorter, &mut self.loss);
            return Ok(true);
        }
    }
}

impl MeasurementDecoder {
    pub(super) fn new(selection: &Selection) -> Self {
        Self {
            selection: selection.clone(),
            projector: Projector::default(),
            scans: StampScreen::default(),
            samples: StampScreen::default(),
            accelerations: StampScreen::default(),
            pairing: ImuPairing::default(),
        }
    }

    /// Decodes a message logged at `log` and queues the measurements that are no longer in doubt.
    ///
    /// Without log times no steps of the clocks are removed. A message that is not usable is counted in `loss`.
    pub(super) fn take(
        &mut self,
        role: Role,
        log: Option<Stamp>,
        message: Payload<'_>,
        sorter: &mut StampSorter,
        loss: &mut Loss,
    ) {
        if let Some((topic, frame)) = self.other_frame(role, message) {
            return loss.add_other_frame(topic, frame);
        }
        if role == Role::Lidar {
            match self.selection.lidar.decode(message, &mut self.projector) {
                Ok(timed) => {
                    loss.impossible_point_times += timed.impossible_times;
                    self.scan(log, timed.scan, sorter);
                }
                Err(_) => loss.unreadable_messages += 1,
            }
        } else {
            match imu::decode(message, self.selection.imu.unit) {
                Ok(sample) if !imu::is_finite(&sample) => loss.samples_not_finite += 1,
                Ok(sample) => self.sample(log, sample, role == Role::Imu, sorter),
                Err(_) => loss.unreadable_messages += 1,
            }
        }
        self.report(loss);
    }

    /// Topic and frame of a message that has another frame than its sensor.
    fn other_frame<'m>(&self, role: Role, message: Payload<'m>) -> Option<(&str, &'m str)> {
        let Selection { lidar_topic, lidar_frame, imu_topic, imu_frame, imu, .. } = &self.selection;
        let (topic, expected) = match role {
            Role::Lidar => (lidar_topic, lidar_frame),
            Role::Imu if imu.layout == ImuLayout::Combined => (imu_topic, imu_frame),
            // Gyroscope and accelerometer may have frames of their own.
            Role::Imu | Role::Acceleration => return None,
        };
        let (_, frame) = Decoder::new(message).and_then(|mut input| input.header()).ok()?;
        (!is_frame(frame, expected)).then_some((topic, frame))
    }

    fn scan(&mut self, log: Option<Stamp>, scan: LidarScan, sorter: &mut StampSorter) {
        let other = self.samples.steps.last().copied();
        let header = scan.stamp + scan.stamped_after;
        self.scans.push((log.unwrap_or(header), header), scan, other, &mut |scan, shift| put_scan(scan, shift, sorter));
    }

    /// Takes a sample of the IMU topic (`is_imu`) or of the acceleration topic.
    fn sample(&mut self, log: Option<Stamp>, sample: ImuSample, is_imu: bool, sorter: &mut StampSorter) {
        let Self { selection, pairing, scans, samples, accelerations, .. } = self;
        let screen = if is_imu { samples } else { accelerations };
        let other = scans.steps.last().copied();
        let mut accept = |sample, shift| put_sample(sample, shift, is_imu, &selection.imu, pairing, sorter);
        screen.push((log.unwrap_or(sample.stamp), sample.stamp), sample, other, &mut accept);
    }

    /// Writes the counts of outliers and the steps to `loss`.
    fn report(&self, loss: &mut Loss) {
        loss.outlying_stamps = self.scans.outliers + self.samples.outliers + self.accelerations.outliers;
        if self.scans.steps.len() + self.samples.steps.len() != loss.clock_steps.len() {
            let Selection { lidar_topic, imu_topic, imu, .. } = &self.selection;
            let steps = self.scans.clock_steps(lidar_topic, Span::ZERO);
            loss.clock_steps = steps.chain(self.samples.clock_steps(imu_topic, imu.shift)).collect();
        }
    }

    /// Queues the remaining measurements.
    fn finish(&mut self, sorter: &mut StampSorter, loss: &mut Loss) {
        let Self { selection, pairing, scans, samples, accelerations, .. } = self;
        scans.finish(&mut |scan, shift| put_scan(scan, shift, sorter));
        for (screen, is_imu) in [(samples, true), (accelerations, false)] {
            screen.finish(&mut |sample, shift| put_sample(sample, shift, is_imu, &selection.imu, pairing, sorter));
        }
        if let ImuLayout::Separate { max_separation, .. } = &selection.imu.layout {
            while let Some(pair) = pairing.take(*max_separation, true) {
                sorter.put(Measurement::Imu(pair));
            }
        }
        self.report(loss);
    }
}

fn put_scan(scan: LidarScan, shift: Span, sorter: &mut StampSorter) {
    sorter.put(Measurement::Lidar(LidarScan { stamp: scan.stamp - shift, ..scan }));
}

/// Queues a sample of the IMU topic (`is_imu`) or of the acceleration topic, or the pairs that it completes.
fn put_sample(
    mut sample: ImuSample,
    shift: Span,
    is_imu: bool,
    decoding: &ImuDecoding,
    pairing: &mut ImuPairing,
    sorter: &mut StampSorter,
) {
    sample.stamp = sample.stamp - shift + decoding.shift;
    let ImuLayout::Separate { acceleration_topic, max_separation } = &decoding.layout else {
        return sorter.put(Measurement::Imu(sample));
    };
    let (rate, force) = (sample.angular_velocity_rad_per_s, sample.specific_force_m_per_s2);
    let in_one_topic = acceleration_topic.is_none();
    if is_imu && rate.iter().any(|x| *x != 0.0) {
        pairing.put_rate(sample.stamp, rate);
    }
    if (in_one_topic || !is_imu) && force.iter().any(|x| *x != 0.0) {
        pairing.put_force(sample.stamp, force);
    }
    while let Some(pair) = pairing.take(*max_separation, false) {
        sorter.put(Measurement::Imu(pair));
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
                    self.decoder.finish(&mut self.sorter, &mut self.loss);
                }
                Err(error) => {
                    self.ended = true;
                    return Some(Err(error));
                }
            }
        }
    }
}
