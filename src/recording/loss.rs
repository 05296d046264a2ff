use super::clock_step::ClockStep;
use super::container::{Ending, FileIndex, Messages};
use super::message::transforms::{is_frame, printable_frame};
use super::topics::shortened;
use serde::Serialize;
use std::fmt;

/// Maximum number of messages in a compressed byte.
const MAX_MESSAGES_PER_BYTE: u64 = 16;

/// Data of a recording that could not be read.
///
/// Whoever uses the remaining data reports it.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Loss {
    /// Whether the file has no summary: the writer was stopped, or the file is truncated.
    pub cut_short: bool,
    /// Whether the summary's checksum does not match; the summary is then ignored.
    pub damaged_summary: bool,
    /// Number of unreadable bytes.
    pub lost_bytes: u64,
    /// Number of chunks that do not decompress, or whose checksum does not match.
    pub damaged_chunks: u64,
    /// Number of messages that the summary counts but that were not found, all topics together.
    pub missing_messages: u64,
    /// Number of messages whose bytes do not match their type.
    pub unreadable_messages: u64,
    /// Number of IMU samples with NaN or infinity.
    pub samples_not_finite: u64,
    /// Number of lidar returns whose time is far from those of their cloud.
    pub impossible_point_times: u64,
    /// Messages on a sensor's topic whose frame is not the sensor's; not a loss.
    pub other_frames: Vec<OtherFrame>,
    /// Number of duplicate scans, each used once; not a loss.
    pub repeated_scans: u64,
    /// Number of duplicate IMU samples, each used once; not a loss.
    pub repeated_samples: u64,
    /// Number of messages dropped because their stamps are far from those before and after; not a loss.
    pub outlying_stamps: u64,
    /// Steps of the sensors' clocks, which are removed from the stamps; not a loss.
    pub clock_steps: Vec<ClockStep>,
}

/// Messages on a sensor's topic that have another frame than the sensor.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct OtherFrame {
    /// Topic name.
    pub topic: String,
    /// Frame; the last of many frames count as one, `other frames`.
    pub frame: String,
    /// Number of messages.
    pub messages: u64,
}

/// Maximum number of other frames that are distinguished.
const MAX_OTHER_FRAMES: usize = 8;

impl Loss {
    /// Counts a message on `topic` that has another frame than the sensor.
    pub(super) fn add_other_frame(&mut self, topic: &str, frame: &str) {
        let is_full = self.other_frames.len() >= MAX_OTHER_FRAMES;
        let known = |other: &&mut OtherFrame| other.topic == topic && is_frame(frame, &other.frame);
        if let Some(other) = self.other_frames.iter_mut().find(known) {
            other.messages += 1;
        } else if let Some(last) = self.other_frames.last_mut().filter(|_| is_full) {
            last.messages += 1;
            "other frames".clone_into(&mut last.frame);
        } else {
            self.other_frames.push(OtherFrame { topic: topic.to_owned(), frame: printable_frame(frame), messages: 1 });
        }
    }

    /// Losses of the files, according to their indices.
    pub(super) fn of_files<'d>(indices: impl Iterator<Item = &'d FileIndex>) -> Self {
        indices.fold(Self::default(), |loss, index| Self {
            cut_short: loss.cut_short || index.ending == Ending::CutShort,
            damaged_summary: loss.damaged_summary || index.ending == Ending::SummaryDamaged,
            lost_bytes: loss.lost_bytes + index.lost_bytes,
            ..loss
        })
    }

    /// Adds the losses of a pass through all messages, of which the summary counts `expected`.
    ///
    /// The count is only believed if messages can be missing: where the whole file was read, the count is wrong.
    pub(super) fn add_pass(&mut self, pass: &Messages<'_>, expected: Option<u64>) {
        self.damaged_chunks += pass.damaged().len() as u64;
        self.lost_bytes += pass.damaged().iter().map(|block| block.bytes).sum::<u64>();
        let missing = expected.map_or(0, |expected| expected.saturating_sub(pass.count()));
        if missing <= self.lost_bytes.saturating_mul(MAX_MESSAGES_PER_BYTE) {
            self.missing_messages += missing;
        }
    }

    /// Whether no data were lost.
    pub fn is_none(&self) -> bool {
        let Self { repeated_scans, repeated_samples, outlying_stamps, .. } = *self;
        let (clock_steps, other_frames) = (self.clock_steps.clone(), self.other_frames.clone());
        let notes =
            Self { repeated_scans, repeated_samples, outlying_stamps, clock_steps, other_frames, ..Self::default() };
        *self == notes
    }

    /// Notes on data skipped without loss, one sentence each.
    pub fn notes(&self) -> Vec<String> {
        let counted = |count: u64, what: &str| (count > 0).then(|| format!("{what}: {count}"));
        let counts = [
            counted(self.repeated_scans, "duplicate scans ignored"),
            counted(self.repeated_samples, "duplicate IMU samples ignored"),
            counted(self.outlying_stamps, "dropped messages, whose stamps are far from those before and after them"),
        ];
        let other_frame = |other: &OtherFrame| {
            let OtherFrame { topic, frame, messages } = other;
            format!(
                "{messages} messages of {topic} have the frame {}, not that of the sensor, and were not used",
                shortened(frame)
            )
        };
        counts.into_iter().flatten().chain(self.other_frames.iter().map(other_frame)).collect()
    }

    /// Descriptions of the losses, one sentence each.
    pub fn sentences(&self) -> Vec<String> {
        let counted = |count: u64, sentence: &str| (count > 0).then(|| format!("{count} {sentence}"));
        let stated = |holds: bool, sentence: &str| holds.then(|| sentence.to_owned());
        [
            stated(self.cut_short, "The file is truncated (no summary); its complete part is used."),
            stated(self.damaged_summary, "The file's summary is damaged; the index was rebuilt from the data."),
            counted(self.lost_bytes, "bytes are unreadable."),
            counted(self.damaged_chunks, "chunks are damaged and were skipped."),
            counted(self.missing_messages, "messages (all topics together) are missing."),
            counted(self.unreadable_messages, "messages do not match their type and were skipped."),
            counted(self.samples_not_finite, "IMU samples are not finite and were skipped."),
            counted(
                self.impossible_point_times,
                "lidar returns have times far from those of their cloud and were skipped.",
            ),
        ]
        .into_iter()
        .flatten()
        .collect()
    }
}

impl fmt::Display for Loss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.sentences().join(" "))
    }
}
