//! Selects the lidar and IMU topics of a recording and determines how to decode them.

mod candidates;
mod clocks;
mod cloud_preview;
mod content;
mod drivers;
mod imu_choice;
mod lidar_choice;
mod notes;
mod preview;
mod unused;

use crate::message::no_returns::NoReturnDetector;
use crate::message::point_times::PointTimes;
use crate::message::{imu, multi_echo, points, scan};
use crate::quantile::quantile;
use crate::schema::MessageType;
use crate::{Reader, RecordingError};
pub(super) use candidates::{Candidate, LidarKind, probe_imu};
pub(super) use imu_choice::ImuLayout;
use notes::Choice;
use preview::PREVIEW_MESSAGES;
pub use unused::UnusedTopic;
use zsim_base::time::Span;

/// Topics that the caller requests; topics not given are detected.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TopicPreference {
    /// Lidar topic.
    pub lidar_topic: Option<String>,
    /// IMU topic.
    pub imu_topic: Option<String>,
}

/// Topics from which measurements are read.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// Lidar topic.
    pub lidar_topic: String,
    /// Frame of the lidar's points.
    pub lidar_frame: String,
    /// IMU topic.
    pub imu_topic: String,
    /// Frame of the IMU's measurements.
    pub imu_frame: String,
    /// Choices among several topics and corrections of unusual encodings, one sentence each.
    pub notes: Vec<String>,
    /// Other topics with messages of these sensors.
    pub unused: Vec<UnusedTopic>,
    pub(super) lidar: LidarDecoding,
    pub(super) imu: ImuDecoding,
}

impl Selection {
    /// Offset added to the IMU's stamps to bring them to the lidar's epoch.
    ///
    /// Zero unless log times show that the clocks differ by more than 50 ms.
    pub fn imu_shift(&self) -> Span {
        self.imu.shift
    }

    /// Notes on topics with messages of a sensor that cannot be used, one sentence each.
    pub fn unusable_topics(&self) -> impl Iterator<Item = String> {
        self.unused.iter().filter(|unused| !unused.is_usable).map(|unused| format!("Not used: {unused}."))
    }

    /// Topic of the accelerations, if it is not that of the angular velocities.
    pub fn acceleration_topic(&self) -> Option<&str> {
        match &self.imu.layout {
            ImuLayout::Separate { acceleration_topic, .. } => acceleration_topic.as_deref(),
            ImuLayout::Combined => None,
        }
    }
}

/// How to decode a lidar's messages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LidarDecoding {
    /// Message encoding.
    pub kind: LidarKind,
    /// How to convert the times of points; `None` if the first clouds do not show it.
    pub times: Option<PointTimes>,
    /// Constant range that encodes beams without a return, m, if there is one.
    pub no_return_range_m: Option<f32>,
}

/// How to decode an IMU's messages.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ImuDecoding {
    /// Unit of specific force.
    pub unit: imu::ForceUnit,
    /// How messages form samples.
    pub layout: ImuLayout,
    /// Offset added to the stamps to bring them to the lidar's clock.
    pub shift: Span,
}

const LIDAR_TYPES: [MessageType; 5] = [
    MessageType::LaserScan,
    MessageType::MultiEchoLaserScan,
    MessageType::PointCloud2,
    MessageType::Livox,
    MessageType::Livox2,
];

/// Blocks of the recording in which beams without a return are counted, and messages per block.
const NO_RETURN_BLOCKS: usize = 24;
const NO_RETURN_MESSAGES: usize = 4;

impl Reader {
    /// Selects the lidar and the IMU.
    ///
    /// If there is a `/tf_static`, a lidar that it connects to the IMU is preferred. Then a planar scan with stated
    /// beam times is preferred, then a cloud with point times, then the first topic by name. The recording's own ground
    /// truth is never a candidate.
    ///
    /// # Errors
    /// When no lidar or no IMU can be decoded, a requested topic is missing, or the IMU lacks rates or accelerations.
    pub fn select(&self, topics: &TopicPreference) -> Result<Selection, RecordingError> {
        let lidars = self.candidates(&LIDAR_TYPES, topics.lidar_topic.as_deref(), candidates::probe_lidar)?;
        let requested = topics.imu_topic.as_deref();
        let imus = self.candidates(&[MessageType::Imu], requested, probe_imu)?;
        let others = match requested {
            Some(_) => self.candidates(&[MessageType::Imu], None, probe_imu)?.found,
            None => Vec::new(),
        };
        let all_imus = if requested.is_some() { &others } else { &imus.found };
        let imu = self.choose_imu(&imus.found, all_imus)?;
        let frames = self.frames()?;
        let chosen = lidar_choice::choose(&lidars.found, |lidar| {
            imu.as_ref().is_none_or(|imu| frames.connects(&imu.candidate.frame, &lidar.frame))
        });
        let (lidar, kind, other_lidars) = chosen.ok_or_else(|| {
            let needs = "LaserScan, MultiEchoLaserScan, PointCloud2 or CustomMsg of Livox";
            self.no_sensor("lidar", needs, &lidars.unusable)
        })?;
        let imu = imu.ok_or_else(|| self.no_sensor("IMU", "sensor_msgs/msg/Imu", &imus.unusable))?;
        let detector = self.detect_no_returns(lidar, kind)?;
        let no_return_range_m = detector.no_return_range_m();
        let clouds = self.preview_clouds(&lidar.topic, kind, no_return_range_m)?;
        let lidar_reading = LidarDecoding { kind, times: clouds.times, no_return_range_m };
        let lidar_headers = self.preview_headers(&lidar.topic)?;
        let scan_duration_s = self.scan_duration_s(lidar, lidar_reading)?;
        let shift = clocks::find_offset(&imu.preview.log_times, &lidar_headers.log_times, scan_duration_s);
        let lidar_frame = lidar_headers.frames.main().unwrap_or(&lidar.frame).to_owned();
        let imu_frame = imu.preview.frames.main().unwrap_or(&imu.candidate.frame).to_owned();
        let choice = Choice {
            lidar,
            lidars: &lidars.found,
            headers: &lidar_headers,
            clouds: &clouds,
            no_returns: &detector,
            imu: &imu,
            imus: &imus.found,
            shift,
        };
        let notes = choice.notes();
        let unusable = || lidars.unusable.iter().chain(&imus.unusable);
        Ok(Selection {
            lidar_topic: lidar.topic.clone(),
            lidar_frame,
            imu_topic: imu.candidate.topic.clone(),
            imu_frame,
            notes,
            unused: other_lidars.into_iter().chain(imu.unused).chain(unusable().cloned()).collect(),
            lidar: lidar_reading,
            imu: ImuDecoding { unit: imu.unit, layout: imu.layout, shift: shift.unwrap_or(Span::ZERO) },
        })
    }

    /// Detects how the lidar encodes beams without a return, from messages across the recording.
    fn detect_no_returns(&self, lidar: &Candidate, kind: LidarKind) -> Result<NoReturnDetector, RecordingError> {
        let mut detector = NoReturnDetector::default();
        self.sample(&self.ids_of(&lidar.topic), NO_RETURN_BLOCKS, NO_RETURN_MESSAGES, |message| {
            // Messages that cannot be decoded are counted as loss when measurements are read.
            let planar = match kind {
                LidarKind::Scan => scan::decode(message.data),
                LidarKind::MultiEcho => multi_echo::decode(message.data),
                LidarKind::Points => {
                    let _ = points::count_no_returns(message.data, &mut detector);
                    return;
                }
                LidarKind::Livox => return,
            };
            let Ok((_, planar)) = planar else { return };
            let (min_m, max_m) = (planar.range_min_m, planar.range_max_m);
            planar.ranges_m.iter().for_each(|range| detector.add_range(*range, min_m, max_m));
        })?;
        Ok(detector)
    }

    /// Duration of a scan after the stamp, s: the median of the first scans.
    fn scan_duration_s(&self, lidar: &Candidate, reading: LidarDecoding) -> Result<f64, RecordingError> {
        let ids = self.ids_of(&lidar.topic);
        let (mut messages, mut durations_s) = (self.messages_in_blocks_of(&ids), Vec::new());
        let mut projector = scan::Projector::default();
        while durations_s.len() < PREVIEW_MESSAGES {
            let Some(message) = messages.next()? else { break };
            if !ids.contains(&message.channel) {
                continue;
            }
            if let Ok(timed) = reading.decode(message.data, &mut projector) {
                let scan = timed.scan;
                let last = scan.returns.last().map_or(Span::ZERO, |last| last.offset);
                durations_s.push((last - scan.stamped_after).seconds());
            }
        }
        Ok(quantile(durations_s, 0.5))
    }

    fn no_sensor(&self, sensor: &'static str, needs: &'static str, unusable: &[UnusedTopic]) -> RecordingError {
        let name = self.name().to_owned();
        let drivers = drivers::hint(self.channels());
        if unusable.is_empty() {
            let has = format!("{}{drivers}", self.topic_list());
            return RecordingError::NoSensor { name, sensor, needs, has };
        }
        let reasons: Vec<_> = unusable.iter().map(UnusedTopic::to_string).collect();
        RecordingError::Unusable { name, sensor, reasons: reasons.join("; ") + &drivers }
    }
}
