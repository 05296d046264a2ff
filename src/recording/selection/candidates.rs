//! Topics that may be the lidar or the IMU, judged by their first messages.

use super::unused::UnusedTopic;
use crate::container::{ChannelId, Messages, RawMessage};
use crate::message::no_returns::RangeLimits;
use crate::message::point_times::{CloudTimes, PointTimes};
use crate::message::transforms::printable_frame;
use crate::message::{imu, livox, multi_echo, points, scan};
use crate::schema::MessageType;
use crate::topics::TRUTH_PREFIX;
use crate::wire::{DecodeError, Decoder};
use crate::{Reader, RecordingError};
use std::collections::BTreeMap;
use zsim_base::similar::did_you_mean;

/// Message encoding of a lidar.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LidarKind {
    /// `LaserScan`.
    Scan,
    /// `MultiEchoLaserScan`.
    MultiEcho,
    /// `PointCloud2`.
    Points,
    /// Livox `CustomMsg`.
    Livox,
}

/// Quality of the beam times, best first; ties are broken by kind, then by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum BeamTimes {
    /// Each message states them.
    Stated,
    /// Each message states them, on another clock than its stamp's.
    OtherClock,
    /// They follow from the duration of a revolution.
    Implied,
    /// Not available: all beams have the stamp's time.
    Unknown,
}

/// A topic that may be selected.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Topic name.
    pub topic: String,
    /// Frame of the first message.
    pub frame: String,
    /// Encoding of a lidar; `None` for an IMU.
    pub kind: Option<LidarKind>,
    /// Quality of the beam times.
    pub times: BeamTimes,
    /// Whether the message has no returns.
    pub is_empty: bool,
    /// Why the topic is not a sensor that an estimate can use, unless it is requested.
    unsuitable: Option<&'static str>,
}

/// Topics with the message types of a sensor.
#[derive(Debug, Default)]
pub struct Candidates {
    /// Topics whose messages can be decoded.
    pub found: Vec<Candidate>,
    /// Topics that are not usable.
    pub unusable: Vec<UnusedTopic>,
}

/// Maximum number of messages without returns after which a topic has none.
const MAX_EMPTY: usize = 500;

/// Parts of the names of a radar's fields.
const RADAR_FIELDS: [&str; 4] = ["rcs", "doppler", "range_rate", "radial"];

/// Decodes a message of a topic into a candidate.
type Probe = fn(&RawMessage<'_>, MessageType, &str) -> Result<Candidate, DecodeError>;

impl Reader {
    /// Finds topics of `types` by the first message that `probe` decodes, preferably one with points.
    ///
    /// With `requested`, only that topic. The recording's own ground truth is excluded unless requested.
    ///
    /// # Errors
    /// When the file cannot be read, or the requested topic is missing.
    pub fn candidates(
        &self,
        types: &[MessageType],
        requested: Option<&str>,
        probe: Probe,
    ) -> Result<Candidates, RecordingError> {
        let mut remaining = BTreeMap::new();
        for channel in self.channels().iter().filter(|channel| channel.wire.is_some()) {
            let kind = types.iter().find(|kind| kind.is_named(&channel.type_name));
            let wanted =
                requested.map_or(!channel.topic.starts_with(TRUTH_PREFIX), |requested| requested == channel.topic);
            if let Some(kind) = kind.filter(|_| wanted) {
                remaining.insert(channel.id, (*kind, channel.topic.as_str()));
            }
        }
        if let Some(requested) = requested.filter(|_| remaining.is_empty()) {
            let names: Vec<_> = types.iter().map(|kind| kind.name()).collect();
            let problem = format!("is missing or not of type {}", names.join(" or "));
            return Err(self.topic_error(requested, problem));
        }
        let ids: Vec<ChannelId> = remaining.keys().copied().collect();
        let mut search =
            CandidateSearch { remaining, probe, found: Vec::new(), empty: BTreeMap::new(), failed: BTreeMap::new() };
        search.run(self.messages_in_blocks_of(&ids))?;
        search.run(self.messages())?;
        Ok(search.finish(requested.is_some()))
    }

    fn topic_error(&self, topic: &str, problem: String) -> RecordingError {
        let (name, has) = (self.name().to_owned(), self.topic_list());
        let question = did_you_mean(topic, self.channels().iter().map(|channel| channel.topic.as_str()));
        let problem = match question {
            Some(question) => format!("{problem}: {question}"),
            None => problem,
        };
        RecordingError::Topic { name, topic: topic.to_owned(), problem, has }
    }
}

/// Search for the first usable message of each topic.
struct CandidateSearch<'a> {
    remaining: BTreeMap<ChannelId, (MessageType, &'a str)>,
    probe: Probe,
    found: Vec<Candidate>,
    /// Topics whose messages have no returns so far, with the number of these messages.
    empty: BTreeMap<&'a str, (Candidate, usize)>,
    /// Decoding error of the first message of a topic.
    failed: BTreeMap<&'a str, DecodeError>,
}

impl CandidateSearch<'_> {
    fn run(&mut self, mut messages: Messages<'_>) -> Result<(), RecordingError> {
        while !self.remaining.is_empty() {
            let Some(message) = messages.next()? else { break };
            let Some((kind, topic)) = self.remaining.get(&message.channel).copied() else { continue };
            match (self.probe)(&message, kind, topic) {
                Ok(candidate) if candidate.is_empty => {
                    let (_, count) = self.empty.entry(topic).or_insert((candidate, 0));
                    *count += 1;
                    if *count >= MAX_EMPTY {
                        self.remaining.retain(|_, (_, other)| *other != topic);
                    }
                }
                Ok(candidate) => {
                    // In a split recording a topic has one channel per file.
                    self.remaining.retain(|_, (_, other)| *other != topic);
                    self.empty.remove(topic);
                    self.found.push(candidate);
                }
                Err(error) => {
                    self.failed.entry(topic).or_insert(error);
                }
            }
        }
        Ok(())
    }

    /// Completes the search; topics that are not suitable are candidates only if they are `requested`.
    fn finish(mut self, requested: bool) -> Candidates {
        self.found.extend(self.empty.into_values().map(|(candidate, _)| candidate));
        let mut unusable = BTreeMap::new();
        for (kind, topic) in self.remaining.into_values() {
            let reason = match self.failed.get(topic) {
                Some(error) => format!("{error} in its first {} message", kind.name()),
                None => "it has no messages".to_owned(),
            };
            if self.found.iter().all(|candidate| candidate.topic != topic) {
                unusable.insert(topic.to_owned(), reason);
            }
        }
        self.found.retain(|candidate| {
            let reason = candidate.unsuitable.filter(|_| !requested);
            unusable.extend(reason.map(|reason| (candidate.topic.clone(), reason.to_owned())));
            reason.is_none()
        });
        let unusable = unusable.into_iter().map(|(topic, reason)| UnusedTopic { topic, reason, is_usable: false });
        Candidates { found: self.found, unusable: unusable.collect() }
    }
}

fn frame_of(message: &RawMessage<'_>) -> Result<String, DecodeError> {
    let (_, frame) = Decoder::new(message.data)?.header()?;
    Ok(printable_frame(frame))
}

/// Decodes a lidar message into a candidate.
///
/// # Errors
/// When it cannot be decoded.
pub fn probe_lidar(message: &RawMessage<'_>, kind: MessageType, topic: &str) -> Result<Candidate, DecodeError> {
    let frame = frame_of(message)?;
    let (kind, times, is_empty) = match kind {
        MessageType::LaserScan => planar_properties(LidarKind::Scan, &scan::decode(message.data)?.1),
        MessageType::MultiEchoLaserScan => {
            planar_properties(LidarKind::MultiEcho, &multi_echo::decode(message.data)?.1)
        }
        MessageType::PointCloud2 => {
            let cloud = points::decode(message.data, None, None)?;
            let times = CloudTimes::of(&cloud).and_then(|times| PointTimes::detect(&[times]));
            let times = match times {
                Some((times, _)) if times.is_other_clock() => BeamTimes::OtherClock,
                Some((PointTimes::Encoded { .. }, _)) => BeamTimes::Stated,
                Some((PointTimes::AtStamp, _)) | None => BeamTimes::Unknown,
            };
            (LidarKind::Points, times, cloud.returns.is_empty())
        }
        _ => (LidarKind::Livox, BeamTimes::Stated, livox::decode(message.data, None)?.returns.is_empty()),
    };
    let is_radar = kind == LidarKind::Points && times == BeamTimes::Unknown && has_radar_field(message);
    let unsuitable = is_radar
        .then_some("the fields of its clouds are those of a radar, whose returns are too few and too inaccurate");
    Ok(Candidate { topic: topic.to_owned(), frame, kind: Some(kind), times, is_empty, unsuitable })
}

fn has_radar_field(message: &RawMessage<'_>) -> bool {
    let fields = points::fields(message.data).unwrap_or_default().to_ascii_lowercase();
    RADAR_FIELDS.iter().any(|part| fields.contains(part))
}

fn planar_properties(kind: LidarKind, scan: &zsim_base::measurement::PlanarScan) -> (LidarKind, BeamTimes, bool) {
    let times = match (scan.time_increment_s == 0.0, scan::time_increment_s(scan) == 0.0) {
        (false, _) => BeamTimes::Stated,
        (true, false) => BeamTimes::Implied,
        (true, true) => BeamTimes::Unknown,
    };
    let limits = RangeLimits::new(scan.range_min_m, scan.range_max_m, None);
    (kind, times, !scan.ranges_m.iter().any(|range| limits.is_return(*range)))
}

/// Decodes an IMU message into a candidate.
///
/// # Errors
/// When it cannot be decoded.
pub fn probe_imu(message: &RawMessage<'_>, _: MessageType, topic: &str) -> Result<Candidate, DecodeError> {
    imu::decode(message.data, imu::ForceUnit::default())?;
    let frame = frame_of(message)?;
    Ok(Candidate {
        topic: topic.to_owned(),
        frame,
        kind: None,
        times: BeamTimes::Stated,
        is_empty: false,
        unsuitable: None,
    })
}
