//! One file of a recording, whatever its container.

use super::directory::{Channel, Directory};
use super::rows::Rows;
use super::source::Source;
use crate::recording::wire::Wire;
use std::collections::BTreeMap;

/// Number of a topic within a recording: that of its file, then that within the file.
pub type ChannelId = u32;

/// Bits of a [`ChannelId`] that count topics within a file.
const FILE_SHIFT: u32 = 16;

/// Where a file's messages are read from.
pub enum Store {
    /// A file of records: MCAP or a ROS 1 bag.
    Records(Source),
    /// An SQLite database of rosbag2.
    Rows(Rows),
}

impl Store {
    /// Bytes in the file.
    pub fn length(&self) -> u64 {
        match self {
            Self::Records(source) => source.length(),
            Self::Rows(rows) => rows.length(),
        }
    }
}

/// One file of a recording: where its messages are, and what they are.
pub struct Part {
    /// Where messages are read from.
    pub store: Store,
    /// What the file holds.
    pub directory: Directory,
    place: ChannelId,
    wires: BTreeMap<u16, Wire>,
}

impl Part {
    /// The file at `place` among those of a recording.
    pub fn new(place: u16, store: Store, directory: Directory) -> Self {
        let wire_of = |(id, encoding): (u16, &str)| Some((id, Wire::of_encoding(encoding)?));
        let encodings = directory.channels.values().map(|channel| (channel.id, channel.encoding.as_str()));
        let wires = encodings.filter_map(wire_of).collect();
        Self { store, directory, place: ChannelId::from(place), wires }
    }

    /// The topics.
    pub fn channels(&self) -> impl Iterator<Item = Channel> {
        self.directory.channels(|id| self.channel_id(id))
    }

    /// The number within the recording of the topic that is `id` within the file.
    pub fn channel_id(&self, id: u16) -> ChannelId {
        (self.place << FILE_SHIFT) | ChannelId::from(id)
    }

    /// Those of `channels` that are in this file, by their numbers within it.
    pub fn local(&self, channels: &[ChannelId]) -> Vec<u16> {
        let here = channels.iter().filter(|id| **id >> FILE_SHIFT == self.place);
        here.map(|id| (*id & ((1 << FILE_SHIFT) - 1)) as u16).collect()
    }

    /// How the messages of a topic are serialised; of one that is not decoded, CDR.
    pub fn wire(&self, id: u16) -> Wire {
        self.wires.get(&id).copied().unwrap_or(Wire::Cdr)
    }
}
