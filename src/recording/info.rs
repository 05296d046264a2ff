//! Summary of a recording: topics, rates, gaps and clock statistics.

mod clock;
mod intervals;

pub use clock::ClockStatistics;

use crate::container::{Channel, ChannelId, RawMessage};
use crate::message::transforms;
use crate::stamp_screen::StampScreen;
use crate::wire::Decoder;
use crate::{Loss, Reader, RecordingError};
use clock::ClockFit;
use intervals::Intervals;
use serde::Serialize;
use std::collections::BTreeMap;
use zsim_base::signal::StampPattern;
use zsim_base::time::{Span, Stamp};

/// Summary of a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RecordingInfo {
    /// File name.
    pub name: String,
    /// File size, bytes.
    pub length_bytes: u64,
    /// Log time of the last message minus that of the first, s.
    pub duration_s: f64,
    /// Number of readable messages.
    pub messages: u64,
    /// Whether the file contains zsim's manifest.
    pub has_manifest: bool,
    /// Topics, sorted by name.
    pub topics: Vec<TopicInfo>,
    /// Data that could not be read.
    pub loss: Loss,
}

/// Summary of a topic.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TopicInfo {
    /// Topic name.
    pub topic: String,
    /// Message type.
    pub type_name: String,
    /// Message encoding.
    pub encoding: String,
    /// Number of readable messages.
    pub messages: u64,
    /// Log time of the first message, ns.
    pub first_log_ns: Option<i64>,
    /// Log time of the last message, ns.
    pub last_log_ns: Option<i64>,
    /// Message rate at the start, Hz.
    pub rate_hz: Option<f64>,
    /// Pattern of the stamps about that rate: `regular`, `delayed`, `bursts` or `irregular`.
    pub pattern: Option<&'static str>,
    /// Longest interval between consecutive messages, s.
    pub longest_gap_s: Option<f64>,
    /// Number of intervals longer than the requested gap length.
    pub gaps: u64,
    /// Estimated number of missing messages, from the rate and the longer intervals.
    pub missing: u64,
    /// Number of messages stamped before their predecessor.
    pub out_of_order: u64,
    /// Clock of the stamps relative to log time; only for messages with stamps.
    pub clock: Option<ClockStatistics>,
}

/// Accumulates the statistics of a topic.
struct TopicAccumulator {
    messages: u64,
    first: Option<Stamp>,
    last: Option<Stamp>,
    screen: StampScreen<(Stamp, Stamp)>,
    stamps: StampStatistics,
}

/// Statistics of the stamps that are not outliers, without steps of the clock.
#[derive(Default)]
struct StampStatistics {
    intervals: Intervals,
    clock: Option<ClockFit>,
}

impl StampStatistics {
    fn add(&mut self, log: Stamp, stamp: Stamp, gap: Span) {
        self.intervals.add(stamp, gap);
        self.clock.get_or_insert_with(|| ClockFit::starting(log, stamp)).add(log, stamp);
    }
}

impl TopicAccumulator {
    fn new() -> Self {
        let (screen, stamps) = (StampScreen::default(), StampStatistics::default());
        Self { messages: 0, first: None, last: None, screen, stamps }
    }

    /// Counts a message. Intervals are between stamps if there are any, because log times are bunched.
    fn add(&mut self, message: &RawMessage<'_>, channel: &Channel, gap: Span) {
        let log = Stamp::from_nanos(i64::try_from(message.log_time_ns).unwrap_or(i64::MAX));
        self.messages += 1;
        self.first = Some(self.first.unwrap_or(log));
        self.last = Some(log);
        match stamp_of(message, channel) {
            Some(stamp) => {
                let accept = &mut |(log, stamp), shift| self.stamps.add(log, stamp - shift, gap);
                self.screen.push((log, stamp), (log, stamp), None, accept);
            }
            None => self.stamps.intervals.add(log, gap),
        }
    }

    /// Adds the last stamps, and counts outliers and steps of the clock in `loss`.
    fn finish(&mut self, topic: &str, gap: Span, loss: &mut Loss) {
        self.screen.finish(&mut |(log, stamp), shift| self.stamps.add(log, stamp - shift, gap));
        loss.outlying_stamps += self.screen.outliers;
        loss.clock_steps.extend(self.screen.clock_steps(topic, Span::ZERO));
    }
}

impl Reader {
    /// Reads the whole recording and summarises it. An interval longer than `gap` counts as a gap.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn info(&self, gap: Span) -> Result<RecordingInfo, RecordingError> {
        // In a split recording a topic has one channel per file.
        let mut first_ids = BTreeMap::new();
        let mut known: BTreeMap<ChannelId, (ChannelId, &Channel)> = BTreeMap::new();
        for channel in self.channels() {
            let first = *first_ids.entry((&channel.topic, &channel.type_name)).or_insert(channel.id);
            known.insert(channel.id, (first, channel));
        }
        let mut accumulators: BTreeMap<ChannelId, TopicAccumulator> =
            first_ids.values().map(|id| (*id, TopicAccumulator::new())).collect();
        let mut loss = self.loss().clone();
        let mut messages = self.messages();
        while let Some(message) = messages.next()? {
            let channel = known.get(&message.channel);
            match channel.and_then(|(first, channel)| Some((channel, accumulators.get_mut(first)?))) {
                Some((channel, topic)) => topic.add(&message, channel, gap),
                None => loss.unreadable_messages += 1,
            }
        }
        loss.add_pass(&messages, self.expected_messages());
        for channel in self.channels() {
            let topic = accumulators.get_mut(&channel.id);
            topic.into_iter().for_each(|topic| topic.finish(&channel.topic, gap, &mut loss));
        }
        let first = accumulators.values().filter_map(|topic| topic.first).min();
        let last = accumulators.values().filter_map(|topic| topic.last).max();
        let mut topics: Vec<_> =
            self.channels().iter().filter_map(|c| Some(topic_info(c, accumulators.remove(&c.id)?))).collect();
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

fn topic_info(channel: &Channel, accumulator: TopicAccumulator) -> TopicInfo {
    let StampStatistics { intervals, clock } = accumulator.stamps;
    let intervals = intervals.finish();
    TopicInfo {
        topic: channel.topic.clone(),
        type_name: channel.type_name.clone(),
        encoding: channel.encoding.clone(),
        messages: accumulator.messages,
        first_log_ns: accumulator.first.map(Stamp::nanos),
        last_log_ns: accumulator.last.map(Stamp::nanos),
        rate_hz: intervals.period.map(|period| 1.0 / period.seconds()),
        pattern: intervals.pattern.map(StampPattern::name),
        longest_gap_s: intervals.longest.map(Span::seconds),
        gaps: intervals.gaps,
        missing: intervals.missing,
        out_of_order: intervals.out_of_order,
        clock: clock.and_then(|fit| fit.statistics()),
    }
}

/// Stamp at the start of a message, if the type has one.
fn stamp_of(message: &RawMessage<'_>, channel: &Channel) -> Option<Stamp> {
    channel.wire?;
    let mut input = Decoder::new(message.data).ok()?;
    if transforms::is_type(&channel.type_name) {
        // The stamp of the first transform, after the number of transforms.
        let count = input.u32().ok()?;
        return if count > 0 { input.header_stamp().ok() } else { None };
    }
    if channel.has_header { input.header_stamp().ok() } else { None }
}
