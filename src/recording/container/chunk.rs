//! A block of a file in memory: decompressed, checked, its messages in the order of their log time.

use super::directory::{Block, BlockKind};
use super::record::{self, ChunkHeader, Fields, op};
use super::signposts::next_record;
use super::source::Source;
use crate::recording::RecordingError;
use std::io::Read;
use std::ops::Range;

/// Greatest size of a block in memory, compressed or not. Writers make chunks of about a megabyte; one that claims more
/// than this is a decompression bomb or a damaged length.
const LARGEST: u64 = 256 << 20;

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

/// A block in memory. Its buffers are used again for the next one.
#[derive(Debug, Default)]
pub struct Loaded {
    /// The records.
    pub bytes: Vec<u8>,
    /// Its messages in the order of their log time; of those with one log time, in the order of the file.
    pub entries: Vec<Entry>,
    /// Where definitions of topics and types are: opcode and fields.
    pub definitions: Vec<(u8, Range<usize>)>,
    packed: Vec<u8>,
}

impl Loaded {
    /// Reads `block` in the place of what was here.
    ///
    /// # Errors
    /// When the file cannot be read; what is wrong with the block itself is the value within.
    pub fn load(&mut self, source: &Source, block: &Block) -> Result<Result<(), Damage>, RecordingError> {
        self.entries.clear();
        self.definitions.clear();
        let Some(length) = usize::try_from(block.length).ok().filter(|_| block.length <= LARGEST) else {
            return Ok(Err(Damage::TooLarge));
        };
        match &block.kind {
            BlockKind::Plain => source.read_at(block.offset, length, &mut self.bytes)?,
            BlockKind::Chunk(header) => {
                source.read_at(block.offset, length, &mut self.packed)?;
                if let Err(damage) = unpack(header, &self.packed, &mut self.bytes) {
                    return Ok(Err(damage));
                }
            }
        }
        Ok(self.index())
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
                op::SCHEMA | op::CHANNEL => self.definitions.push((opcode, end - record.len()..end)),
                _ => {}
            }
        }
        if !self.entries.is_sorted_by_key(|entry| entry.log_time_ns) {
            self.entries.sort_by_key(|entry| entry.log_time_ns);
        }
        Ok(())
    }
}

/// Decompresses a chunk into `bytes`, and checks it.
fn unpack(header: &ChunkHeader, packed: &[u8], bytes: &mut Vec<u8>) -> Result<(), Damage> {
    if header.uncompressed_size > LARGEST {
        return Err(Damage::TooLarge);
    }
    bytes.clear();
    bytes.reserve(header.uncompressed_size.min(FIRST_ROOM) as usize);
    // One byte more than the chunk says shows that it says too little; no more is ever unpacked.
    let most = header.uncompressed_size + 1;
    let unpacked = match header.compression.as_str() {
        "" => packed.take(most).read_to_end(bytes),
        "zstd" => zstd::stream::read::Decoder::with_buffer(packed).and_then(|zstd| zstd.take(most).read_to_end(bytes)),
        "lz4" => lz4_flex::frame::FrameDecoder::new(packed).take(most).read_to_end(bytes),
        _ => return Err(Damage::Compression),
    };
    match unpacked {
        Ok(size) if size as u64 == header.uncompressed_size => {}
        _ => return Err(Damage::Unpacking),
    }
    if header.crc != 0 && crc32fast::hash(bytes) != header.crc {
        return Err(Damage::Checksum);
    }
    Ok(())
}
