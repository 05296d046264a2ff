//! Loads a block of a file into memory: decompresses and checks it, and sorts the messages by log time.

use super::bag;
use super::budget::Budget;
use super::encoding::MAX_BLOCK_BYTES;
use super::entry::{Damage, Entry};
use super::file_index::{Block, BlockKind, FileIndex};
use super::record::{self, Fields, next_record, op};
use super::recording_file::Store;
use crate::RecordingError;
use std::io::Read;

/// Maximum number of messages of a block.
const MAX_BLOCK_MESSAGES: usize = 4 << 20;

/// Capacity of a buffer that is kept for the next block, bytes: that of all but exceptional chunks.
const MAX_KEPT_BYTES: usize = 16 << 20;

/// First bytes of a zstd frame; a serialised message does not start with them.
const ZSTD_MAGIC: [u8; 4] = [0x28, 0xB5, 0x2F, 0xFD];

/// Block in memory. The buffers are reused for the next one.
#[derive(Debug, Default)]
pub struct LoadedBlock {
    /// Uncompressed records.
    pub bytes: Vec<u8>,
    /// Messages in order of log time; at equal log times, in file order.
    pub entries: Vec<Entry>,
}

impl LoadedBlock {
    /// Replaces the content by `block`. `compressed` is a buffer for compressed bytes.
    ///
    /// # Errors
    /// When the file cannot be read, or the budget is exhausted. The inner error is damage of the block itself; the
    /// messages are then those that are intact.
    pub fn load(
        &mut self,
        store: &Store,
        block: &Block,
        compressed: &mut Vec<u8>,
        budget: &mut Budget,
    ) -> Result<Result<(), Damage>, RecordingError> {
        self.clear();
        let loaded = self.read(store, block, compressed)?;
        compressed.clear();
        compressed.shrink_to(MAX_KEPT_BYTES);
        let decompressed = self.decompress_messages();
        if !self.entries.is_sorted_by_key(|entry| entry.log_time_ns) {
            self.entries.sort_by_key(|entry| entry.log_time_ns);
        }
        budget.decompress(self.bytes.len() as u64)?;
        Ok(loaded.and(decompressed))
    }

    /// Memory of the content, bytes.
    pub fn size(&self) -> usize {
        size_of::<Self>() + self.bytes.capacity() + self.entries.capacity() * size_of::<Entry>()
    }

    fn clear(&mut self) {
        self.bytes.clear();
        self.bytes.shrink_to(MAX_KEPT_BYTES);
        self.entries.clear();
        self.entries.shrink_to(MAX_KEPT_BYTES / size_of::<Entry>());
    }

    fn read(
        &mut self,
        store: &Store,
        block: &Block,
        compressed: &mut Vec<u8>,
    ) -> Result<Result<(), Damage>, RecordingError> {
        let Some(length) = usize::try_from(block.length).ok().filter(|_| block.length <= MAX_BLOCK_BYTES) else {
            return Ok(Err(Damage::TooLarge));
        };
        let source = match store {
            Store::Records(source) => source,
            Store::Database(database) => {
                let BlockKind::Rows { first, last } = block.kind else { return Ok(Err(Damage::Records)) };
                return Ok(database.read((first, last), &mut self.bytes, &mut self.entries));
            }
        };
        let into = if block.kind == BlockKind::Plain { &mut self.bytes } else { &mut *compressed };
        source.read_at(block.offset, length, into)?;
        Ok(match block.kind {
            BlockKind::Plain => self.locate_records(),
            BlockKind::Chunk(encoding) => {
                encoding.decompress(compressed, &mut self.bytes).and_then(|()| self.locate_records())
            }
            BlockKind::BagChunk(encoding) => {
                let decompressed = encoding.decompress_intact(compressed, &mut self.bytes);
                let located = self.locate_bag_records();
                decompressed.and(located)
            }
            BlockKind::Rows { .. } => Err(Damage::Records),
        })
    }

    /// Adds the definitions of this block, loaded from `block`, to the index.
    ///
    /// # Errors
    /// When the budget is exhausted.
    pub fn add_definitions_to(
        &self,
        index: &mut FileIndex,
        kind: BlockKind,
        budget: &mut Budget,
    ) -> Result<(), RecordingError> {
        if let BlockKind::BagChunk(_) = kind {
            for connection in bag::connections_in_chunk(&self.bytes) {
                index.define_connection(connection, budget)?;
            }
            return Ok(());
        }
        let mut fields = Fields::new(&self.bytes);
        while let Some((opcode, record)) = next_record(&mut fields) {
            if matches!(opcode, op::SCHEMA | op::CHANNEL) {
                index.define(opcode, record, budget)?;
            }
        }
        Ok(())
    }

    /// Locates the MCAP records.
    fn locate_records(&mut self) -> Result<(), Damage> {
        let mut fields = Fields::new(&self.bytes);
        while !fields.rest().is_empty() {
            let (opcode, record) = next_record(&mut fields).ok_or(Damage::Records)?;
            if opcode == op::MESSAGE {
                let end = self.bytes.len() - fields.rest().len();
                let header = record::message_header(record).ok_or(Damage::Records)?;
                let data = end - record.len() + record::MESSAGE_FIELDS..end;
                push(&mut self.entries, Entry { channel: header.channel, log_time_ns: header.log_time_ns, data })?;
            }
        }
        Ok(())
    }

    /// Locates the bag records.
    fn locate_bag_records(&mut self) -> Result<(), Damage> {
        let mut records = bag::ChunkRecords::new(&self.bytes);
        for record in &mut records {
            if let Some((channel, log_time_ns)) = record.message {
                push(&mut self.entries, Entry { channel, log_time_ns, data: record.data })?;
            }
        }
        if records.is_damaged() { Err(Damage::Records) } else { Ok(()) }
    }

    /// Decompresses messages that are compressed individually (a rosbag2 option).
    fn decompress_messages(&mut self) -> Result<(), Damage> {
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
                Ok(_) => {
                    self.bytes.truncate(start);
                    self.entries.truncate(k);
                    return Err(Damage::TooLarge);
                }
                // The message remains compressed and is counted as undecodable later.
                Err(_) => self.bytes.truncate(start),
            }
        }
        Ok(())
    }
}

/// Adds a message, if a block may have more.
fn push(entries: &mut Vec<Entry>, entry: Entry) -> Result<(), Damage> {
    if entries.len() >= MAX_BLOCK_MESSAGES {
        return Err(Damage::TooLarge);
    }
    entries.push(entry);
    Ok(())
}
