//! What a file holds and where, without its messages.

use super::bag::{self, BagChunk};
use super::part::ChannelId;
use super::record::{self, ChannelRecord, ChunkHeader, SchemaRecord, op};
use crate::recording::topics::printable;
use crate::recording::wire::Wire;
use std::collections::BTreeMap;

/// A topic and the type of its messages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Channel {
    /// Its number in the recording.
    pub id: ChannelId,
    /// Its name, with control characters escaped.
    pub topic: String,
    /// The type of its messages, `package/msg/Type`; empty where the file does not say.
    pub type_name: String,
    /// Encoding of its messages: `cdr` in ROS 2, `ros1` in ROS 1.
    pub encoding: String,
    /// How its messages are serialised; `None` where they are not decoded.
    pub wire: Option<Wire>,
    /// Whether its messages begin with a header, hence with a stamp.
    pub has_header: bool,
}

/// A part of a file that holds messages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Block {
    /// Where its records (or its compressed bytes) begin in the file.
    pub offset: u64,
    /// Bytes of them in the file.
    pub length: u64,
    /// Log time of its earliest message, ns.
    pub start_ns: u64,
    /// How it is kept.
    pub kind: BlockKind,
    /// The channels of its messages, where an index tells.
    pub indexed: Vec<u16>,
}

/// How a block is kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BlockKind {
    /// As a chunk of MCAP.
    Chunk(ChunkHeader),
    /// As plain records of MCAP, one after the other.
    Plain,
    /// As a chunk of a ROS 1 bag.
    BagChunk(BagChunk),
    /// As rows of a database.
    Rows {
        /// Number of the first.
        first: i64,
        /// Number of the last.
        last: i64,
    },
}

impl Block {
    /// Whether it seems to hold messages of one of `channels`. A block without an index may hold any; an index has no
    /// checksum, so what is not found by it is to be looked for without.
    pub fn seems_to_hold(&self, channels: &[u16]) -> bool {
        self.indexed.is_empty() || self.indexed.iter().any(|id| channels.contains(id))
    }
}

/// How a file ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// With its summary and footer.
    Complete,
    /// With a summary whose checksum does not match: what it says is not used.
    SummaryDamaged,
    /// Without: whoever wrote it was stopped, or the file was cut.
    CutShort,
}

/// What a file holds and where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Directory {
    /// Definitions by number.
    pub schemas: BTreeMap<u16, SchemaRecord>,
    /// Topics by number.
    pub channels: BTreeMap<u16, ChannelRecord>,
    /// Where messages are, in the order of the file.
    pub blocks: Vec<Block>,
    /// Metadata records by name; of two with one name, the first.
    pub metadata: BTreeMap<String, BTreeMap<String, String>>,
    /// How the file ends.
    pub ending: Ending,
    /// Bytes that belong to no readable record.
    pub lost_bytes: u64,
    /// How many messages the summary counts.
    pub expected_messages: Option<u64>,
}

impl Directory {
    /// A directory of nothing.
    pub fn empty() -> Self {
        Self {
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            blocks: Vec::new(),
            metadata: BTreeMap::new(),
            ending: Ending::CutShort,
            lost_bytes: 0,
            expected_messages: None,
        }
    }

    /// Takes up a definition of a type or a topic; of two with one number, the first holds. `false` where it is broken.
    pub fn define(&mut self, opcode: u8, fields: &[u8]) -> bool {
        match opcode {
            op::SCHEMA => record::schema(fields).map(|schema| {
                self.schemas.entry(schema.id).or_insert(schema);
            }),
            _ => record::channel(fields).map(|channel| {
                self.channels.entry(channel.id).or_insert(channel);
            }),
        }
        .is_some()
    }

    /// Takes up a connection of a bag; of two with one number, the first holds. `false` where it is broken.
    pub fn define_connection(&mut self, bytes: &[u8]) -> bool {
        let Some((channel, schema)) = bag::connection(bytes) else { return false };
        self.schemas.entry(schema.id).or_insert(schema);
        self.channels.entry(channel.id).or_insert(channel);
        true
    }

    /// The topics, by number; `id_of` makes a number in the recording of one in the file.
    pub fn channels(&self, id_of: impl Fn(u16) -> ChannelId) -> impl Iterator<Item = Channel> {
        self.channels.values().map(move |record| Channel {
            id: id_of(record.id),
            topic: printable(&record.topic),
            type_name: self.schemas.get(&record.schema).map(|schema| printable(&schema.name)).unwrap_or_default(),
            encoding: printable(&record.encoding),
            wire: Wire::of_encoding(&record.encoding),
            has_header: self.schemas.get(&record.schema).is_some_and(|schema| schema.has_header),
        })
    }
}
