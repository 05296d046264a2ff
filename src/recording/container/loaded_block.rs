//! Loads a block of a file into memory: decompresses and checks it, and sorts the messages by log time.

use super::bag::{self, BagRecord};
use super::database::SqliteDatabase;
use super::entry::{Damage, Entry};
use super::file_index::{Block, BlockKind, FileIndex};
use super::mcap_summary::next_record;
use super::record::{self, Fields, op};
use super::recording_file::Store;
use crate::RecordingError;
use std::io::Read;
use std::ops::Range;

/// Maximum size of a block in memory, compressed or not, bytes.
///
/// Writers make chunks of about 1 MB; a larger claim is a decompression bomb or a damaged length.
const MAX_BLOCK_BYTES: u64 = 256 << 20;

/// First bytes of a zstd frame; a serialised message does not start with them.
const ZSTD_MAGIC: [u8; 4] = [0x28, 0xB5, 0x2F, 0xFD];

/// Maximum memory reserved before decompression, bytes.
const INITIAL_CAPACITY: u64 = 1 << 20;

/// Kind of a definition within a block.
#[derive(Debug, Clone, Copy)]
enum Definition {
    /// MCAP schema or channel record, by opcode.
    Record(u8),
    /// Connection record of a bag.
    Connection,
}

/// Block in memory. The buffers are reused for the next one.
#[derive(Debug, Default)]
pub struct LoadedBlock {
    /// Uncompressed records.
    pub bytes: Vec<u8>,
    /// Messages in order of log time; at equal log times, in file order.
    pub entries: Vec<Entry>,
    definitions: Vec<(Definition, Range<usize>)>,
    compressed: Vec<u8>,
}

impl LoadedBlock {
    /// Replaces the content by `block`.
    ///
    /// # Errors
    /// When the file cannot be read; the inner error is damage of the block itself.
    pub fn load(&mut self, store: &Store, block: &Block) -> Result<Result<(), Damage>, RecordingError> {
        self.bytes.clear();
        self.entries.clear();
        self.definitions.clear();
        let Some(length) = usize::try_from(block.length).ok().filter(|_| block.length <= MAX_BLOCK_BYTES) else {
            return Ok(Err(Damage::TooLarge));
        };
        let source = match store {
            Store::Records(source) => source,
            Store::Database(database) => return Ok(self.load_rows(database, block)),
        };
        let located = match &block.kind {
            BlockKind::Plain => {
                source.read_at(block.offset, length, &mut self.bytes)?;
                self.locate_records()
            }
            BlockKind::Chunk(header) => {
                source.read_at(block.offset, length, &mut self.compressed)?;
                let encoding =
                    ChunkEncoding { compression: &header.compression, size: header.uncompressed_size, crc: header.crc };
                decompress(encoding, &self.compressed, &mut self.bytes).and_then(|()| self.locate_records())
            }
            BlockKind::BagChunk(chunk) => {
                source.read_at(block.offset, length, &mut self.compressed)?;
                let encoding = ChunkEncoding { compression: &chunk.compression, size: chunk.size, crc: 0 };
                decompress(encoding, &self.compressed, &mut self.bytes).and_then(|()| self.locate_bag_records())
            }
            BlockKind::Rows { .. } => Err(Damage::Records),
        };
        Ok(located.and_then(|()| self.decompress_and_sort()))
    }

    fn load_rows(&mut self, database: &SqliteDatabase, block: &Block) -> Result<(), Damage> {
        let BlockKind::Rows { first, last } = block.kind else { return Err(Damage::Records) };
        database.read((first, last), &mut self.bytes, &mut self.entries)?;
        self.decompress_and_sort()
    }

    /// Adds the definitions of this block to the index.
    pub fn add_definitions_to(&self, index: &mut FileIndex) {
        for (definition, range) in &self.definitions {
            let bytes = &self.bytes[range.clone()];
            match definition {
                Definition::Record(opcode) => index.define(*opcode, bytes),
                Definition::Connection => index.define_connection(bytes),
            };
        }
    }

    /// Locates the MCAP records.
    fn locate_records(&mut self) -> Result<(), Damage> {
        let mut fields = Fields::new(&self.bytes);
        while !fields.rest().is_empty() {
            let (opcode, record) = next_record(&mut fields).ok_or(Damage::Records)?;
            let end = self.bytes.len() - fields.rest().len();
            match opcode {
                op::MESSAGE => {
                    let header = record::message_header(record).ok_or(Damage::Records)?;
                    let data = end - record.len() + record::MESSAGE_FIELDS..end;
                    self.entries.push(Entry { channel: header.channel, log_time_ns: header.log_time_ns, data });
                }
                op::SCHEMA | op::CHANNEL => {
                    self.definitions.push((Definition::Record(opcode), end - record.len()..end));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Locates the bag records.
    fn locate_bag_records(&mut self) -> Result<(), Damage> {
        let mut fields = Fields::new(&self.bytes);
        while !fields.rest().is_empty() {
            let start = self.bytes.len() - fields.rest().len();
            let (record, length) = bag::next_in_chunk(&mut fields).ok_or(Damage::Records)?;
            let end = self.bytes.len() - fields.rest().len();
            match record {
                BagRecord::Message(channel, log_time_ns) => {
                    self.entries.push(Entry { channel, log_time_ns, data: end - length..end });
                }
                BagRecord::Connection => self.definitions.push((Definition::Connection, start..end)),
                BagRecord::Other => {}
            }
        }
        Ok(())
    }

    /// Decompresses messages that are compressed individually (a rosbag2 option), then sorts the messages.
    fn decompress_and_sort(&mut self) -> Result<(), Damage> {
        for k in 0..self.entries.len() {
            let data = self.entries[k].data.clone();
            if !self.bytes[data.clone()].starts_with(&ZSTD_MAGIC) {
                continue;
            }
            let compressed = self.bytes[data].to_vec();
            let (start, limit) = (self.bytes.len(), MAX_BLOCK_BYTES.saturating_sub(self.bytes.len() as u64));
            let decompressed = zstd::stream::read::Decoder::with_buffer(&compressed[..])
                .and_then(|zstd| zstd.take(limit + 1).read_to_end(&mut self.bytes));
            match decompressed {
                Ok(size) if size as u64 <= limit => self.entries[k].data = start..self.bytes.len(),
                Ok(_) => return Err(Damage::TooLarge),
                // The message remains compressed and is counted as undecodable later.
                Err(_) => self.bytes.truncate(start),
            }
        }
        if !self.entries.is_sorted_by_key(|entry| entry.log_time_ns) {
            self.entries.sort_by_key(|entry| entry.log_time_ns);
        }
        Ok(())
    }
}

/// Compression of a chunk, uncompressed size in bytes, and CRC-32 of the uncompressed bytes (0 if there is none).
#[derive(Clone, Copy)]
struct ChunkEncoding<'a> {
    compression: &'a str,
    size: u64,
    crc: u32,
}

/// Decompresses a chunk into `bytes` and checks it.
fn decompress(encoding: ChunkEncoding<'_>, compressed: &[u8], bytes: &mut Vec<u8>) -> Result<(), Damage> {
    if encoding.size > MAX_BLOCK_BYTES {
        return Err(Damage::TooLarge);
    }
    bytes.clear();
    bytes.reserve(encoding.size.min(INITIAL_CAPACITY) as usize);
    // One byte more than stated reveals a false size; never more is decompressed.
    let limit = encoding.size + 1;
    let decompressed = match encoding.compression {
        "" | "none" => compressed.take(limit).read_to_end(bytes),
        "zstd" => {
            zstd::stream::read::Decoder::with_buffer(compressed).and_then(|zstd| zstd.take(limit).read_to_end(bytes))
        }
        "lz4" => lz4_flex::frame::FrameDecoder::new(compressed).take(limit).read_to_end(bytes),
        "bz2" => bzip2::bufread::MultiBzDecoder::new(compressed).take(limit).read_to_end(bytes),
        _ => return Err(Damage::Compression),
    };
    match decompressed {
        Ok(size) if size as u64 == encoding.size => {}
        _ => return Err(Damage::Decompression),
    }
    if encoding.crc != 0 && crc32fast::hash(bytes) != encoding.crc {
        return Err(Damage::Checksum);
    }
    Ok(())
}
