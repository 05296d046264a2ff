//! Topics that may be the lidar or the IMU, by their first messages.

use crate::recording::container::{ChannelId, Messages, RawMessage};
use crate::recording::message::transforms::plain;
use crate::recording::message::{imu, livox, multi_echo, points, scan};
use crate::recording::schema::MessageType;
use crate::recording::topics::TRUTH_PREFIX;
use crate::recording::wire::{DecodeError, Decoder};
use crate::recording::{Reader, RecordingError};
use std::collections::BTreeMap;

/// How a lidar's messages encode its beams.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LidarKind {
    /// As `LaserScan`.
    Scan,
    /// As `MultiEchoLaserScan`.
    MultiEcho,
    /// As `PointCloud2`.
    Points,
    /// As `CustomMsg` of Livox.
    Livox,
}

/// How well the times of beams are known, best first; equals are taken by kind, then by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum BeamTimes {
    /// Each message states them.
    Stated,
    /// Each message states them, by another clock than its stamp.
    OfOtherClock,
    /// They follow from the time that a turn takes.
    Implied,
    /// All beams seem to be fired at once.
    Unknown,
}

/// A topic that may be chosen.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Its name.
    pub topic: String,
    /// The frame of its first message.
    pub frame: String,
    /// How a lidar encodes its beams; `None` of an IMU.
    pub kind: Option<LidarKind>,
    /// How well the times of its beams are known.
    pub times: BeamTimes,
    is_empty: bool,
}

/// The topics of a sensor's types.
#[derive(Debug, Default)]
pub struct Candidates {
    /// Those whose messages can be decoded.
    pub found: Vec<Candidate>,
    /// Those whose messages cannot be used, each with the reason, a clause each.
    pub unusable: Vec<String>,
}

/// Understands a message of a topic.
type Look = fn(&RawMessage<'_>, MessageType, &str) -> Result<Candidate, DecodeError>;

impl Reader {
    /// Topics of `types` by the first message that `look` understands, preferably one with points; of one topic only,
    /// where it is `asked` for. Truth, the recording's own, is never among them unless it is asked for.
    ///
    /// # Errors
    /// When the file cannot be read, or the topic that is asked for is not there.
    pub fn candidates(
        &self,
        types: &[MessageType],
        asked: Option<&str>,
        look: Look,
    ) -> Result<Candidates, RecordingError> {
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
        let mut search = Search { open, look, found: Vec::new(), empty: BTreeMap::new(), failed: BTreeMap::new() };
        search.run(self.messages_near(&ids))?;
        search.run(self.messages())?;
        Ok(search.finish())
    }

    fn topic_error(&self, topic: &str, problem: String) -> RecordingError {
        let (name, has) = (self.name().to_owned(), self.what_it_has());
        RecordingError::Topic { name, topic: topic.to_owned(), problem, has }
    }
}

/// A search for the first message of each topic that can be used.
struct Search<'a> {
    open: BTreeMap<ChannelId, (MessageType, &'a str)>,
    look: Look,
    found: Vec<Candidate>,
    /// Topics whose messages so far have no points.
    empty: BTreeMap<&'a str, Candidate>,
    /// Why the first message of a topic cannot be decoded.
    failed: BTreeMap<&'a str, DecodeError>,
}

impl Search<'_> {
    fn run(&mut self, mut messages: Messages<'_>) -> Result<(), RecordingError> {
        while !self.open.is_empty() {
            let Some(message) = messages.next()? else { break };
            let Some((kind, topic)) = self.open.get(&message.channel).copied() else { continue };
            match (self.look)(&message, kind, topic) {
                Ok(candidate) if candidate.is_empty => {
                    self.empty.entry(topic).or_insert(candidate);
                }
                Ok(candidate) => {
                    // In a split recording a topic is a channel of each file.
                    self.open.retain(|_, (_, other)| *other != topic);
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
        for (kind, topic) in self.open.into_values() {
            if let Some(candidate) = self.empty.remove(topic) {
                self.found.push(candidate);
                continue;
            }
            let reason = match self.failed.get(topic) {
                Some(error) => format!("topic {topic}: {error} in its first message of type {}", kind.name()),
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
    Ok(plain(frame))
}

/// Understands a lidar's message.
///
/// # Errors
/// When it cannot be decoded.
pub fn lidar(message: &RawMessage<'_>, kind: MessageType, topic: &str) -> Result<Candidate, DecodeError> {
    let frame = frame_of(message)?;
    let (kind, times, is_empty) = match kind {
        MessageType::LaserScan => of_planar(LidarKind::Scan, &scan::decode(message.data)?.1),
        MessageType::MultiEchoLaserScan => of_planar(LidarKind::MultiEcho, &multi_echo::decode(message.data)?.1),
        MessageType::PointCloud2 => {
            let times = match points::by_other_clock(message.data)? {
                Some(false) => BeamTimes::Stated,
                Some(true) => BeamTimes::OfOtherClock,
                None => BeamTimes::Unknown,
            };
            (LidarKind::Points, times, points::is_empty(message.data)?)
        }
        _ => (LidarKind::Livox, BeamTimes::Stated, livox::decode(message.data, None)?.returns.is_empty()),
    };
    Ok(Candidate { topic: topic.to_owned(), frame, kind: Some(kind), times, is_empty })
}

fn of_planar(kind: LidarKind, scan: &crate::measurement::PlanarScan) -> (LidarKind, BeamTimes, bool) {
    let times = match (scan.time_increment_s == 0.0, scan::time_increment_s(scan) == 0.0) {
        (false, _) => BeamTimes::Stated,
        (true, false) => BeamTimes::Implied,
        (true, true) => BeamTimes::Unknown,
    };
    (kind, times, scan.ranges_m.is_empty())
}

/// Understands an IMU's message.
///
/// # Errors
/// When it cannot be decoded.
pub fn inertial(message: &RawMessage<'_>, _: MessageType, topic: &str) -> Result<Candidate, DecodeError> {
    imu::decode(message.data, imu::ForceUnit::default())?;
    let frame = frame_of(message)?;
    Ok(Candidate { topic: topic.to_owned(), frame, kind: None, times: BeamTimes::Stated, is_empty: false })
}
