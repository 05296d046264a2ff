//! Selects the lidar and IMU topics of a recording and determines how to decode them.

mod candidates;
mod clocks;
mod content;
mod imu_choice;
mod preview;

use crate::message::no_returns::NoReturnDetector;
use crate::message::{imu, multi_echo, points, scan};
use crate::schema::MessageType;
use crate::{Reader, RecordingError};
use candidates::BeamTimes;
pub(super) use candidates::{Candidate, LidarKind, probe_imu};
pub(super) use imu_choice::ImuLayout;
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
    /// Unit of the points' times, if the clouds show that it is not the usual one.
    pub time_unit: Option<points::TimeUnit>,
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

/// Clouds used to detect the unit of point times, and scans used to measure their duration: enough for a median.
const PREVIEW_MESSAGES: usize = 20;

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
        let is_connected =
            |lidar: &Candidate| imu.as_ref().is_none_or(|imu| self.connects(&imu.candidate.frame, &lidar.frame));
        let rank = |c: &&Candidate| (!is_connected(c), c.times, is_cloud(c), c.topic.clone());
        let (lidar, kind) =
            lidars.found.iter().min_by_key(rank).and_then(|lidar| Some((lidar, lidar.kind?))).ok_or_else(|| {
                self.no_sensor(
                    "lidar",
                    "LaserScan, MultiEchoLaserScan, PointCloud2 or CustomMsg of Livox",
                    &lidars.unusable,
                )
            })?;
        let imu = imu.ok_or_else(|| self.no_sensor("IMU", "sensor_msgs/msg/Imu", &imus.unusable))?;
        let detector = self.detect_no_returns(lidar, kind)?;
        let time_unit = match kind {
            LidarKind::Points => self.point_time_unit(&lidar.topic)?,
            _ => None,
        };
        let lidar_reading = LidarDecoding { kind, time_unit, no_return_range_m: detector.no_return_range_m() };
        let scan_duration_s = self.scan_duration_s(lidar, lidar_reading)?;
        let shift = clocks::find_offset(&imu.preview.log_times, &self.log_times(&lidar.topic)?, scan_duration_s);
        let notes = [
            note_on_choice("lidar", lidar, &lidars.found),
            note_on_choice("IMU", &imu.candidate, &imus.found),
            note_on_times(lidar),
            time_unit.map(|unit| note_on_unit(lidar, unit)),
            (imu.unit != imu::ForceUnit::default()).then(|| note_on_force(&imu.candidate.topic)),
            note_on_layout(&imu.candidate, &imu.layout),
            detector.note(&lidar.topic),
            (kind == LidarKind::MultiEcho).then(|| note_on_echoes(lidar)),
            shift.map(|shift| note_on_shift(&imu.candidate, lidar, shift)),
        ];
        let unusable = lidars.unusable.iter().chain(&imus.unusable).map(|reason| format!("Not used: {reason}."));
        Ok(Selection {
            lidar_topic: lidar.topic.clone(),
            lidar_frame: lidar.frame.clone(),
            imu_topic: imu.candidate.topic.clone(),
            imu_frame: imu.candidate.frame.clone(),
            notes: notes.into_iter().flatten().chain(unusable).collect(),
            lidar: lidar_reading,
            imu: ImuDecoding { unit: imu.unit, layout: imu.layout, shift: shift.unwrap_or(Span::ZERO) },
        })
    }

    /// Detects the time unit of a topic from the first clouds, see [`points::TimeUnit::detect`].
    fn point_time_unit(&self, topic: &str) -> Result<Option<points::TimeUnit>, RecordingError> {
        let ids = self.ids_of(topic);
        let (mut messages, mut durations) = (self.messages_in_blocks_of(&ids), Vec::new());
        while durations.len() < PREVIEW_MESSAGES {
            let Some(message) = messages.next()? else { break };
            if ids.contains(&message.channel) {
                let Some(cloud) = points::duration(message.data) else { return Ok(None) };
                durations.push(cloud);
            }
        }
        Ok(points::TimeUnit::detect(&durations))
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
            if let Ok(scan) = reading.decode(message.data, &mut projector) {
                let last = scan.returns.last().map_or(Span::ZERO, |last| last.offset);
                durations_s.push((last - scan.stamped_after).seconds());
            }
        }
        Ok(content::quantile(durations_s, 0.5))
    }

    fn no_sensor(&self, sensor: &'static str, needs: &'static str, unusable: &[String]) -> RecordingError {
        let name = self.name().to_owned();
        if unusable.is_empty() {
            return RecordingError::NoSensor { name, sensor, needs, has: self.topic_list() };
        }
        RecordingError::Unusable { name, sensor, reasons: unusable.join("; ") }
    }
}

fn is_cloud(lidar: &Candidate) -> bool {
    matches!(lidar.kind, Some(LidarKind::Points | LidarKind::Livox))
}

/// Reports which of several sensors is used. Another topic in the same frame is the same sensor.
fn note_on_choice(sensor: &str, chosen: &Candidate, all: &[Candidate]) -> Option<String> {
    let mut others: Vec<_> =
        all.iter().filter(|c| c.topic != chosen.topic && c.frame != chosen.frame).map(|c| c.topic.as_str()).collect();
    others.sort_unstable();
    (!others.is_empty())
        .then(|| format!("Of several {sensor} topics, {} is used, not {}.", chosen.topic, others.join(", ")))
}

fn note_on_layout(imu: &Candidate, layout: &ImuLayout) -> Option<String> {
    let ImuLayout::Separate { acceleration_topic, max_separation } = layout else { return None };
    let max_ms = 1e3 * max_separation.seconds();
    Some(match acceleration_topic {
        Some(forces) => format!(
            "{} has angular velocities only: each is paired with the nearest acceleration of {forces}, within {max_ms:.1} ms.",
            imu.topic
        ),
        None => format!(
            "{} has angular velocities and accelerations in separate messages: they are paired by stamp, within \
             {max_ms:.1} ms.",
            imu.topic
        ),
    })
}

fn note_on_echoes(lidar: &Candidate) -> String {
    format!(
        "{} has several echoes per beam: the strongest is used, or the first if there are no intensities.",
        lidar.topic
    )
}

fn note_on_shift(imu: &Candidate, lidar: &Candidate, shift: Span) -> String {
    format!(
        "By log times, the stamps of {} and {} differ by {:.3} s: {0} is shifted by {:+.3} s; the estimator determines the remainder.",
        imu.topic,
        lidar.topic,
        shift.seconds().abs(),
        shift.seconds()
    )
}

fn note_on_force(imu: &str) -> String {
    format!("{imu} has accelerations in g, not in m/s^2: they are multiplied by 9.80665.")
}

fn note_on_unit(lidar: &Candidate, unit: points::TimeUnit) -> String {
    let (topic, unit) = (&lidar.topic, unit.name());
    format!("{topic} has point times in {unit}: in the usual unit its clouds would last implausibly long or short.")
}

fn note_on_times(lidar: &Candidate) -> Option<String> {
    match lidar.times {
        BeamTimes::Stated => None,
        BeamTimes::OtherClock => Some(format!(
            "{} has point times of another clock than its clouds' stamps: they are counted from each cloud's first \
             point, which is assumed to be fired at the stamp.",
            lidar.topic
        )),
        BeamTimes::Implied => Some(format!(
            "{} states no time between beams; uniform rotation is assumed, one revolution per scan_time.",
            lidar.topic
        )),
        BeamTimes::Unknown => Some(format!(
            "{} states no beam times; all beams of a scan are assumed to be fired at its stamp, so motion distorts it.",
            lidar.topic
        )),
    }
}
