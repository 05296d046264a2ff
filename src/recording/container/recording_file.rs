//! One file of a recording, of any container format.

use super::database::SqliteDatabase;
use super::file_index::{Channel, ChannelId, FileIndex};
use super::source::Source;
use crate::wire::WireFormat;
use std::collections::BTreeMap;

/// Bits of a [`ChannelId`] for the number within the file.
const FILE_SHIFT: u32 = 16;

/// Storage of a file's messages.
pub enum Store {
    /// File of records: MCAP or a ROS 1 bag.
    Records(Source),
    /// rosbag2 SQLite database.
    Database(SqliteDatabase),
}

impl Store {
    /// Size of the file, bytes.
    pub fn length(&self) -> u64 {
        match self {
            Self::Records(source) => source.length(),
            Self::Database(database) => database.length(),
        }
    }
}

/// One file of a recording.
pub struct RecordingFile {
    /// Storage of the messages.
    pub store: Store,
    /// Index of the file.
    pub index: FileIndex,
    number: ChannelId,
    wires: BTreeMap<u16, WireFormat>,
}

impl RecordingFile {
    /// Creates the file with the given number in the recording.
    pub fn new(number: u16, store: Store, index: FileIndex) -> Self {
        let format_of = |(id, encoding): (u16, &str)| Some((id, WireFormat::from_encoding(encoding)?));
        let encodings = index.channels.iter().map(|(id, channel)| (*id, channel.encoding.as_str()));
        let wires = encodings.filter_map(format_of).collect();
        Self { store, index, number: ChannelId::from(number), wires }
    }

    /// The topics.
    pub fn channels(&self) -> impl Iterator<Item = Channel> {
        self.index.channels(|id| self.channel_id(id))
    }

    /// Number within the recording of the topic with number `id` within the file.
    pub fn channel_id(&self, id: u16) -> ChannelId {
        (self.number << FILE_SHIFT) | ChannelId::from(id)
    }

    /// Numbers within this file of those `channels` that belong to it.
    pub fn local_ids(&self, channels: &[ChannelId]) -> Vec<u16> {
        let here = channels.iter().filter(|id| **id >> FILE_SHIFT == self.number);
        here.map(|id| (*id & ((1 << FILE_SHIFT) - 1)) as u16).collect()
    }

    /// Serialisation of a topic's messages; CDR if it is not supported.
    pub fn wire(&self, id: u16) -> WireFormat {
        self.wires.get(&id).copied().unwrap_or(WireFormat::Cdr)
    }
}
