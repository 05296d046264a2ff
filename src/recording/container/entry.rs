//! Messages within a block, and the reasons why a block cannot be read.

use std::ops::Range;

/// Message within a block.
#[derive(Debug, Clone)]
pub struct Entry {
    /// Channel number of the topic.
    pub channel: u16,
    /// Log time, ns.
    pub log_time_ns: u64,
    /// Position of the data in the block.
    pub data: Range<usize>,
}

/// Reason why a block cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum Damage {
    /// It exceeds the maximum size.
    #[error("it exceeds 256 MiB or 4 million messages")]
    TooLarge,
    /// Unsupported compression.
    #[error("its compression is not supported")]
    Compression,
    /// The decompressed size is not the stated size.
    #[error("it does not decompress")]
    Decompression,
    /// The bytes are corrupted.
    #[error("its checksum does not match")]
    Checksum,
    /// The records are inconsistent.
    #[error("its records are damaged")]
    Records,
}
