//! Which topics of a recording are the lidar and the IMU.

use crate::recording::container::{ChannelId, RawMessage};
use crate::recording::measurements::is_finite;
use crate::recording::message::{imu, points, scan};
use crate::recording::schema::MessageType;
use crate::recording::topics::TRUTH_PREFIX;
use crate::recording::wire::Decoder;
use crate::recording::{Reader, RecordingError};
use std::collections::BTreeMap;

/// Topics that somebody asks for; those not named are found.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Preference {
    /// The lidar's topic.
    pub lidar_topic: Option<String>,
    /// The IMU's topic.
    pub imu_topic: Option<String>,
}

/// The topics that measurements are read from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Selection {
    /// The lidar's topic.
    pub lidar_topic: String,
    /// The frame in which its points are.
    pub lidar_frame: String,
    /// The IMU's topic.
    pub imu_topic: String,
    /// The frame in which it measures.
    pub imu_frame: String,
    /// What was chosen among several, and what the choice lacks, a sentence each.
    pub notes: Vec<String>,
    pub(super) lidar_kind: LidarKind,
    /// In what points' times are counted, where clouds show another unit than the usual one.
    pub(super) point_times: Option<points::Unit>,
    /// In what the IMU tells specific force.
    pub(super) force_unit: imu::ForceUnit,
}

/// How a lidar's messages tell its beams.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LidarKind {
    /// As `LaserScan`.
    Scan,
    /// As `PointCloud2`.
    Points,
}

/// How well the times of beams are known, best first; equals are taken by kind, then by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum BeamTimes {
    /// Each message tells them.
    Told,
    /// Each message tells them, by another clock than its stamp.
    OfOtherClock,
    /// They follow from the time that a turn takes.
    Implied,
    /// All beams seem to be fired at once.
    Unknown,
}

/// A topic that may be chosen: what its first message tells.
pub(super) struct Candidate {
    topic: String,
    pub(super) frame: String,
    kind: Option<LidarKind>,
    times: BeamTimes,
}

const LIDAR_TYPES: [MessageType; 2] = [MessageType::LaserScan, MessageType::PointCloud2];

/// Clouds by which the unit of their points' times is told.
const LOOKED_AT: usize = 20;
/// Samples by which that of an IMU's specific force is.
const FELT: usize = 200;

/// Endings of IMU topics, preferred first: the raw one is without a filter's opinion.
const IMU_ENDINGS: [&str; 3] = ["imu/data_raw", "imu/data", "imu"];

impl Reader {
    /// Finds the lidar and the IMU: of lidars one that `/tf_static`, where there is one, puts beside the IMU. A
    /// `LaserScan` whose beams' times are told is taken first, then a `PointCloud2` whose points have times; of several
    /// the first by name. Truth, the recording's own, is never a candidate.
    ///
    /// # Errors
    /// When there is no lidar or no IMU, or not the one that is asked for.
    pub fn select(&self, preference: &Preference) -> Result<Selection, RecordingError> {
        let lidars = self.candidates(&LIDAR_TYPES, preference.lidar_topic.as_deref(), lidar_candidate)?;
        let imus = self.candidates(&[MessageType::Imu], preference.imu_topic.as_deref(), imu_candidate)?;
        let imu = imus.iter().min_by_key(|c| (imu_rank(&c.topic), &c.topic));
        let stands_beside = |lidar: &Candidate| imu.is_none_or(|imu| self.connects(&imu.frame, &lidar.frame));
        let lidar =
            lidars.iter().min_by_key(|c| (!stands_beside(c), c.times, c.kind == Some(LidarKind::Points), &c.topic));
        let (lidar, lidar_kind) = lidar
            .and_then(|lidar| Some((lidar, lidar.kind?)))
            .ok_or_else(|| self.no_sensor("lidar", "sensor_msgs/msg/LaserScan or sensor_msgs/msg/PointCloud2"))?;
        let imu = imu.ok_or_else(|| self.no_sensor("IMU", "sensor_msgs/msg/Imu"))?;
        let point_times = match lidar_kind {
            LidarKind::Points => self.unit_of_point_times(&lidar.topic)?,
            LidarKind::Scan => None,
        };
        let force_unit = self.force_unit(&imu.topic)?;
        let notes = [
            notes_on_choice("lidar", lidar, &lidars),
            notes_on_choice("IMU", imu, &imus),
            note_on_times(lidar),
            point_times.map(|unit| note_on_unit(lidar, unit)),
            (force_unit != imu::ForceUnit::default()).then(|| note_on_force(&imu.topic)),
        ];
        Ok(Selection {
            lidar_topic: lidar.topic.clone(),
            lidar_frame: lidar.frame.clone(),
            imu_topic: imu.topic.clone(),
            imu_frame: imu.frame.clone(),
            notes: notes.into_iter().flatten().collect(),
            lidar_kind,
            point_times,
            force_unit,
        })
    }

    /// The unit that a topic's first clouds show, see [`points::Unit::shown_by`].
    fn unit_of_point_times(&self, topic: &str) -> Result<Option<points::Unit>, RecordingError> {
        let ids = self.ids_of(topic);
        let (mut messages, mut lasting) = (self.messages_near(&ids), Vec::new());
        while lasting.len() < LOOKED_AT {
            let Some(message) = messages.next()? else { break };
            if ids.contains(&message.channel) {
                let Some(cloud) = points::lasting(message.data) else { return Ok(None) };
                lasting.push(cloud);
            }
        }
        Ok(points::Unit::shown_by(&lasting))
    }

    /// In what an IMU's first samples tell specific force.
    pub(super) fn force_unit(&self, topic: &str) -> Result<imu::ForceUnit, RecordingError> {
        let ids = self.ids_of(topic);
        let (mut messages, mut samples) = (self.messages_near(&ids), Vec::new());
        while samples.len() < FELT {
            let Some(message) = messages.next()? else { break };
            if ids.contains(&message.channel) {
                samples.extend(imu::decode(message.data, imu::ForceUnit::default()).ok().filter(is_finite));
            }
        }
        Ok(imu::ForceUnit::shown_by(&samples))
    }

    fn no_sensor(&self, sensor: &'static str, needs: &'static str) -> RecordingError {
        RecordingError::NoSensor { name: self.name().to_owned(), sensor, needs, has: self.what_it_has() }
    }

    /// Topics of `types` that have a message which `look` understands; of one topic alone, where it is asked for.
    pub(super) fn candidates(
        &self,
        types: &[MessageType],
        asked: Option<&str>,
        look: fn(&RawMessage<'_>, MessageType, &str) -> Option<Candidate>,
    ) -> Result<Vec<Candidate>, RecordingError> {
        let mut open = BTreeMap::new();
        for channel in self.channels().iter().filter(|channel| channel.wire.is_some()) {
            let kind = types.iter().find(|kind| kind.is_named(&channel.type_name));
            let wanted = asked.map_or(!channel.topic.starts_with(TRUTH_PREFIX), |asked| asked == channel.topic);
            if let Some(kind) = kind.filter(|_| wanted) {
                open.insert(channel.id, (*kind, channel.topic.as_str()));
            }
        }
        if let Some(asked) = asked.filter(|_| open.is_empty()) {
            let names: Vec<_> = types.iter().map(|kind| kind.name()).collect();
            let problem = format!("is not there as {}", names.join(" or "));
            return Err(self.topic_error(asked, problem));
        }
        let ids: Vec<ChannelId> = open.keys().copied().collect();
        let mut found = Vec::new();
        for mut messages in [self.messages_near(&ids), self.messages()] {
            while !open.is_empty() {
                let Some(message) = messages.next()? else { break };
                let Some((kind, topic)) = open.get(&message.channel) else { continue };
                if let Some(candidate) = look(&message, *kind, topic) {
                    open.remove(&message.channel);
                    found.push(candidate);
                }
            }
        }
        Ok(found)
    }

    fn topic_error(&self, topic: &str, problem: String) -> RecordingError {
        let (name, has) = (self.name().to_owned(), self.what_it_has());
        RecordingError::Topic { name, topic: topic.to_owned(), problem, has }
    }
}

fn frame_of(message: &RawMessage<'_>) -> Option<String> {
    let (_, frame) = Decoder::new(message.data).ok()?.header().ok()?;
    Some(crate::recording::message::transforms::plain(frame))
}

fn lidar_candidate(message: &RawMessage<'_>, kind: MessageType, topic: &str) -> Option<Candidate> {
    let frame = frame_of(message)?;
    let (kind, times) = if kind == MessageType::LaserScan {
        let (_, scan) = scan::decode(message.data).ok()?;
        let times = match (scan.time_increment_s == 0.0, scan::time_increment_s(&scan) == 0.0) {
            (false, _) => BeamTimes::Told,
            (true, false) => BeamTimes::Implied,
            (true, true) => BeamTimes::Unknown,
        };
        (LidarKind::Scan, times)
    } else {
        let times = match points::by_other_clock(message.data).ok()? {
            Some(false) => BeamTimes::Told,
            Some(true) => BeamTimes::OfOtherClock,
            None => BeamTimes::Unknown,
        };
        (LidarKind::Points, times)
    };
    Some(Candidate { topic: topic.to_owned(), frame, kind: Some(kind), times })
}

pub(super) fn imu_candidate(message: &RawMessage<'_>, _: MessageType, topic: &str) -> Option<Candidate> {
    let frame = frame_of(message)?;
    Some(Candidate { topic: topic.to_owned(), frame, kind: None, times: BeamTimes::Told })
}

fn imu_rank(topic: &str) -> usize {
    IMU_ENDINGS.iter().position(|ending| topic.ends_with(ending)).unwrap_or(IMU_ENDINGS.len())
}

/// Says which of several sensors was taken; another message kind of the same sensor is no other sensor.
fn notes_on_choice(sensor: &str, chosen: &Candidate, all: &[Candidate]) -> Option<String> {
    let mut others: Vec<_> =
        all.iter().filter(|c| c.topic != chosen.topic && c.frame != chosen.frame).map(|c| c.topic.as_str()).collect();
    others.sort_unstable();
    (!others.is_empty())
        .then(|| format!("Of several {sensor} topics, {} is read, not {}.", chosen.topic, others.join(", ")))
}

fn note_on_force(imu: &str) -> String {
    format!("{imu} tells accelerations in units of gravity, not in m/s^2: they are taken times 9.80665.")
}

fn note_on_unit(lidar: &Candidate, unit: points::Unit) -> String {
    let (topic, unit) = (&lidar.topic, unit.name());
    format!(
        "{topic} counts its points' times in {unit}: as they are usually read, its clouds would last far too long or short."
    )
}

fn note_on_times(lidar: &Candidate) -> Option<String> {
    match lidar.times {
        BeamTimes::Told => None,
        BeamTimes::OfOtherClock => Some(format!(
            "{} tells its points' times by another clock than its clouds' stamps: they are counted from each cloud's first \
             point, which is taken to be fired at the stamp.",
            lidar.topic
        )),
        BeamTimes::Implied => Some(format!(
            "{} tells no time between beams; an even turn of the mirror is assumed, scan_time a turn.",
            lidar.topic
        )),
        BeamTimes::Unknown => Some(format!(
            "{} tells no times of its beams; all of a scan are taken to be fired at its stamp, so motion blurs it.",
            lidar.topic
        )),
    }
}
