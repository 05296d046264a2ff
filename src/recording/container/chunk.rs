//! A block of a file in memory: decompressed, checked, its messages in the order of their log time.

use super::bag::{self, BagRecord};
use super::directory::{Block, BlockKind, Directory};
use super::part::Store;
use super::record::{self, Fields, op};
use super::rows::Rows;
use super::signposts::next_record;
use crate::recording::RecordingError;
use std::io::Read;
use std::ops::Range;

/// Greatest size of a block in memory, compressed or not. Writers make chunks of about a megabyte; one that claims more
/// than this is a decompression bomb or a damaged length.
const LARGEST: u64 = 256 << 20;

/// First bytes of a zstd frame; a serialised message does not begin with them.
const ZSTD_MAGIC: [u8; 4] = [0x28, 0xB5, 0x2F, 0xFD];

/// Least room that is made at once for what a chunk unpacks to.
const FIRST_ROOM: u64 = 1 << 20;

/// Why a block cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum Damage {
    /// It is larger than any reader should take.
    #[error("it says that it is larger than 256 MiB")]
    TooLarge,
    /// It is compressed in a way that is not known here.
    #[error("its compression is not known")]
    Compression,
    /// It does not decompress to what it says.
    #[error("it does not decompress")]
    Unpacking,
    /// Its bytes changed since it was written.
    #[error("its checksum does not match")]
    Checksum,
    /// Its records do not fit into it.
    #[error("its records are broken")]
    Records,
}

/// A message within a block.
#[derive(Debug, Clone)]
pub struct Entry {
    /// Number of its topic.
    pub channel: u16,
    /// When it was written down, ns.
    pub log_time_ns: u64,
    /// Where its data are.
    pub data: Range<usize>,
}

/// What a definition within a block is.
#[derive(Debug, Clone, Copy)]
enum Definition {
    /// A type or a topic in MCAP, by its opcode.
    Record(u8),
    /// A connection of a bag.
    Connection,
}

/// A block in memory. Its buffers are used again for the next one.
#[derive(Debug, Default)]
pub struct Loaded {
    /// The records.
    pub bytes: Vec<u8>,
    /// Its messages in the order of their log time; of those with one log time, in the order of the file.
    pub entries: Vec<Entry>,
    definitions: Vec<(Definition, Range<usize>)>,
    packed: Vec<u8>,
}

impl Loaded {
    /// Reads `block` in the place of what was here.
    ///
    /// # Errors
    /// When the file cannot be read; what is wrong with the block itself is the value within.
    pub fn load(&mut self, store: &Store, block: &Block) -> Result<Result<(), Damage>, RecordingError> {
        self.bytes.clear();
        self.entries.clear();
        self.definitions.clear();
        let Some(length) = usize::try_from(block.length).ok().filter(|_| block.length <= LARGEST) else {
            return Ok(Err(Damage::TooLarge));
        };
        let source = match store {
            Store::Records(source) => source,
            Store::Rows(rows) => return Ok(self.rows(rows, block)),
        };
        let indexed = match &block.kind {
            BlockKind::Plain => {
                source.read_at(block.offset, length, &mut self.bytes)?;
                self.index()
            }
            BlockKind::Chunk(header) => {
                source.read_at(block.offset, length, &mut self.packed)?;
                let packing =
                    Packing { compression: &header.compression, size: header.uncompressed_size, crc: header.crc };
                unpack(packing, &self.packed, &mut self.bytes).and_then(|()| self.index())
            }
            BlockKind::BagChunk(chunk) => {
                source.read_at(block.offset, length, &mut self.packed)?;
                let packing = Packing { compression: &chunk.compression, size: chunk.size, crc: 0 };
                unpack(packing, &self.packed, &mut self.bytes).and_then(|()| self.index_bag())
            }
            BlockKind::Rows { .. } => Err(Damage::Records),
        };
        Ok(indexed.and_then(|()| self.settle()))
    }

    fn rows(&mut self, rows: &Rows, block: &Block) -> Result<(), Damage> {
        let BlockKind::Rows { first, last } = block.kind else { return Err(Damage::Records) };
        rows.read((first, last), &mut self.bytes, &mut self.entries)?;
        self.settle()
    }

    /// Takes up the definitions of this block.
    pub fn define_in(&self, directory: &mut Directory) {
        for (definition, place) in &self.definitions {
            let bytes = &self.bytes[place.clone()];
            match definition {
                Definition::Record(opcode) => directory.define(*opcode, bytes),
                Definition::Connection => directory.define_connection(bytes),
            };
        }
    }

    /// Finds the records.
    fn index(&mut self) -> Result<(), Damage> {
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

    /// Finds the records of a bag.
    fn index_bag(&mut self) -> Result<(), Damage> {
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

    /// Decompresses messages that are compressed each by itself, as rosbag2 does on request, and sorts them.
    fn settle(&mut self) -> Result<(), Damage> {
        for k in 0..self.entries.len() {
            let data = self.entries[k].data.clone();
            if !self.bytes[data.clone()].starts_with(&ZSTD_MAGIC) {
                continue;
            }
            let packed = self.bytes[data].to_vec();
            let (start, room) = (self.bytes.len(), LARGEST.saturating_sub(self.bytes.len() as u64));
            let unpacked = zstd::stream::read::Decoder::with_buffer(&packed[..])
                .and_then(|zstd| zstd.take(room + 1).read_to_end(&mut self.bytes));
            match unpacked {
                Ok(size) if size as u64 <= room => self.entries[k].data = start..self.bytes.len(),
                Ok(_) => return Err(Damage::TooLarge),
                // The message stays as it is, and is counted as one that cannot be decoded.
                Err(_) => self.bytes.truncate(start),
            }
        }
        if !self.entries.is_sorted_by_key(|entry| entry.log_time_ns) {
            self.entries.sort_by_key(|entry| entry.log_time_ns);
        }
        Ok(())
    }
}

/// How a chunk is compressed, how many bytes it holds, and their CRC-32 (0 where there is none).
#[derive(Clone, Copy)]
struct Packing<'a> {
    compression: &'a str,
    size: u64,
    crc: u32,
}

/// Decompresses a chunk into `bytes`, and checks it.
fn unpack(packing: Packing<'_>, packed: &[u8], bytes: &mut Vec<u8>) -> Result<(), Damage> {
    if packing.size > LARGEST {
        return Err(Damage::TooLarge);
    }
    bytes.clear();
    bytes.reserve(packing.size.min(FIRST_ROOM) as usize);
    // One byte more than the chunk says shows that it says too little; no more is ever unpacked.
    let most = packing.size + 1;
    let unpacked = match packing.compression {
        "" | "none" => packed.take(most).read_to_end(bytes),
        "zstd" => zstd::stream::read::Decoder::with_buffer(packed).and_then(|zstd| zstd.take(most).read_to_end(bytes)),
        "lz4" => lz4_flex::frame::FrameDecoder::new(packed).take(most).read_to_end(bytes),
        "bz2" => bzip2::bufread::MultiBzDecoder::new(packed).take(most).read_to_end(bytes),
        _ => return Err(Damage::Compression),
    };
    match unpacked {
        Ok(size) if size as u64 == packing.size => {}
        _ => return Err(Damage::Unpacking),
    }
    if packing.crc != 0 && crc32fast::hash(bytes) != packing.crc {
        return Err(Damage::Checksum);
    }
    Ok(())
}
