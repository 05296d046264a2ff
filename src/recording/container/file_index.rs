//! Index of a file: topics, definitions and blocks, without the messages.

use super::budget::Budget;
use super::encoding::Encoding;
use super::record::{self, ChannelFields, SchemaFields, op};
use crate::RecordingError;
use crate::wire::WireFormat;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use zsim_base::printable::printable_name;

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
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BlockKind {
    /// MCAP chunk.
    Chunk(Encoding),
    /// Consecutive MCAP records outside a chunk.
    Plain,
    /// ROS 1 bag chunk.
    BagChunk(Encoding),
    /// Database rows.
    Rows {
        /// First row number.
        first: i64,
        /// Last row number.
        last: i64,
    },
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
    /// The summary is damaged or disagrees with the data; it is ignored.
    SummaryDamaged,
    /// The file has no summary: the writer was stopped, or it is truncated.
    CutShort,
}

/// Message type definition.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Schema {
    /// Type name: `package/msg/Type`.
    pub name: String,
    /// Whether the first field is a `std_msgs/Header`.
    pub has_header: bool,
}

/// Topic of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileChannel {
    /// Number of the message definition.
    pub schema: u16,
    /// Topic name.
    pub topic: String,
    /// Message encoding: `cdr` in the ROS 2 profile.
    pub encoding: String,
}

/// Index of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileIndex {
    /// Message definitions by number.
    pub schemas: BTreeMap<u16, Schema>,
    /// Topics by number.
    pub channels: BTreeMap<u16, FileChannel>,
    /// Blocks with messages, in file order.
    pub blocks: Vec<Block>,
    /// Manifest of the run, if zsim recorded it.
    pub manifest: Option<String>,
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
            manifest: None,
            ending: Ending::CutShort,
            lost_bytes: 0,
            expected_messages: None,
        }
    }

    /// Adds the definition in an MCAP record. `false` if it is damaged.
    ///
    /// # Errors
    /// When the budget is exhausted.
    pub fn define(&mut self, opcode: u8, fields: &[u8], budget: &mut Budget) -> Result<bool, RecordingError> {
        let channel = record::channel(fields).filter(|_| opcode == op::CHANNEL);
        let schema = record::schema(fields).filter(|_| opcode == op::SCHEMA);
        channel.map(|channel| self.add_channel(channel, budget)).transpose()?;
        schema.map(|schema| self.add_schema(schema, budget)).transpose()?;
        Ok(channel.is_some() || schema.is_some())
    }

    /// Adds a type; the first one of each number applies.
    ///
    /// # Errors
    /// When the budget is exhausted.
    pub fn add_schema(&mut self, schema: SchemaFields<'_>, budget: &mut Budget) -> Result<(), RecordingError> {
        if let Entry::Vacant(entry) = self.schemas.entry(schema.id) {
            entry.insert(Schema { name: budget.copy_name(schema.name)?, has_header: schema.has_header });
        }
        Ok(())
    }

    /// Adds a topic; the first one of each number applies.
    ///
    /// # Errors
    /// When the budget is exhausted.
    pub fn add_channel(&mut self, channel: ChannelFields<'_>, budget: &mut Budget) -> Result<(), RecordingError> {
        if let Entry::Vacant(entry) = self.channels.entry(channel.id) {
            let (topic, encoding) = (budget.copy_name(channel.topic)?, budget.copy_name(channel.encoding)?);
            entry.insert(FileChannel { schema: channel.schema, topic, encoding });
        }
        Ok(())
    }

    /// Adds a block.
    ///
    /// # Errors
    /// When the budget is exhausted.
    pub fn add_block(&mut self, block: Block, budget: &mut Budget) -> Result<(), RecordingError> {
        budget.item(size_of::<Block>())?;
        self.blocks.push(block);
        Ok(())
    }

    /// Whether `block` has messages of a topic that is not defined.
    pub fn lacks_definitions_of(&self, block: &Block) -> bool {
        block.indexed.iter().any(|id| !self.channels.contains_key(id))
    }

    /// Topics by number; `id_of` maps a number in the file to one in the recording.
    pub fn channels(&self, id_of: impl Fn(u16) -> ChannelId) -> impl Iterator<Item = Channel> {
        self.channels.iter().map(move |(id, channel)| Channel {
            id: id_of(*id),
            topic: printable_name(&channel.topic),
            type_name: self.schemas.get(&channel.schema).map(|schema| printable_name(&schema.name)).unwrap_or_default(),
            encoding: printable_name(&channel.encoding),
            wire: WireFormat::from_encoding(&channel.encoding),
            has_header: self.schemas.get(&channel.schema).is_some_and(|schema| schema.has_header),
        })
    }
}
