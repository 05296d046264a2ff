//! Which topics of a recording are the lidar and the IMU, and how their messages are to be read.

mod candidates;
mod clocks;
mod content;
mod inertial;
mod listen;

use crate::recording::message::misses::Census;
use crate::recording::message::{imu, multi_echo, points, scan};
use crate::recording::schema::MessageType;
use crate::recording::{Reader, RecordingError};
use crate::time::Span;
use candidates::BeamTimes;
pub(super) use candidates::{Candidate, LidarKind, inertial as imu_candidate};
pub(super) use inertial::Layout;

/// Topics that somebody asks for; those not named are found.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Preference {
    /// The lidar's topic.
    pub lidar_topic: Option<String>,
    /// The IMU's topic.
    pub imu_topic: Option<String>,
}

/// The topics that measurements are read from.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// The lidar's topic.
    pub lidar_topic: String,
    /// The frame in which its points are.
    pub lidar_frame: String,
    /// The IMU's topic.
    pub imu_topic: String,
    /// The frame in which it measures.
    pub imu_frame: String,
    /// What was chosen among several, and how what is unusual is read, a sentence each.
    pub notes: Vec<String>,
    pub(super) lidar: LidarReading,
    pub(super) imu: ImuReading,
}

impl Selection {
    /// What is added to the IMU's stamps to bring them to the lidar's epoch; zero but for clocks that are far apart.
    pub fn imu_shift(&self) -> Span {
        self.imu.shift
    }
}

/// How a lidar's messages are read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LidarReading {
    /// How they encode beams.
    pub kind: LidarKind,
    /// The unit of points' times, where clouds show another than the usual one.
    pub point_times: Option<points::Unit>,
    /// The constant range that encodes beams without a return, m, where there is one.
    pub farthest_m: Option<f32>,
}

/// How an IMU's messages are read.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ImuReading {
    /// The unit of specific force.
    pub unit: imu::ForceUnit,
    /// How messages make samples.
    pub layout: Layout,
    /// What is added to stamps to bring them to the lidar's clock.
    pub shift: Span,
}

const LIDAR_TYPES: [MessageType; 5] = [
    MessageType::LaserScan,
    MessageType::MultiEchoLaserScan,
    MessageType::PointCloud2,
    MessageType::Livox,
    MessageType::Livox2,
];

/// Clouds by which the unit of their points' times is recognised, and the length of a scan.
const LOOKED_AT: usize = 20;

/// Parts of the recording in which misses are counted, and messages in each.
const SAMPLED: (usize, usize) = (24, 4);

impl Reader {
    /// Finds the lidar and the IMU: of lidars one that `/tf_static`, where there is one, connects to the IMU. A scan
    /// whose beams' times are stated is taken first, then a cloud whose points have times; of several the first by
    /// name. Truth, the recording's own, is never a candidate.
    ///
    /// # Errors
    /// When there is no lidar or no IMU that can be decoded, or not the one that is asked for, or the IMU lacks a part.
    pub fn select(&self, preference: &Preference) -> Result<Selection, RecordingError> {
        let lidars = self.candidates(&LIDAR_TYPES, preference.lidar_topic.as_deref(), candidates::lidar)?;
        let asked = preference.imu_topic.as_deref();
        let imus = self.candidates(&[MessageType::Imu], asked, imu_candidate)?;
        let others = match asked {
            Some(_) => self.candidates(&[MessageType::Imu], None, imu_candidate)?.found,
            None => Vec::new(),
        };
        let all_imus = if asked.is_some() { &others } else { &imus.found };
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
        let census = self.count_misses(lidar, kind)?;
        let point_times = match kind {
            LidarKind::Points => self.unit_of_point_times(&lidar.topic)?,
            _ => None,
        };
        let lidar_reading = LidarReading { kind, point_times, farthest_m: census.farthest_m() };
        let scan_s = self.scan_s(lidar, lidar_reading)?;
        let shift = clocks::shift(&imu.heard.logged, &self.logged(&lidar.topic)?, scan_s);
        let notes = [
            note_on_choice("lidar", lidar, &lidars.found),
            note_on_choice("IMU", &imu.candidate, &imus.found),
            note_on_times(lidar),
            point_times.map(|unit| note_on_unit(lidar, unit)),
            (imu.unit != imu::ForceUnit::default()).then(|| note_on_force(&imu.candidate.topic)),
            note_on_layout(&imu.candidate, &imu.layout),
            census.note(&lidar.topic),
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
            imu: ImuReading { unit: imu.unit, layout: imu.layout, shift: shift.unwrap_or(Span::ZERO) },
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

    /// How the lidar encodes beams without a return, by messages from all over the recording.
    fn count_misses(&self, lidar: &Candidate, kind: LidarKind) -> Result<Census, RecordingError> {
        let mut census = Census::default();
        self.sample(&self.ids_of(&lidar.topic), SAMPLED, |message| {
            // A message that cannot be decoded is counted where measurements are read.
            let planar = match kind {
                LidarKind::Scan => scan::decode(message.data),
                LidarKind::MultiEcho => multi_echo::decode(message.data),
                LidarKind::Points => {
                    let _ = points::count_misses(message.data, &mut census);
                    return;
                }
                LidarKind::Livox => return,
            };
            let Ok((_, planar)) = planar else { return };
            let limits = (planar.range_min_m, planar.range_max_m);
            planar.ranges_m.iter().for_each(|range| census.add_range(*range, limits));
        })?;
        Ok(census)
    }

    /// How long a scan lasts after its stamp, s: the median of the first ones.
    fn scan_s(&self, lidar: &Candidate, reading: LidarReading) -> Result<f64, RecordingError> {
        let ids = self.ids_of(&lidar.topic);
        let (mut messages, mut lasts) = (self.messages_near(&ids), Vec::new());
        let mut projector = scan::Projector::default();
        while lasts.len() < LOOKED_AT {
            let Some(message) = messages.next()? else { break };
            if !ids.contains(&message.channel) {
                continue;
            }
            if let Ok(scan) = reading.decode(&message, &mut projector) {
                let last = scan.returns.last().map_or(Span::ZERO, |last| last.offset);
                lasts.push((last - scan.stamped_after).seconds());
            }
        }
        Ok(content::quantile(lasts, 0.5))
    }

    fn no_sensor(&self, sensor: &'static str, needs: &'static str, unusable: &[String]) -> RecordingError {
        let name = self.name().to_owned();
        if unusable.is_empty() {
            return RecordingError::NoSensor { name, sensor, needs, has: self.what_it_has() };
        }
        RecordingError::Unusable { name, sensor, reasons: unusable.join("; ") }
    }
}

fn is_cloud(lidar: &Candidate) -> bool {
    matches!(lidar.kind, Some(LidarKind::Points | LidarKind::Livox))
}

/// Says which of several sensors was taken; another message kind of the same sensor is no other sensor.
fn note_on_choice(sensor: &str, chosen: &Candidate, all: &[Candidate]) -> Option<String> {
    let mut others: Vec<_> =
        all.iter().filter(|c| c.topic != chosen.topic && c.frame != chosen.frame).map(|c| c.topic.as_str()).collect();
    others.sort_unstable();
    (!others.is_empty())
        .then(|| format!("Of several {sensor} topics, {} is read, not {}.", chosen.topic, others.join(", ")))
}

fn note_on_layout(imu: &Candidate, layout: &Layout) -> Option<String> {
    let Layout::Separate { acceleration_topic, apart } = layout else { return None };
    let apart_ms = 1e3 * apart.seconds();
    Some(match acceleration_topic {
        Some(forces) => format!(
            "{} has angular velocities only: each is paired with the nearest acceleration of {forces}, at most {apart_ms:.1} ms \
             apart.",
            imu.topic
        ),
        None => format!(
            "{} has angular velocities and accelerations in separate messages: they are paired by their stamps, at most \
             {apart_ms:.1} ms apart.",
            imu.topic
        ),
    })
}

fn note_on_echoes(lidar: &Candidate) -> String {
    format!(
        "{} has several echoes a beam: the strongest is used, or the first where there are no intensities.",
        lidar.topic
    )
}

fn note_on_shift(imu: &Candidate, lidar: &Candidate, shift: Span) -> String {
    format!(
        "The stamps of {} and {} are {:.3} s apart by their log times: {0} is shifted by {:+.3} s; the estimator finds the rest.",
        imu.topic,
        lidar.topic,
        shift.seconds().abs(),
        shift.seconds()
    )
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
        BeamTimes::Stated => None,
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
