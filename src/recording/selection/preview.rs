//! First seconds of a recording, from which units, content and clocks are detected.

use super::clocks::LogTimes;
use crate::container::{ChannelId, RawMessage};
use crate::message::imu::{self, ForceUnit};
use crate::message::transforms::{is_frame, printable_frame};
use crate::quantile::quantile;
use crate::topics::shortened;
use crate::wire::Decoder;
use crate::{Reader, RecordingError};
use std::collections::BTreeMap;
use zsim_base::measurement::ImuSample;
use zsim_base::time::Stamp;

/// Clouds from which the encoding of point times is detected, and scans whose duration is measured: enough for a median.
pub const PREVIEW_MESSAGES: usize = 20;

/// Length of the preview, s of log time: above the 10 s that prove the absence of gravity.
const PREVIEW_S: f64 = 12.0;

/// Maximum number of messages in the preview: bounds the memory.
const MAX_MESSAGES: usize = 60_000;

/// Maximum number of frames on one topic that are distinguished.
const MAX_FRAMES: usize = 8;

/// First messages of an IMU topic, with accelerations in the unit of the file.
#[derive(Debug, Clone, Default)]
pub struct ImuPreview {
    /// Samples in order of their stamps.
    pub samples: Vec<ImuSample>,
    /// Log times of the samples.
    pub log_times: LogTimes,
    /// Frames of the samples.
    pub frames: FrameCounts,
}

/// Headers of the first messages of a lidar.
#[derive(Debug, Clone, Default)]
pub struct HeaderPreview {
    /// Log times and stamps.
    pub log_times: LogTimes,
    /// Frames of the messages.
    pub frames: FrameCounts,
}

/// Number of messages of each frame on a topic, in the order in which the frames appear.
#[derive(Debug, Clone, Default)]
pub struct FrameCounts(Vec<(String, usize)>);

impl FrameCounts {
    /// Counts a message.
    fn add(&mut self, frame: &str) {
        if let Some((_, count)) = self.0.iter_mut().find(|(known, _)| is_frame(frame, known)) {
            *count += 1;
        } else if self.0.len() < MAX_FRAMES {
            self.0.push((printable_frame(frame), 1));
        }
    }

    /// The frame of most messages; of several the first.
    pub fn main(&self) -> Option<&str> {
        self.0.iter().rev().max_by_key(|(_, count)| *count).map(|(frame, _)| frame.as_str())
    }

    /// Reports several frames on a topic.
    pub fn note(&self, topic: &str) -> Option<String> {
        let main = self.main()?;
        let others: Vec<_> = self.0.iter().map(|(frame, _)| frame.as_str()).filter(|frame| *frame != main).collect();
        (!others.is_empty()).then(|| {
            let (main, others) = (shortened(main), others.into_iter().map(shortened).collect::<Vec<_>>().join(", "));
            format!("{topic} has messages of several frames: those of {main} are used, not those of {others}.")
        })
    }
}

impl ImuPreview {
    /// Median interval of the samples that satisfy `has`, s.
    pub fn period_s(&self, has: impl Fn(&ImuSample) -> bool) -> f64 {
        let stamps: Vec<_> = self.samples.iter().filter(|sample| has(sample)).map(|sample| sample.stamp).collect();
        quantile(stamps.windows(2).map(|pair| pair[1].seconds_since(pair[0])).collect(), 0.5)
    }
}

impl Reader {
    /// Calls `take` with the messages of `ids` in the first seconds.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn for_first_messages(
        &self,
        ids: &[ChannelId],
        mut take: impl FnMut(&RawMessage<'_>, Stamp),
    ) -> Result<(), RecordingError> {
        let (mut messages, mut first, mut count) = (self.messages_in_blocks_of(ids), None, 0);
        while let Some(message) = messages.next()? {
            let log = Stamp::from_nanos(i64::try_from(message.log_time_ns).unwrap_or(i64::MAX));
            if count >= MAX_MESSAGES || log.seconds_since(*first.get_or_insert(log)) > PREVIEW_S {
                break;
            }
            if ids.contains(&message.channel) {
                count += 1;
                take(&message, log);
            }
        }
        Ok(())
    }

    /// Reads the first samples of several IMU topics.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn preview_imus<'t>(
        &self,
        topics: impl Iterator<Item = &'t str>,
    ) -> Result<BTreeMap<String, ImuPreview>, RecordingError> {
        let ids: BTreeMap<ChannelId, &str> =
            topics.flat_map(|topic| self.ids_of(topic).into_iter().map(move |id| (id, topic))).collect();
        let mut previews: BTreeMap<String, ImuPreview> = BTreeMap::new();
        self.for_first_messages(&ids.keys().copied().collect::<Vec<_>>(), |message, log| {
            let sample = imu::decode(message.data, ForceUnit::default()).ok().filter(imu::is_finite);
            if let (Some(sample), Some(topic)) = (sample, ids.get(&message.channel)) {
                let preview = previews.entry((*topic).to_owned()).or_default();
                preview.samples.push(sample);
                preview.log_times.pairs.push((log, sample.stamp));
                if let Ok((_, frame)) = Decoder::new(message.data).and_then(|mut input| input.header()) {
                    preview.frames.add(frame);
                }
            }
        })?;
        previews.values_mut().for_each(|preview| preview.samples.sort_by_key(|sample| sample.stamp));
        Ok(previews)
    }

    /// Reads the headers of the first messages of a lidar.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn preview_headers(&self, topic: &str) -> Result<HeaderPreview, RecordingError> {
        let mut preview = HeaderPreview::default();
        self.for_first_messages(&self.ids_of(topic), |message, log| {
            if let Ok((stamp, frame)) = Decoder::new(message.data).and_then(|mut input| input.header()) {
                preview.log_times.pairs.push((log, stamp));
                preview.frames.add(frame);
            }
        })?;
        Ok(preview)
    }
}
