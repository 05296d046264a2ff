//! Indexes a ROS 1 bag record by record.
//!
//! The index at the end of a bag has no checksum, and bags of old or interrupted recorders have wrong ones. So the bag is
//! scanned; its index only orders the chunks, and states which topics they have, where it agrees with the scan.

use super::bag::{self, Header, MAGIC, op};
use super::budget::Budget;
use super::encoding::{Compression, Encoding};
use super::file_index::{Block, BlockKind, Ending, FileIndex};
use super::record::Fields;
use super::source::Source;
use crate::RecordingError;
use std::collections::BTreeMap;
use std::ops::Range;

/// Maximum length of a record's header, bytes: the name of a topic is its longest field.
const MAX_HEADER_BYTES: u64 = 1 << 16;

/// Maximum length of a definition or of an index record, bytes.
const MAX_RECORD_BYTES: u64 = 16 << 20;

/// Maximum length of the times of a topic's messages in a chunk that are read, bytes.
const MAX_TIMES_BYTES: u64 = 1 << 20;

/// Bytes that the indexer reads at once.
const READ_AHEAD_BYTES: u64 = 1 << 16;

/// Bytes of a record's header that are read first: sufficient for all but long connections.
const TYPICAL_HEADER_BYTES: u64 = 1 << 10;

/// Bytes that are searched at once for a record, at first and at most, and by how much these ranges overlap.
const FIRST_SEARCH_BYTES: u64 = 1 << 13;
const MAX_SEARCH_BYTES: u64 = 1 << 20;
const SEARCH_OVERLAP: u64 = 1 << 10;

/// What the index at the end of a bag states of a chunk.
struct ChunkInfo {
    start_ns: u64,
    /// Connections of the messages, increasing.
    connections: Vec<u16>,
    messages: u64,
}

/// Record in the file: header, operation, and stated position of the data.
type LocatedRecord = (Vec<u8>, u8, Range<u64>);

struct BagIndexer<'a> {
    source: &'a Source,
    budget: &'a mut Budget,
    at: u64,
    index: FileIndex,
    /// Offset of the record of each block.
    starts: Vec<u64>,
    infos: BTreeMap<u64, ChunkInfo>,
    /// Whether the bag states the position of an index in the file.
    has_index: bool,
    /// Whether the file ends within a record.
    is_truncated: bool,
    /// Whether a length or an index disagrees with the records.
    is_inconsistent: bool,
    /// Offset of the last bytes read, and these bytes.
    buffer: (u64, Vec<u8>),
}

/// Indexes the bag in `source`.
///
/// # Errors
/// When it cannot be read, is encrypted, or exceeds `budget`.
pub fn index_bag(source: &Source, budget: &mut Budget) -> Result<FileIndex, RecordingError> {
    let mut indexer = BagIndexer {
        source,
        budget,
        at: MAGIC.len() as u64,
        index: FileIndex::empty(),
        starts: Vec::new(),
        infos: BTreeMap::new(),
        has_index: false,
        is_truncated: false,
        is_inconsistent: false,
        buffer: (0, Vec::new()),
    };
    while indexer.at < source.length() {
        indexer.step()?;
    }
    Ok(indexer.finish())
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

    /// Reads `length` bytes from `offset`, fewer at the end of the file.
    fn bytes(&self, offset: u64, length: u64) -> Result<Vec<u8>, RecordingError> {
        let mut bytes = Vec::new();
        let length = length.min(self.source.length().saturating_sub(offset));
        self.source.read_at(offset, length as usize, &mut bytes)?;
        Ok(bytes)
    }

    /// Reads the header of the record at `at`; `None` if there is no record outside chunks.
    fn record_at(&mut self, at: u64) -> Result<Option<LocatedRecord>, RecordingError> {
        let head = self.head(at)?;
        let Some(length) = Fields::new(head).u32().map(u64::from).filter(|length| *length <= MAX_HEADER_BYTES) else {
            return Ok(None);
        };
        let is_short = head.len() < length as usize + 8;
        let longer = if is_short { self.bytes(at, length + 8)? } else { Vec::new() };
        let head = if is_short { &longer[..] } else { self.head(at)? };
        let found = bag::record_at(head).filter(|(_, op, _)| *op != op::MESSAGE);
        Ok(found.map(|(header, op, data)| (header.0.to_vec(), op, at + data.start..at + data.end)))
    }

    /// Finds the first chunk or index record from `from`. Only these are never inside a chunk.
    fn find_record(&self, from: u64) -> Result<Option<u64>, RecordingError> {
        let (mut from, mut length) = (from, FIRST_SEARCH_BYTES);
        while from < self.source.length() {
            let bytes = self.bytes(from, length)?;
            let is_outside = |op| matches!(op, op::CHUNK | op::INDEX | op::CHUNK_INFO);
            if let Some(found) = bag::find_record(&bytes, is_outside) {
                return Ok(Some(from + found as u64));
            }
            from += length - SEARCH_OVERLAP;
            length = (2 * length).min(MAX_SEARCH_BYTES);
        }
        Ok(None)
    }

    /// Indexes one record, or resumes at the next one.
    fn step(&mut self) -> Result<(), RecordingError> {
        let start = self.at;
        let Some((header, op, data)) = self.record_at(start)? else { return self.resume(start) };
        let end = match self.end_of_uncompressed(Header(&header), op, &data)? {
            Some(end) => end,
            None => self.end_of(&data)?,
        };
        let (header, is_exact, data) = (Header(&header), end == data.end, data.start..end);
        match op {
            op::BAG_HEADER => self.bag_header(header)?,
            op::CHUNK => self.chunk(start, header, data, is_exact)?,
            op::INDEX => self.message_index(header, data)?,
            op::CHUNK_INFO => self.chunk_info(header, data)?,
            op::CONNECTION if end - start <= MAX_RECORD_BYTES => {
                let record = self.bytes(start, end - start)?;
                if !self.index.define_connection(&record, self.budget)? {
                    self.index.lost_bytes += end - start;
                }
            }
            _ => {}
        }
        self.at = end;
        Ok(())
    }

    /// End of an uncompressed chunk with its data at `data`, if its size is greater than the stated length and right.
    fn end_of_uncompressed(
        &mut self,
        header: Header<'_>,
        op: u8,
        data: &Range<u64>,
    ) -> Result<Option<u64>, RecordingError> {
        let is_uncompressed = op == op::CHUNK && header.text("compression") == Some("none");
        let end = data.start + header.u32("size").map_or(0, u64::from);
        let is_longer = is_uncompressed && end > data.end && end < self.source.length();
        let is_right = is_longer && self.record_at(end)?.is_some();
        self.is_inconsistent |= is_right;
        Ok(is_right.then_some(end))
    }

    /// End of the record with its data at `data`: the stated one if a record or the end of the file is there.
    fn end_of(&mut self, data: &Range<u64>) -> Result<u64, RecordingError> {
        let file_end = self.source.length();
        if data.end == file_end || data.end < file_end && self.record_at(data.end)?.is_some() {
            return Ok(data.end);
        }
        let found = self.find_record(data.start)?;
        self.is_truncated |= found.is_none();
        self.is_inconsistent = true;
        Ok(found.unwrap_or(file_end))
    }

    /// Resumes after damage at `start`.
    fn resume(&mut self, start: u64) -> Result<(), RecordingError> {
        let found = self.find_record(start + 1)?;
        self.at = found.unwrap_or(self.source.length());
        self.index.lost_bytes += self.at - start;
        self.is_truncated |= found.is_none();
        self.is_inconsistent = true;
        Ok(())
    }

    fn bag_header(&mut self, header: Header<'_>) -> Result<(), RecordingError> {
        if header.field("encryptor").is_some_and(|encryptor| !encryptor.is_empty()) {
            let found = "an encrypted ROS 1 bag".to_owned();
            let remedy = "decrypt it with `rosbag decrypt`".to_owned();
            return Err(RecordingError::NotRecording { name: self.budget.name().to_owned(), found, remedy });
        }
        let position = header.u64("index_pos").unwrap_or(0);
        self.has_index |= position > 0 && position < self.source.length();
        Ok(())
    }

    fn chunk(
        &mut self,
        start: u64,
        header: Header<'_>,
        data: Range<u64>,
        is_exact: bool,
    ) -> Result<(), RecordingError> {
        let compression = header.text("compression").map_or(Compression::Unsupported, Compression::named);
        let size = header.u32("size").map_or(0, u64::from);
        let length = data.end - data.start;
        // What follows a chunk with a wrong length is not part of it.
        let is_padded = !is_exact && compression == Compression::None && size < length;
        let block = Block {
            offset: data.start,
            length: if is_padded { size } else { length },
            start_ns: u64::MAX,
            kind: BlockKind::BagChunk(Encoding { compression, size, crc: 0 }),
            indexed: Vec::new(),
        };
        self.starts.push(start);
        self.index.add_block(block, self.budget)
    }

    /// Notes the times and the topic of messages in the previous chunk.
    fn message_index(&mut self, header: Header<'_>, data: Range<u64>) -> Result<(), RecordingError> {
        let times = self.bytes(data.start, (data.end - data.start).min(MAX_TIMES_BYTES))?;
        if let (Some(block), Some(connection)) = (self.index.blocks.last_mut(), header.connection()) {
            let times = times.chunks_exact(12).filter_map(|entry| bag::time_ns(&mut Fields::new(entry)));
            block.start_ns = times.fold(block.start_ns, u64::min);
            block.indexed.push(connection);
        }
        Ok(())
    }

    fn chunk_info(&mut self, header: Header<'_>, data: Range<u64>) -> Result<(), RecordingError> {
        let length = (data.end - data.start).min(MAX_RECORD_BYTES);
        let data = self.bytes(data.start, length)?;
        let (Some(offset), Some(start_ns)) = (header.u64("chunk_pos"), header.time_ns("start_time")) else {
            self.is_inconsistent = true;
            return Ok(());
        };
        let counts = data.chunks_exact(8).filter_map(|pair| {
            let mut fields = Fields::new(pair);
            Some((u16::try_from(fields.u32()?).ok()?, u64::from(fields.u32()?)))
        });
        let mut info = ChunkInfo { start_ns, connections: Vec::new(), messages: 0 };
        self.budget.item(size_of::<ChunkInfo>() + data.len() / 4)?;
        for (connection, count) in counts {
            info.connections.push(connection);
            info.messages += count;
        }
        info.connections.sort_unstable();
        self.infos.insert(offset, info);
        Ok(())
    }

    /// Completes the index of the scan by the index of the bag, where both agree.
    fn finish(mut self) -> FileIndex {
        self.is_inconsistent |= self.infos.len() != self.starts.len();
        let expected: u64 = self.infos.values().map(|info| info.messages).sum();
        let mut before_ns = 0;
        for (block, start) in self.index.blocks.iter_mut().zip(&self.starts) {
            block.indexed.sort_unstable();
            let info = self.infos.get(start);
            if info.is_none_or(|info| info.connections != block.indexed) {
                block.indexed.clear();
                self.is_inconsistent = true;
            }
            block.start_ns = info.map_or(block.start_ns, |info| block.start_ns.min(info.start_ns));
            // Without an index, chunks are assumed to be in order of time.
            block.start_ns = if block.start_ns == u64::MAX { before_ns } else { block.start_ns };
            before_ns = block.start_ns;
        }
        self.index.ending = if self.is_truncated || !self.has_index {
            Ending::CutShort
        } else if self.is_inconsistent {
            Ending::SummaryDamaged
        } else {
            Ending::Complete
        };
        self.index.expected_messages = (self.index.ending != Ending::CutShort).then_some(expected);
        self.index
    }
}
