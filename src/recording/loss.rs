use super::container::{Directory, Ending, Messages};
use serde::Serialize;
use std::fmt;

/// What of a recording could not be read. Whoever uses the rest says so.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Loss {
    /// Whether the file ends without its summary: its writer was stopped, or the file was cut.
    pub cut_short: bool,
    /// Whether the summary's checksum does not match; then it is not used.
    pub damaged_summary: bool,
    /// Bytes that could not be read.
    pub lost_bytes: u64,
    /// Chunks that do not decompress, or whose checksum does not match.
    pub damaged_chunks: u64,
    /// Messages that the summary counts and that were not there, of all topics together.
    pub missing_messages: u64,
    /// Messages whose bytes are not what their type says.
    pub unreadable_messages: u64,
    /// IMU samples with NaN or infinity in them.
    pub samples_not_finite: u64,
    /// Scans that came twice and were used once; not a loss.
    pub repeated_scans: u64,
    /// IMU samples that came twice and were used once; not a loss.
    pub repeated_samples: u64,
}

impl Loss {
    /// What the files as a whole lost.
    pub(super) fn of_files<'d>(directories: impl Iterator<Item = &'d Directory>) -> Self {
        directories.fold(Self::default(), |loss, directory| Self {
            cut_short: loss.cut_short || directory.ending == Ending::CutShort,
            damaged_summary: loss.damaged_summary || directory.ending == Ending::SummaryDamaged,
            lost_bytes: loss.lost_bytes + directory.lost_bytes,
            ..loss
        })
    }

    /// Adds what a pass through all messages met, `expected` of them by the summary.
    pub(super) fn add_pass(&mut self, pass: &Messages<'_>, expected: Option<u64>) {
        self.damaged_chunks += pass.damaged().len() as u64;
        self.lost_bytes += pass.damaged().iter().map(|block| block.bytes).sum::<u64>();
        self.missing_messages += expected.map_or(0, |expected| expected.saturating_sub(pass.count()));
    }

    /// Whether nothing was lost.
    pub fn is_none(&self) -> bool {
        *self
            == Self { repeated_scans: self.repeated_scans, repeated_samples: self.repeated_samples, ..Self::default() }
    }

    /// What was left out without loss, a sentence each.
    pub fn notes(&self) -> Vec<String> {
        let counted =
            |count: u64, what: &str| (count > 0).then(|| format!("{count} {what} came twice and were used once"));
        [counted(self.repeated_scans, "scans"), counted(self.repeated_samples, "IMU samples")]
            .into_iter()
            .flatten()
            .collect()
    }

    /// What was lost, a sentence each.
    pub fn sentences(&self) -> Vec<String> {
        let counted = |count: u64, sentence: &str| (count > 0).then(|| format!("{count} {sentence}"));
        let stated = |holds: bool, sentence: &str| holds.then(|| sentence.to_owned());
        [
            stated(self.cut_short, "The file ends without its summary; what was complete before is used."),
            stated(self.damaged_summary, "The file's summary is damaged; what it says was found by reading."),
            counted(self.lost_bytes, "bytes could not be read."),
            counted(self.damaged_chunks, "chunks are damaged and were left out."),
            counted(self.missing_messages, "messages, of all topics together, are missing."),
            counted(self.unreadable_messages, "messages are not what their type says and were left out."),
            counted(self.samples_not_finite, "IMU samples are not finite and were left out."),
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
