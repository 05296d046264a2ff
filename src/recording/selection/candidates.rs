//! Topics that may be the lidar or the IMU, judged by their first messages.

use crate::container::{ChannelId, Messages, RawMessage};
use crate::message::transforms::printable_frame;
use crate::message::{imu, livox, multi_echo, points, scan};
use crate::schema::MessageType;
use crate::topics::TRUTH_PREFIX;
use crate::wire::{DecodeError, Decoder};
use crate::{Reader, RecordingError};
use std::collections::BTreeMap;

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
    is_empty: bool,
}

/// Topics with the message types of a sensor.
#[derive(Debug, Default)]
pub struct Candidates {
    /// Topics whose messages can be decoded.
    pub found: Vec<Candidate>,
    /// Topics that are not usable, with the reason, one clause each.
    pub unusable: Vec<String>,
}

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
        Ok(search.finish())
    }

    fn topic_error(&self, topic: &str, problem: String) -> RecordingError {
        let (name, has) = (self.name().to_owned(), self.topic_list());
        RecordingError::Topic { name, topic: topic.to_owned(), problem, has }
    }
}

/// Search for the first usable message of each topic.
struct CandidateSearch<'a> {
    remaining: BTreeMap<ChannelId, (MessageType, &'a str)>,
    probe: Probe,
    found: Vec<Candidate>,
    /// Topics whose messages have no points so far.
    empty: BTreeMap<&'a str, Candidate>,
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
                    self.empty.entry(topic).or_insert(candidate);
                }
                Ok(candidate) => {
                    // In a split recording a topic has one channel per file.
                    self.remaining.retain(|_, (_, other)| *other != topic);
                    self.found.push(candidate);
                }
                Err(error) => {
                    self.failed.entry(topic).or_insert(error);
                }
            }
        }
        Ok(())
    }

    fn finish(mut self) -> Candidates {
        let mut unusable = BTreeMap::new();
        for (kind, topic) in self.remaining.into_values() {
            if let Some(candidate) = self.empty.remove(topic) {
                self.found.push(candidate);
                continue;
            }
            let reason = match self.failed.get(topic) {
                Some(error) => format!("topic {topic}: {error} in its first {} message", kind.name()),
                None => format!("topic {topic} has no messages"),
            };
            if self.found.iter().all(|candidate| candidate.topic != topic) {
                unusable.insert(topic, reason);
            }
        }
        Candidates { found: self.found, unusable: unusable.into_values().collect() }
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
            let times = match points::has_other_clock(message.data)? {
                Some(false) => BeamTimes::Stated,
                Some(true) => BeamTimes::OtherClock,
                None => BeamTimes::Unknown,
            };
            (LidarKind::Points, times, points::is_empty(message.data)?)
        }
        _ => (LidarKind::Livox, BeamTimes::Stated, livox::decode(message.data, None)?.returns.is_empty()),
    };
    Ok(Candidate { topic: topic.to_owned(), frame, kind: Some(kind), times, is_empty })
}

fn planar_properties(kind: LidarKind, scan: &zsim_base::measurement::PlanarScan) -> (LidarKind, BeamTimes, bool) {
    let times = match (scan.time_increment_s == 0.0, scan::time_increment_s(scan) == 0.0) {
        (false, _) => BeamTimes::Stated,
        (true, false) => BeamTimes::Implied,
        (true, true) => BeamTimes::Unknown,
    };
    (kind, times, scan.ranges_m.is_empty())
}

/// Decodes an IMU message into a candidate.
///
/// # Errors
/// When it cannot be decoded.
pub fn probe_imu(message: &RawMessage<'_>, _: MessageType, topic: &str) -> Result<Candidate, DecodeError> {
    imu::decode(message.data, imu::ForceUnit::default())?;
    let frame = frame_of(message)?;
    Ok(Candidate { topic: topic.to_owned(), frame, kind: None, times: BeamTimes::Stated, is_empty: false })
}
