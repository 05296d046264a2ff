use super::container::{DamagedBlock, Directory, Ending};
use serde::Serialize;
use std::fmt;

/// What of a recording could not be read. Whoever uses the rest says so.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Loss {
    /// Whether the file ends without its summary: its writer was stopped, or the file was cut.
    pub cut_short: bool,
    /// Bytes that belong to no readable record.
    pub lost_bytes: u64,
    /// Chunks that do not decompress, or whose checksum does not match.
    pub damaged_chunks: u64,
    /// Messages in those chunks, as far as an index tells.
    pub messages_in_damaged_chunks: u64,
    /// Messages whose bytes are not what their type says.
    pub unreadable_messages: u64,
    /// IMU samples with NaN or infinity in them.
    pub samples_not_finite: u64,
}

impl Loss {
    /// What the file as a whole lost.
    pub(super) fn of_file(directory: &Directory) -> Self {
        Self { cut_short: directory.ending == Ending::CutShort, lost_bytes: directory.lost_bytes, ..Self::default() }
    }

    pub(super) fn add_blocks(&mut self, damaged: &[DamagedBlock]) {
        for block in damaged {
            self.damaged_chunks += 1;
            self.lost_bytes += block.bytes;
            self.messages_in_damaged_chunks += block.messages;
        }
    }

    /// Whether nothing was lost.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// What was lost, a sentence each.
    pub fn sentences(&self) -> Vec<String> {
        let mut said = Vec::new();
        if self.cut_short {
            said.push("The file ends without its summary; what was complete before is used.".to_owned());
        }
        if self.lost_bytes > 0 {
            said.push(format!("{} bytes could not be read.", self.lost_bytes));
        }
        if self.damaged_chunks > 0 {
            said.push(format!(
                "{} damaged chunks were left out, with {} messages or more.",
                self.damaged_chunks, self.messages_in_damaged_chunks
            ));
        }
        if self.unreadable_messages > 0 {
            said.push(format!("{} messages are not what their type says.", self.unreadable_messages));
        }
        if self.samples_not_finite > 0 {
            said.push(format!("{} IMU samples are not finite and were left out.", self.samples_not_finite));
        }
        said
    }
}

impl fmt::Display for Loss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.sentences().join(" "))
    }
}
