//! What a recording holds: topics, rates, gaps, and what its clocks do.

mod clock;
mod intervals;

use crate::recording::container::{Channel, ChannelId, RawMessage};
use crate::recording::schema::MessageType;
use crate::recording::wire::Decoder;
use crate::recording::{Loss, Reader, RecordingError};
use crate::signal::StampPattern;
use crate::time::{Span, Stamp};
use clock::ClockFit;
use intervals::Intervals;
use serde::Serialize;
use std::collections::BTreeMap;

/// What a recording holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RecordingInfo {
    /// The file.
    pub name: String,
    /// Bytes in it.
    pub length_bytes: u64,
    /// From the first message's log time to the last's, s.
    pub duration_s: f64,
    /// Messages that could be read.
    pub messages: u64,
    /// Whether zsim's manifest is in it.
    pub has_manifest: bool,
    /// The topics, by name.
    pub topics: Vec<TopicInfo>,
    /// What could not be read.
    pub loss: Loss,
}

/// What a topic holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TopicInfo {
    /// Its name.
    pub topic: String,
    /// Type of its messages.
    pub type_name: String,
    /// Encoding of its messages.
    pub encoding: String,
    /// How many could be read.
    pub messages: u64,
    /// Log time of the first, ns.
    pub first_log_ns: Option<i64>,
    /// Log time of the last, ns.
    pub last_log_ns: Option<i64>,
    /// How often they come, Hz, at the start.
    pub rate_hz: Option<f64>,
    /// How their stamps lie about that: `regular`, `delayed`, `bursts` or `irregular`.
    pub pattern: Option<&'static str>,
    /// Longest time between one and the next, s.
    pub longest_gap_s: Option<f64>,
    /// Times between one and the next beyond the length that was asked for.
    pub gaps: u64,
    /// How many seem to be missing: what the rate would have put into the longer intervals.
    pub missing: u64,
    /// How many are stamped before the one that came before them.
    pub out_of_order: u64,
    /// What the stamps say against the log times; of topics whose messages are stamped.
    pub clock: Option<ClockStatistics>,
}

/// Stamps against log times: `stamp - log = offset + drift (log - first log) + jitter`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ClockStatistics {
    /// At the first message, s; positive where stamps are ahead.
    pub offset_s: f64,
    /// Parts per million; positive where the stamps' clock is fast.
    pub drift_ppm: f64,
    /// Standard deviation about the line, s.
    pub jitter_s: f64,
}

/// What is gathered of a topic while messages go by.
struct Gathered {
    messages: u64,
    first: Option<Stamp>,
    last: Option<Stamp>,
    intervals: Intervals,
    clock: Option<ClockFit>,
}

impl Gathered {
    fn new() -> Self {
        Self { messages: 0, first: None, last: None, intervals: Intervals::default(), clock: None }
    }

    /// Counts a message; intervals are of stamps where there are, as log times bunch up.
    fn add(&mut self, message: &RawMessage<'_>, channel: &Channel, gap: Span) {
        let log = Stamp::from_nanos(i64::try_from(message.log_time_ns).unwrap_or(i64::MAX));
        self.messages += 1;
        self.first = Some(self.first.unwrap_or(log));
        self.last = Some(log);
        let stamp = stamp_of(message, channel);
        self.intervals.add(stamp.unwrap_or(log), gap);
        if let Some(stamp) = stamp {
            self.clock.get_or_insert_with(|| ClockFit::starting(log, stamp)).add(log, stamp);
        }
    }
}

impl Reader {
    /// Reads all of the recording, and tells what is in it. Between messages of a topic, more than `gap` is a gap.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn info(&self, gap: Span) -> Result<RecordingInfo, RecordingError> {
        // A topic is one channel in each file of a split recording.
        let mut firsts = BTreeMap::new();
        let mut known: BTreeMap<ChannelId, (ChannelId, &Channel)> = BTreeMap::new();
        for channel in self.channels() {
            let first = *firsts.entry((&channel.topic, &channel.type_name)).or_insert(channel.id);
            known.insert(channel.id, (first, channel));
        }
        let mut gathered: BTreeMap<ChannelId, Gathered> = firsts.values().map(|id| (*id, Gathered::new())).collect();
        let mut loss = self.loss().clone();
        let mut messages = self.messages();
        while let Some(message) = messages.next()? {
            let channel = known.get(&message.channel);
            match channel.and_then(|(first, channel)| Some((channel, gathered.get_mut(first)?))) {
                Some((channel, topic)) => topic.add(&message, channel, gap),
                None => loss.unreadable_messages += 1,
            }
        }
        loss.add_pass(&messages, self.expected_messages());
        let first = gathered.values().filter_map(|topic| topic.first).min();
        let last = gathered.values().filter_map(|topic| topic.last).max();
        let mut topics: Vec<_> =
            self.channels().iter().filter_map(|c| Some(topic_info(c, gathered.remove(&c.id)?))).collect();
        topics.sort_by(|a, b| a.topic.cmp(&b.topic));
        Ok(RecordingInfo {
            name: self.name().to_owned(),
            length_bytes: self.length_bytes(),
            duration_s: first.zip(last).map_or(0.0, |(first, last)| last.seconds_since(first)),
            messages: topics.iter().map(|topic| topic.messages).sum(),
            has_manifest: self.manifest().is_some(),
            topics,
            loss,
        })
    }
}

fn topic_info(channel: &Channel, gathered: Gathered) -> TopicInfo {
    let intervals = gathered.intervals.finish();
    TopicInfo {
        topic: channel.topic.clone(),
        type_name: channel.type_name.clone(),
        encoding: channel.encoding.clone(),
        messages: gathered.messages,
        first_log_ns: gathered.first.map(Stamp::nanos),
        last_log_ns: gathered.last.map(Stamp::nanos),
        rate_hz: intervals.period.map(|period| 1.0 / period.seconds()),
        pattern: intervals.pattern.map(StampPattern::name),
        longest_gap_s: intervals.longest.map(Span::seconds),
        gaps: intervals.gaps,
        missing: intervals.missing,
        out_of_order: intervals.out_of_order,
        clock: gathered.clock.and_then(|fit| fit.statistics()),
    }
}

/// The stamp that a message begins with, where its type has one.
fn stamp_of(message: &RawMessage<'_>, channel: &Channel) -> Option<Stamp> {
    channel.wire?;
    let mut input = Decoder::new(message.data).ok()?;
    if MessageType::Transforms.is_named(&channel.type_name) {
        // The stamp of the first transform, behind their number.
        let count = input.u32().ok()?;
        return if count > 0 { input.time().ok() } else { None };
    }
    if channel.has_header { input.time().ok() } else { None }
}
