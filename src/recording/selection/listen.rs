//! The first seconds of a recording, by which units, contents and clocks are recognised.

use super::clocks::Logged;
use super::content::quantile;
use crate::measurement::ImuSample;
use crate::recording::container::{ChannelId, RawMessage};
use crate::recording::measurements::is_finite;
use crate::recording::message::imu::{self, ForceUnit};
use crate::recording::wire::Decoder;
use crate::recording::{Reader, RecordingError};
use crate::time::Stamp;
use std::collections::BTreeMap;

/// How much of a recording is listened to, s by log times.
const LISTEN_S: f64 = 12.0;

/// Most messages that are listened to.
const MOST: usize = 60_000;

/// What an IMU topic's first messages are, with accelerations as they are written.
#[derive(Debug, Clone, Default)]
pub struct Heard {
    /// The samples, in the order of their stamps.
    pub samples: Vec<ImuSample>,
    /// When they were logged.
    pub logged: Logged,
}

impl Heard {
    /// Median time from sample to sample among those that `has`, s.
    pub fn period_s(&self, has: impl Fn(&ImuSample) -> bool) -> f64 {
        let stamps: Vec<_> = self.samples.iter().filter(|sample| has(sample)).map(|sample| sample.stamp).collect();
        quantile(stamps.windows(2).map(|pair| pair[1].seconds_since(pair[0])).collect(), 0.5)
    }
}

impl Reader {
    /// Gives `take` the messages of `ids` in the first seconds, until it wants no more.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn listen(
        &self,
        ids: &[ChannelId],
        mut take: impl FnMut(&RawMessage<'_>, Stamp),
    ) -> Result<(), RecordingError> {
        let (mut messages, mut first, mut count) = (self.messages_near(ids), None, 0);
        while let Some(message) = messages.next()? {
            let log = Stamp::from_nanos(i64::try_from(message.log_time_ns).unwrap_or(i64::MAX));
            if count >= MOST || log.seconds_since(*first.get_or_insert(log)) > LISTEN_S {
                break;
            }
            if ids.contains(&message.channel) {
                count += 1;
                take(&message, log);
            }
        }
        Ok(())
    }

    /// The first samples of several IMU topics.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn hear<'t>(&self, topics: impl Iterator<Item = &'t str>) -> Result<BTreeMap<String, Heard>, RecordingError> {
        let ids: BTreeMap<ChannelId, &str> =
            topics.flat_map(|topic| self.ids_of(topic).into_iter().map(move |id| (id, topic))).collect();
        let mut heard: BTreeMap<String, Heard> = BTreeMap::new();
        self.listen(&ids.keys().copied().collect::<Vec<_>>(), |message, log| {
            let sample = imu::decode(message.data, ForceUnit::default()).ok().filter(is_finite);
            if let (Some(sample), Some(topic)) = (sample, ids.get(&message.channel)) {
                let heard = heard.entry((*topic).to_owned()).or_default();
                heard.samples.push(sample);
                heard.logged.times.push((log, sample.stamp));
            }
        })?;
        heard.values_mut().for_each(|heard| heard.samples.sort_by_key(|sample| sample.stamp));
        Ok(heard)
    }

    /// When the first messages of a lidar were logged, and what their headers are stamped.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn logged(&self, topic: &str) -> Result<Logged, RecordingError> {
        let mut logged = Logged::default();
        self.listen(&self.ids_of(topic), |message, log| {
            let header = Decoder::new(message.data).and_then(|mut input| input.header());
            logged.times.extend(header.ok().map(|(stamp, _)| (log, stamp)));
        })?;
        Ok(logged)
    }
}
