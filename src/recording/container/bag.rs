//! Records of ROS 1 bags, format 2.0 (wiki.ros.org/Bags/Format/2.0): a header of named fields, and data.
//!
//! Records are not marked, so a wrong length hides all that follow. A record counts only if another one or the end follows
//! it; otherwise the next one is searched for.

use super::budget::Budget;
use super::file_index::FileIndex;
use super::record::{ChannelFields, Fields, SchemaFields, begins_with_header};
use crate::RecordingError;
use std::ops::Range;

/// First bytes of a bag.
pub const MAGIC: &[u8] = b"#ROSBAG V2.0\n";

/// Operation codes of records.
pub mod op {
    /// Message.
    pub const MESSAGE: u8 = 0x02;
    /// Start of a bag.
    pub const BAG_HEADER: u8 = 0x03;
    /// Times and offsets of a topic's messages in the previous chunk.
    pub const INDEX: u8 = 0x04;
    /// Group of messages.
    pub const CHUNK: u8 = 0x05;
    /// Position of a chunk, and its number of messages.
    pub const CHUNK_INFO: u8 = 0x06;
    /// Topic.
    pub const CONNECTION: u8 = 0x07;
}

/// Length of the field `op`, and this field up to its value.
const OP_BYTES: usize = 8;
const OP_START: &[u8] = b"\x04\0\0\0op=";

/// Maximum offset of the field `op` in a record that is searched for, and maximum length of its header, bytes.
///
/// The fields of the longest such record, a chunk info, take 100 bytes; more would only slow the search down.
const MAX_OP_OFFSET: usize = 128;
const MAX_SEARCHED_HEADER: usize = 256;

/// Named fields of a record's header.
#[derive(Debug, Clone, Copy)]
pub struct Header<'a>(pub &'a [u8]);

impl<'a> Header<'a> {
    /// Name and value of each field; `None` in place of damaged data.
    fn fields(self) -> impl Iterator<Item = Option<(&'a [u8], &'a [u8])>> {
        let mut fields = Fields::new(self.0);
        let mut next = move || {
            let length = fields.u32()? as usize;
            let field = fields.bytes(length)?;
            let equals = field.iter().position(|byte| *byte == b'=')?;
            Some((field.len() + 4, (&field[..equals], &field[equals + 1..])))
        };
        let mut rest = self.0.len();
        std::iter::from_fn(move || {
            if rest == 0 {
                return None;
            }
            let found = next();
            rest -= found.map_or(rest, |(size, _)| size);
            Some(found.map(|(_, field)| field))
        })
    }

    /// Value of the field `name`; `None` if it is missing or follows damaged data.
    pub fn field(self, name: &str) -> Option<&'a [u8]> {
        self.fields().map_while(|field| field).find(|(found, _)| *found == name.as_bytes()).map(|(_, value)| value)
    }

    /// Operation code, if the header is intact and has the fields of that operation.
    pub fn op(self) -> Option<u8> {
        if !self.fields().all(|field| field.is_some()) {
            return None;
        }
        let op = *self.field("op")?.first()?;
        let needed: &[&str] = match op {
            op::MESSAGE => &["conn", "time"],
            op::INDEX => &["conn", "count", "ver"],
            op::CHUNK => &["compression", "size"],
            op::CHUNK_INFO => &["chunk_pos", "count"],
            op::CONNECTION => &["conn"],
            _ => &[],
        };
        needed.iter().all(|name| self.field(name).is_some()).then_some(op)
    }

    pub fn u32(self, name: &str) -> Option<u32> {
        Fields::new(self.field(name)?).u32()
    }

    pub fn u64(self, name: &str) -> Option<u64> {
        Fields::new(self.field(name)?).u64()
    }

    /// Nanoseconds since 1970 in the field `name`.
    pub fn time_ns(self, name: &str) -> Option<u64> {
        time_ns(&mut Fields::new(self.field(name)?))
    }

    pub fn text(self, name: &str) -> Option<&'a str> {
        std::str::from_utf8(self.field(name)?).ok()
    }

    /// Number of the connection. Bags count connections from 0, so a number above 16 bits is damage.
    pub fn connection(self) -> Option<u16> {
        u16::try_from(self.u32("conn")?).ok()
    }
}

/// Reads nanoseconds since 1970: seconds, then nanoseconds, as 32-bit numbers.
pub fn time_ns(fields: &mut Fields<'_>) -> Option<u64> {
    Some(u64::from(fields.u32()?) * 1_000_000_000 + u64::from(fields.u32()?))
}

/// Record at the start of `bytes`: header, operation, and stated position of the data, which may be beyond the end.
pub fn record_at(bytes: &[u8]) -> Option<(Header<'_>, u8, Range<u64>)> {
    let mut fields = Fields::new(bytes);
    let length = fields.u32()?;
    let header = Header(fields.bytes(length as usize)?);
    let size = fields.u32()?;
    let start = u64::from(length) + 8;
    Some((header, header.op()?, start..start + u64::from(size)))
}

/// Finds the first record in `bytes` with an operation that `accepts` permits.
///
/// It searches for the field `op`, which may follow other fields, and then for the start of the record before it.
pub fn find_record(bytes: &[u8], accepts: impl Fn(u8) -> bool) -> Option<usize> {
    let mut from = 0;
    while let Some(found) = bytes.get(from..)?.windows(OP_START.len()).position(|window| window == OP_START) {
        let field = from + found;
        let mut starts = (field.saturating_sub(MAX_OP_OFFSET)..=field.saturating_sub(4)).rev();
        let start = starts.find(|start| {
            let length = Fields::new(&bytes[*start..]).u32().map_or(0, |length| length as usize);
            let has_op = length <= MAX_SEARCHED_HEADER && start + 4 + length >= field + OP_BYTES;
            has_op && record_at(&bytes[*start..]).is_some_and(|(_, op, _)| accepts(op))
        });
        if start.is_some() {
            return start;
        }
        from = field + 1;
    }
    None
}

/// Record within a chunk.
pub struct ChunkRecord {
    /// Connection number and recording time, ns, of a message.
    pub message: Option<(u16, u64)>,
    /// Operation.
    op: u8,
    /// Offset of the record.
    start: usize,
    /// Position of the data.
    pub data: Range<usize>,
}

/// Records of an uncompressed chunk.
pub struct ChunkRecords<'a> {
    bytes: &'a [u8],
    at: usize,
    is_damaged: bool,
}

impl<'a> ChunkRecords<'a> {
    /// Reads the records in `bytes`.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, is_damaged: false }
    }

    /// Whether some bytes so far belong to no record.
    pub fn is_damaged(&self) -> bool {
        self.is_damaged
    }

    /// Finds the next record at or after `from`.
    fn find(&mut self, from: usize) -> Option<usize> {
        self.is_damaged = true;
        let found = find_record(&self.bytes[from..], |op| matches!(op, op::MESSAGE | op::CONNECTION));
        found.map(|found| from + found)
    }
}

impl Iterator for ChunkRecords<'_> {
    type Item = ChunkRecord;

    fn next(&mut self) -> Option<ChunkRecord> {
        if self.at < self.bytes.len() && record_at(&self.bytes[self.at..]).is_none() {
            self.at = self.find(self.at + 1).unwrap_or(self.bytes.len());
        }
        let start = self.at;
        let (header, op, data) = record_at(&self.bytes[start..])?;
        let data = start + data.start as usize..start.saturating_add(data.end as usize);
        let follows = self.bytes.get(data.end..).is_some_and(|rest| rest.is_empty() || record_at(rest).is_some());
        let next = if follows { Some(data.end) } else { self.find(data.start) };
        self.at = next.unwrap_or(self.bytes.len());
        // The last record of a chunk that is cut off is incomplete.
        let end = next.unwrap_or(data.end);
        let message = (op == op::MESSAGE && end <= self.bytes.len())
            .then(|| header.connection().zip(header.time_ns("time")))
            .flatten();
        self.is_damaged |= op == op::MESSAGE && message.is_none();
        Some(ChunkRecord { message, op, start, data: data.start..end.min(self.bytes.len()) })
    }
}

/// Connection records of an uncompressed chunk.
pub fn connections_in_chunk(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let connections = ChunkRecords::new(bytes).filter(|record| record.op == op::CONNECTION);
    connections.map(|record| &bytes[record.start..record.data.end])
}

/// Reads a connection record: topic and message type.
fn connection(record: &[u8]) -> Option<(ChannelFields<'_>, SchemaFields<'_>)> {
    let (header, _, data) = record_at(record)?;
    let (id, inner) = (header.connection()?, Header(record.get(data.start as usize..)?));
    let topic = header.text("topic").or_else(|| inner.text("topic"))?;
    let has_header = begins_with_header(inner.text("message_definition").unwrap_or_default());
    let channel = ChannelFields { id, schema: id, topic, encoding: "ros1" };
    Some((channel, SchemaFields { id, name: inner.text("type")?, has_header }))
}

impl FileIndex {
    /// Adds a connection of a bag; the first one of each number applies. `false` if it is damaged.
    ///
    /// # Errors
    /// When the budget is exhausted.
    pub fn define_connection(&mut self, bytes: &[u8], budget: &mut Budget) -> Result<bool, RecordingError> {
        let Some((channel, schema)) = connection(bytes) else { return Ok(false) };
        self.add_schema(schema, budget)?;
        self.add_channel(channel, budget)?;
        Ok(true)
    }
}
