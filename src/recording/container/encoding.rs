//! Compression of chunks.

use super::entry::Damage;
use std::io::{Read, Result};

/// Maximum size of a block in memory, compressed or not, bytes.
///
/// Writers make chunks of about 1 MB; a larger claim is a decompression bomb or a damaged length.
pub const MAX_BLOCK_BYTES: u64 = 256 << 20;

/// Maximum memory reserved before decompression, bytes.
const INITIAL_CAPACITY: u64 = 1 << 20;

/// Compression algorithm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Compression {
    /// Stored as it is.
    None,
    /// zstd frames.
    Zstd,
    /// An LZ4 frame.
    Lz4,
    /// A bzip2 stream.
    Bz2,
    /// Another algorithm.
    Unsupported,
}

impl Compression {
    /// Algorithm with the name in an MCAP file or a bag.
    pub fn named(name: &str) -> Self {
        match name {
            "" | "none" => Self::None,
            "zstd" => Self::Zstd,
            "lz4" => Self::Lz4,
            "bz2" => Self::Bz2,
            _ => Self::Unsupported,
        }
    }
}

/// Encoding of a chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Encoding {
    /// Compression.
    pub compression: Compression,
    /// Uncompressed size, bytes.
    pub size: u64,
    /// CRC-32 of the uncompressed bytes, 0 if there is none.
    pub crc: u32,
}

impl Encoding {
    /// Decompresses a chunk into `bytes`, and checks size and checksum.
    ///
    /// # Errors
    /// When it is damaged.
    pub fn decompress(self, compressed: &[u8], bytes: &mut Vec<u8>) -> std::result::Result<(), Damage> {
        if self.size > MAX_BLOCK_BYTES {
            return Err(Damage::TooLarge);
        }
        // One byte more than stated reveals a false size; never more is decompressed.
        match self.read(compressed, self.size + 1, bytes)? {
            Ok(_) if bytes.len() as u64 == self.size => {}
            _ => return Err(Damage::Decompression),
        }
        if self.crc != 0 && crc32fast::hash(bytes) != self.crc {
            return Err(Damage::Checksum);
        }
        Ok(())
    }

    /// Decompresses a chunk of a bag into `bytes`, as far as it is intact.
    ///
    /// The format has no checksum, and some programs write a wrong size, so the size is not checked.
    ///
    /// # Errors
    /// When it is damaged; `bytes` is then the part before the damage.
    pub fn decompress_intact(self, compressed: &[u8], bytes: &mut Vec<u8>) -> std::result::Result<(), Damage> {
        let decompressed = self.read(compressed, MAX_BLOCK_BYTES + 1, bytes)?;
        if bytes.len() as u64 > MAX_BLOCK_BYTES {
            bytes.clear();
            return Err(Damage::TooLarge);
        }
        let is_missing = bytes.is_empty() && self.size > 0;
        if decompressed.is_err() || is_missing { Err(Damage::Decompression) } else { Ok(()) }
    }

    /// Replaces the content of `bytes` by at most `limit` decompressed bytes.
    fn read(self, compressed: &[u8], limit: u64, bytes: &mut Vec<u8>) -> std::result::Result<Result<usize>, Damage> {
        bytes.clear();
        bytes.reserve(self.size.min(INITIAL_CAPACITY) as usize);
        Ok(match self.compression {
            Compression::None => compressed.take(limit).read_to_end(bytes),
            Compression::Zstd => zstd::stream::read::Decoder::with_buffer(compressed)
                .and_then(|zstd| zstd.take(limit).read_to_end(bytes)),
            Compression::Lz4 => lz4_flex::frame::FrameDecoder::new(compressed).take(limit).read_to_end(bytes),
            // One stream, as ROS reads it: each of a million empty streams would allocate its tables.
            Compression::Bz2 => bzip2::bufread::BzDecoder::new(compressed).take(limit).read_to_end(bytes),
            Compression::Unsupported => return Err(Damage::Compression),
        })
    }
}
