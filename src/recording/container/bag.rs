//! ROS 1 bags, format 2.0 (wiki.ros.org/Bags/Format/2.0): records of named fields, messages in chunks.

use super::directory::{Block, BlockKind, Directory, Ending};
use super::record::{ChannelRecord, Fields, SchemaRecord, begins_with_header};
use super::source::Source;
use crate::recording::RecordingError;
use std::collections::BTreeMap;
use std::ops::Range;

/// First bytes of a bag.
pub const MAGIC: &[u8] = b"#ROSBAG V2.0\n";

/// Greatest length of a record's header and of a definition, bytes.
const LONGEST_KEPT: u64 = 16 << 20;

/// Greatest length of the index at the end of a bag, bytes.
const LONGEST_INDEX: u64 = 256 << 20;

/// Bytes that the walk reads at once.
const READ_AHEAD: u64 = 1 << 16;

/// Bytes of a record's header that are looked at first: enough for all but long connections.
const USUAL_HEADER: u64 = 1 << 10;

mod op {
    pub const MESSAGE: u8 = 0x02;
    pub const BAG_HEADER: u8 = 0x03;
    pub const INDEX: u8 = 0x04;
    pub const CHUNK: u8 = 0x05;
    pub const CHUNK_INFO: u8 = 0x06;
    pub const CONNECTION: u8 = 0x07;
}

/// How a chunk is kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BagChunk {
    /// `none`, `lz4` or `bz2`.
    pub compression: String,
    /// Bytes, decompressed.
    pub size: u64,
}

/// What a record within a chunk is.
pub enum BagRecord {
    /// A message on a connection, with the time at which it was recorded, ns.
    Message(u16, u64),
    /// A connection.
    Connection,
    /// Anything else.
    Other,
}

/// The named fields of a record's header.
#[derive(Clone, Copy)]
struct Header<'a>(&'a [u8]);

impl<'a> Header<'a> {
    /// The value of the field `name`; `None` where it is missing or the header is broken before it.
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

    /// The connection's number. Bags count connections from 0, so that one beyond 16 bits is damage.
    fn connection(self) -> Option<u16> {
        u16::try_from(self.u32("conn")?).ok()
    }
}

/// A record in memory.
struct Record<'a> {
    header: Header<'a>,
    data: &'a [u8],
}

fn next<'a>(fields: &mut Fields<'a>) -> Option<Record<'a>> {
    let length = fields.u32()? as usize;
    let header = Header(fields.bytes(length)?);
    let length = fields.u32()? as usize;
    Some(Record { header, data: fields.bytes(length)? })
}

/// The next record of a chunk: what it is, and how many bytes its data take, which end where the record does.
pub fn next_in_chunk(fields: &mut Fields<'_>) -> Option<(BagRecord, usize)> {
    let Record { header, data } = next(fields)?;
    let record = match header.op()? {
        op::MESSAGE => BagRecord::Message(header.connection()?, header.time_ns("time")?),
        op::CONNECTION => BagRecord::Connection,
        _ => BagRecord::Other,
    };
    Some((record, data.len()))
}

/// Reads a connection record: the topic, and the type of its messages.
pub fn connection(record: &[u8]) -> Option<(ChannelRecord, SchemaRecord)> {
    let Record { header, data } = next(&mut Fields::new(record))?;
    let (id, inner) = (header.connection()?, Header(data));
    let topic = header.text("topic").or_else(|| inner.text("topic"))?.to_owned();
    let has_header = begins_with_header(inner.text("message_definition").unwrap_or_default());
    let channel = ChannelRecord { id, schema: id, topic, encoding: "ros1".to_owned() };
    Some((channel, SchemaRecord { id, name: inner.text("type")?.to_owned(), has_header }))
}

/// What the index at the end of a bag says.
#[derive(Default)]
struct Index {
    /// Where chunks begin, with the time of their first message, ns.
    chunks: BTreeMap<u64, u64>,
    messages: u64,
}

/// Walks through all of `source`.
///
/// # Errors
/// When it cannot be read, or its chunks are encrypted (`name` is for the message).
pub fn walk(source: &Source, name: &str) -> Result<Directory, RecordingError> {
    let mut walk = Walk {
        source,
        at: MAGIC.len() as u64,
        index: Index::default(),
        found: Directory::empty(),
        ahead: (0, Vec::new()),
    };
    let whole = match walk.header(MAGIC.len() as u64)? {
        Some((header, data)) if Header(&header).op() == Some(op::BAG_HEADER) => {
            let header = Header(&header);
            if header.field("encryptor").is_some_and(|encryptor| !encryptor.is_empty()) {
                let found = "a ROS 1 bag that is encrypted".to_owned();
                let remedy = "decrypt it with `rosbag decrypt`".to_owned();
                return Err(RecordingError::NotRecording { name: name.to_owned(), found, remedy });
            }
            walk.at = data.end;
            walk.read_index(header.u64("index_pos").unwrap_or(0))?
        }
        _ => false,
    };
    walk.found.ending = if whole { Ending::Complete } else { Ending::CutShort };
    walk.found.expected_messages = whole.then_some(walk.index.messages);
    while walk.at < source.length() {
        walk.step()?;
    }
    Ok(walk.found)
}

/// A record in the file: its header, and where its data are.
type Found = (Vec<u8>, Range<u64>);

struct Walk<'a> {
    source: &'a Source,
    at: u64,
    index: Index,
    found: Directory,
    /// Where the bytes that were read at last begin, and these.
    ahead: (u64, Vec<u8>),
}

impl Walk<'_> {
    /// The first bytes of a record at `at`.
    fn head(&mut self, at: u64) -> Result<&[u8], RecordingError> {
        let end = (at + USUAL_HEADER).min(self.source.length());
        let (start, bytes) = &self.ahead;
        if at < *start || end > *start + bytes.len() as u64 {
            self.ahead = (at, self.bytes(at, READ_AHEAD)?);
        }
        Ok(&self.ahead.1[(at - self.ahead.0) as usize..])
    }

    fn bytes(&self, offset: u64, length: u64) -> Result<Vec<u8>, RecordingError> {
        let mut bytes = Vec::new();
        let length = length.min(self.source.length().saturating_sub(offset));
        self.source.read_at(offset, length as usize, &mut bytes)?;
        Ok(bytes)
    }

    /// The header of the record at `at`, and where its data are; `None` where there is no whole record.
    fn header(&mut self, at: u64) -> Result<Option<Found>, RecordingError> {
        let file_end = self.source.length();
        let head = self.head(at)?;
        let Some(length) = Fields::new(head).u32().map(u64::from).filter(|length| *length <= LONGEST_KEPT) else {
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

    /// Reads the index at `position`; whether there is one.
    fn read_index(&mut self, position: u64) -> Result<bool, RecordingError> {
        let length = self.source.length().saturating_sub(position);
        if position < self.at || length > LONGEST_INDEX {
            return Ok(false);
        }
        let bytes = self.bytes(position, length)?;
        let mut fields = Fields::new(&bytes);
        while let Some(Record { header, data }) = next(&mut fields) {
            if header.op() != Some(op::CHUNK_INFO) {
                continue;
            }
            if let (Some(place), Some(start_ns)) = (header.u64("chunk_pos"), header.time_ns("start_time")) {
                self.index.chunks.insert(place, start_ns);
                let counts = data.chunks_exact(8).filter_map(|pair| Fields::new(&pair[4..]).u32());
                self.index.messages += counts.map(u64::from).sum::<u64>();
            }
        }
        Ok(fields.rest().is_empty())
    }

    /// Takes one record, or goes on at the next chunk that the index names.
    fn step(&mut self) -> Result<(), RecordingError> {
        let start = self.at;
        let Some((header, data)) = self.header(start)? else { return self.resume(start) };
        let header = Header(&header);
        self.at = data.end;
        match header.op() {
            Some(op::CHUNK) => self.chunk(start, header, data),
            Some(op::INDEX) => {
                if let (Some(block), Some(connection)) = (self.found.blocks.last_mut(), header.connection()) {
                    block.indexed.push(connection);
                }
            }
            Some(op::CONNECTION) if data.end - start <= LONGEST_KEPT => {
                let record = self.bytes(start, data.end - start)?;
                if !self.found.define_connection(&record) {
                    self.found.lost_bytes += data.end - start;
                }
            }
            Some(_) => {}
            None => return self.resume(start),
        }
        Ok(())
    }

    fn resume(&mut self, start: u64) -> Result<(), RecordingError> {
        let next = self.index.chunks.range(start + 1..).next().map(|(place, _)| *place);
        self.at = next.unwrap_or(self.source.length()).min(self.source.length());
        self.found.lost_bytes += self.at - start;
        self.found.ending = Ending::CutShort;
        Ok(())
    }

    fn chunk(&mut self, start: u64, header: Header<'_>, data: Range<u64>) {
        let (Some(compression), Some(size)) = (header.text("compression"), header.u32("size")) else {
            self.found.lost_bytes += data.end - start;
            return;
        };
        // Chunks of a bag without an index are taken to be in the order of time.
        let before = self.found.blocks.last().map_or(0, |block| block.start_ns);
        self.found.blocks.push(Block {
            offset: data.start,
            length: data.end - data.start,
            start_ns: self.index.chunks.get(&start).copied().unwrap_or(before),
            kind: BlockKind::BagChunk(BagChunk { compression: compression.to_owned(), size: u64::from(size) }),
            indexed: Vec::new(),
        });
    }
}
