//! Index of a file: topics, definitions and blocks, without the messages.

use super::record::{self, ChannelRecord, ChunkHeader, SchemaRecord, op};
use crate::topics::printable;
use crate::wire::WireFormat;
use std::collections::BTreeMap;

/// Number of a topic within a recording: number of the file and number within the file.
pub type ChannelId = u32;

/// Topic and message type.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Channel {
    /// Number in the recording.
    pub id: ChannelId,
    /// Topic name, with control characters escaped.
    pub topic: String,
    /// Message type, `package/msg/Type`; empty if the file does not state it.
    pub type_name: String,
    /// Message encoding: `cdr` in ROS 2, `ros1` in ROS 1.
    pub encoding: String,
    /// Serialisation; `None` if it is not supported.
    pub wire: Option<WireFormat>,
    /// Whether messages start with a header, hence with a stamp.
    pub has_header: bool,
}

/// Section of a file with messages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Block {
    /// Offset of the records (or the compressed bytes) in the file.
    pub offset: u64,
    /// Length in the file, bytes.
    pub length: u64,
    /// Log time of the earliest message, ns.
    pub start_ns: u64,
    /// Kind of storage.
    pub kind: BlockKind,
    /// Channels of the messages, if an index states them.
    pub indexed: Vec<u16>,
}

/// Storage of a block.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BlockKind {
    /// MCAP chunk.
    Chunk(ChunkHeader),
    /// Consecutive MCAP records outside a chunk.
    Plain,
    /// ROS 1 bag chunk.
    BagChunk(BagChunk),
    /// Database rows.
    Rows {
        /// First row number.
        first: i64,
        /// Last row number.
        last: i64,
    },
}

/// Compression of a chunk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BagChunk {
    /// `none`, `lz4` or `bz2`.
    pub compression: String,
    /// Uncompressed size, bytes.
    pub size: u64,
}

impl Block {
    /// Whether the block may contain messages of one of `channels`.
    ///
    /// A block without an index may contain any. An index has no checksum, so channels that it does not find must be
    /// searched without it.
    pub fn may_contain(&self, channels: &[u16]) -> bool {
        self.indexed.is_empty() || self.indexed.iter().any(|id| channels.contains(id))
    }
}

/// Completeness of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// The file has a summary and a footer.
    Complete,
    /// The summary's checksum does not match; it is ignored.
    SummaryDamaged,
    /// The file has no summary: the writer was stopped, or it is truncated.
    CutShort,
}

/// Index of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileIndex {
    /// Message definitions by number.
    pub schemas: BTreeMap<u16, SchemaRecord>,
    /// Topics by number.
    pub channels: BTreeMap<u16, ChannelRecord>,
    /// Blocks with messages, in file order.
    pub blocks: Vec<Block>,
    /// Metadata records by name; the first one of each name.
    pub metadata: BTreeMap<String, BTreeMap<String, String>>,
    /// Completeness of the file.
    pub ending: Ending,
    /// Bytes that belong to no readable record.
    pub lost_bytes: u64,
    /// Number of messages according to the summary.
    pub expected_messages: Option<u64>,
}

impl FileIndex {
    /// Creates an empty index.
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

    /// Adds a type or topic definition; the first one of each number applies. `false` if it is damaged.
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

    /// Topics by number; `id_of` maps a number in the file to one in the recording.
    pub fn channels(&self, id_of: impl Fn(u16) -> ChannelId) -> impl Iterator<Item = Channel> {
        self.channels.values().map(move |record| Channel {
            id: id_of(record.id),
            topic: printable(&record.topic),
            type_name: self.schemas.get(&record.schema).map(|schema| printable(&schema.name)).unwrap_or_default(),
            encoding: printable(&record.encoding),
            wire: WireFormat::from_encoding(&record.encoding),
            has_header: self.schemas.get(&record.schema).is_some_and(|schema| schema.has_header),
        })
    }
}
