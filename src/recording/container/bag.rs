//! Reads ROS 1 bags, format 2.0 (wiki.ros.org/Bags/Format/2.0): records of named fields, messages in chunks.

use super::file_index::{BagChunk, Block, BlockKind, Ending, FileIndex};
use super::record::{ChannelRecord, Fields, SchemaRecord, begins_with_header};
use super::source::Source;
use crate::RecordingError;
use std::collections::BTreeMap;
use std::ops::Range;

/// First bytes of a bag.
pub const MAGIC: &[u8] = b"#ROSBAG V2.0\n";

/// Maximum length of a record's header and of a definition, bytes.
const MAX_RECORD_BYTES: u64 = 16 << 20;

/// Maximum length of the index at the end of a bag, bytes.
const MAX_INDEX_BYTES: u64 = 256 << 20;

/// Bytes that the indexer reads at once.
const READ_AHEAD_BYTES: u64 = 1 << 16;

/// Bytes of a record's header that are read first: sufficient for all but long connections.
const TYPICAL_HEADER_BYTES: u64 = 1 << 10;

mod op {
    pub const MESSAGE: u8 = 0x02;
    pub const BAG_HEADER: u8 = 0x03;
    pub const INDEX: u8 = 0x04;
    pub const CHUNK: u8 = 0x05;
    pub const CHUNK_INFO: u8 = 0x06;
    pub const CONNECTION: u8 = 0x07;
}

/// Record within a chunk.
pub enum BagRecord {
    /// Message with connection number and recording time, ns.
    Message(u16, u64),
    /// Connection.
    Connection,
    /// Other record.
    Other,
}

/// Named fields of a record's header.
#[derive(Clone, Copy)]
struct Header<'a>(&'a [u8]);

impl<'a> Header<'a> {
    /// Value of the field `name`; `None` if it is missing or follows damaged data.
    fn field(self, name: &str) -> Option<&'a [u8]> {
        let mut fields = Fields::new(self.0);
        while !fields.rest().is_empty() {
            let length = fields.u32()? as usize;
            let field = fields.bytes(length)?;
            let equals = field.iter().position(|byte| *byte == b'=')?;
            if &field[..equals] == name.as_bytes() {
                return Some(&field[equals + 1..]);
            }
        }
        None
    }

    fn op(self) -> Option<u8> {
        self.field("op")?.first().copied()
    }

    fn u32(self, name: &str) -> Option<u32> {
        Fields::new(self.field(name)?).u32()
    }

    fn u64(self, name: &str) -> Option<u64> {
        Fields::new(self.field(name)?).u64()
    }

    /// Nanoseconds since 1970: seconds, then nanoseconds, as 32-bit numbers.
    fn time_ns(self, name: &str) -> Option<u64> {
        let mut fields = Fields::new(self.field(name)?);
        Some(u64::from(fields.u32()?) * 1_000_000_000 + u64::from(fields.u32()?))
    }

    fn text(self, name: &str) -> Option<&'a str> {
        std::str::from_utf8(self.field(name)?).ok()
    }

    /// Number of the connection. Bags count connections from 0, so a number above 16 bits is damage.
    fn connection(self) -> Option<u16> {
        u16::try_from(self.u32("conn")?).ok()
    }
}

/// Record in memory.
struct Record<'a> {
    header: Header<'a>,
    data: &'a [u8],
}

fn next_record<'a>(fields: &mut Fields<'a>) -> Option<Record<'a>> {
    let length = fields.u32()? as usize;
    let header = Header(fields.bytes(length)?);
    let length = fields.u32()? as usize;
    Some(Record { header, data: fields.bytes(length)? })
}

/// Reads the next record of a chunk: kind and data length. The data end where the record ends.
pub fn next_in_chunk(fields: &mut Fields<'_>) -> Option<(BagRecord, usize)> {
    let Record { header, data } = next_record(fields)?;
    let record = match header.op()? {
        op::MESSAGE => BagRecord::Message(header.connection()?, header.time_ns("time")?),
        op::CONNECTION => BagRecord::Connection,
        _ => BagRecord::Other,
    };
    Some((record, data.len()))
}

/// Reads a connection record: topic and message type.
fn connection(record: &[u8]) -> Option<(ChannelRecord, SchemaRecord)> {
    let Record { header, data } = next_record(&mut Fields::new(record))?;
    let (id, inner) = (header.connection()?, Header(data));
    let topic = header.text("topic").or_else(|| inner.text("topic"))?.to_owned();
    let has_header = begins_with_header(inner.text("message_definition").unwrap_or_default());
    let channel = ChannelRecord { id, schema: id, topic, encoding: "ros1".to_owned() };
    Some((channel, SchemaRecord { id, name: inner.text("type")?.to_owned(), has_header }))
}

impl FileIndex {
    /// Adds a connection of a bag; the first one of each number applies. `false` if it is damaged.
    pub fn define_connection(&mut self, bytes: &[u8]) -> bool {
        let Some((channel, schema)) = connection(bytes) else { return false };
        self.schemas.entry(schema.id).or_insert(schema);
        self.channels.entry(channel.id).or_insert(channel);
        true
    }
}

/// Index at the end of a bag.
#[derive(Default)]
struct BagIndex {
    /// Offsets of the chunks, with the time of their first message, ns.
    chunks: BTreeMap<u64, u64>,
    messages: u64,
}

/// Indexes the bag in `source`.
///
/// # Errors
/// When it cannot be read, or is encrypted (`name` is for the message).
pub fn index_bag(source: &Source, name: &str) -> Result<FileIndex, RecordingError> {
    let mut indexer = BagIndexer {
        source,
        at: MAGIC.len() as u64,
        bag_index: BagIndex::default(),
        index: FileIndex::empty(),
        buffer: (0, Vec::new()),
    };
    let is_complete = match indexer.header(MAGIC.len() as u64)? {
        Some((header, data)) if Header(&header).op() == Some(op::BAG_HEADER) => {
            let header = Header(&header);
            if header.field("encryptor").is_some_and(|encryptor| !encryptor.is_empty()) {
                let found = "an encrypted ROS 1 bag".to_owned();
                let remedy = "decrypt it with `rosbag decrypt`".to_owned();
                return Err(RecordingError::NotRecording { name: name.to_owned(), found, remedy });
            }
            indexer.at = data.end;
            indexer.read_index(header.u64("index_pos").unwrap_or(0))?
        }
        _ => false,
    };
    indexer.index.ending = if is_complete { Ending::Complete } else { Ending::CutShort };
    indexer.index.expected_messages = is_complete.then_some(indexer.bag_index.messages);
    while indexer.at < source.length() {
        indexer.step()?;
    }
    Ok(indexer.index)
}

/// Record in the file: header, and position of the data.
type LocatedRecord = (Vec<u8>, Range<u64>);

struct BagIndexer<'a> {
    source: &'a Source,
    at: u64,
    bag_index: BagIndex,
    index: FileIndex,
    /// Offset of the last bytes read, and these bytes.
    buffer: (u64, Vec<u8>),
}

impl BagIndexer<'_> {
    /// First bytes of the record at `at`.
    fn head(&mut self, at: u64) -> Result<&[u8], RecordingError> {
        let end = (at + TYPICAL_HEADER_BYTES).min(self.source.length());
        let (start, bytes) = &self.buffer;
        if at < *start || end > *start + bytes.len() as u64 {
            self.buffer = (at, self.bytes(at, READ_AHEAD_BYTES)?);
        }
        Ok(&self.buffer.1[(at - self.buffer.0) as usize..])
    }

    fn bytes(&self, offset: u64, length: u64) -> Result<Vec<u8>, RecordingError> {
        let mut bytes = Vec::new();
        let length = length.min(self.source.length().saturating_sub(offset));
        self.source.read_at(offset, length as usize, &mut bytes)?;
        Ok(bytes)
    }

    /// Header of the record at `at`, and position of the data; `None` if there is no complete record.
    fn header(&mut self, at: u64) -> Result<Option<LocatedRecord>, RecordingError> {
        let file_end = self.source.length();
        let head = self.head(at)?;
        let Some(length) = Fields::new(head).u32().map(u64::from).filter(|length| *length <= MAX_RECORD_BYTES) else {
            return Ok(None);
        };
        let is_short = head.len() < length as usize + 8;
        let longer = if is_short { self.bytes(at, length + 8)? } else { Vec::new() };
        let head = if is_short { &longer[..] } else { self.head(at)? };
        let mut fields = Fields::new(head);
        let (Some(_), Some(header), Some(size)) = (fields.u32(), fields.bytes(length as usize), fields.u32()) else {
            return Ok(None);
        };
        let start = at + length + 8;
        let end = start + u64::from(size);
        Ok((end <= file_end).then(|| (header.to_vec(), start..end)))
    }

    /// Reads the index at `position`; `false` if there is none.
    fn read_index(&mut self, position: u64) -> Result<bool, RecordingError> {
        let length = self.source.length().saturating_sub(position);
        if position < self.at || length > MAX_INDEX_BYTES {
            return Ok(false);
        }
        let bytes = self.bytes(position, length)?;
        let mut fields = Fields::new(&bytes);
        while let Some(Record { header, data }) = next_record(&mut fields) {
            if header.op() != Some(op::CHUNK_INFO) {
                continue;
            }
            if let (Some(offset), Some(start_ns)) = (header.u64("chunk_pos"), header.time_ns("start_time")) {
                self.bag_index.chunks.insert(offset, start_ns);
                let counts = data.chunks_exact(8).filter_map(|pair| Fields::new(&pair[4..]).u32());
                self.bag_index.messages += counts.map(u64::from).sum::<u64>();
            }
        }
        Ok(fields.rest().is_empty())
    }

    /// Indexes one record, or resumes at the next chunk in the bag's index.
    fn step(&mut self) -> Result<(), RecordingError> {
        let start = self.at;
        let Some((header, data)) = self.header(start)? else { return self.resume(start) };
        let header = Header(&header);
        self.at = data.end;
        match header.op() {
            Some(op::CHUNK) => self.chunk(start, header, data),
            Some(op::INDEX) => {
                if let (Some(block), Some(connection)) = (self.index.blocks.last_mut(), header.connection()) {
                    block.indexed.push(connection);
                }
            }
            Some(op::CONNECTION) if data.end - start <= MAX_RECORD_BYTES => {
                let record = self.bytes(start, data.end - start)?;
                if !self.index.define_connection(&record) {
                    self.index.lost_bytes += data.end - start;
                }
            }
            Some(_) => {}
            None => return self.resume(start),
        }
        Ok(())
    }

    fn resume(&mut self, start: u64) -> Result<(), RecordingError> {
        let next = self.bag_index.chunks.range(start + 1..).next().map(|(offset, _)| *offset);
        self.at = next.unwrap_or(self.source.length()).min(self.source.length());
        self.index.lost_bytes += self.at - start;
        self.index.ending = Ending::CutShort;
        Ok(())
    }

    fn chunk(&mut self, start: u64, header: Header<'_>, data: Range<u64>) {
        let (Some(compression), Some(size)) = (header.text("compression"), header.u32("size")) else {
            self.index.lost_bytes += data.end - start;
            return;
        };
        // Without a bag index, chunks are assumed to be in order of time.
        let before = self.index.blocks.last().map_or(0, |block| block.start_ns);
        self.index.blocks.push(Block {
            offset: data.start,
            length: data.end - data.start,
            start_ns: self.bag_index.chunks.get(&start).copied().unwrap_or(before),
            kind: BlockKind::BagChunk(BagChunk { compression: compression.to_owned(), size: u64::from(size) }),
            indexed: Vec::new(),
        });
    }
}
