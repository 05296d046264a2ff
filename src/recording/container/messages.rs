//! Reads the messages of a recording in order of log time.

use super::budget::Budget;
use super::entry::Damage;
use super::file_index::{Block, ChannelId};
use super::loaded_block::LoadedBlock;
use super::recording_file::RecordingFile;
use crate::RecordingError;
use crate::wire::Payload;
use std::collections::{BTreeMap, VecDeque};

/// Maximum size of the blocks in memory, bytes.
///
/// Blocks overlap in time if a program writes one topic after another; one block per topic is then in memory. Above the
/// limit, messages are returned in file order.
const MAX_ACTIVE_BYTES: usize = 256 << 20;

/// Message as stored in the file.
#[derive(Debug, Clone, Copy)]
pub struct RawMessage<'a> {
    /// Channel number of the topic.
    pub channel: ChannelId,
    /// Log time, ns.
    pub log_time_ns: u64,
    /// Serialised bytes.
    pub data: Payload<'a>,
}

/// Block that cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DamagedBlock {
    /// Kind of damage.
    pub damage: Damage,
    /// Size in the file, bytes.
    pub bytes: u64,
}

/// Reads messages in order of log time; at equal log times, in file order.
///
/// A block is in memory from the first message's log time to the last's, so the number of blocks in memory is the
/// number that overlap in time: one, in a file written in order of time.
pub struct Messages<'r> {
    /// Blocks not yet loaded, sorted by the time of their first message, with their position in the recording.
    pending: VecDeque<(usize, &'r RecordingFile, &'r Block)>,
    /// Block of the last message.
    current: Option<ActiveBlock<'r>>,
    /// Other blocks in memory, by their next message.
    waiting: BTreeMap<Key, ActiveBlock<'r>>,
    /// Memory of the blocks in memory, bytes.
    active_bytes: usize,
    /// Buffers of the last completely read block, and of compressed bytes.
    spare: LoadedBlock,
    compressed: Vec<u8>,
    budget: Budget,
    damaged: Vec<DamagedBlock>,
    count: u64,
}

/// Log time of a message, ns, and position of its block in the recording.
type Key = (u64, usize);

struct ActiveBlock<'r> {
    position: usize,
    file: &'r RecordingFile,
    loaded: LoadedBlock,
    next: usize,
}

impl ActiveBlock<'_> {
    fn key(&self) -> Option<Key> {
        Some((self.loaded.entries.get(self.next)?.log_time_ns, self.position))
    }
}

impl<'r> Messages<'r> {
    /// Reads the messages of `blocks`, within `budget`.
    pub fn new(blocks: impl Iterator<Item = (&'r RecordingFile, &'r Block)>, budget: Budget) -> Self {
        let mut pending: Vec<_> = blocks.enumerate().map(|(position, (file, block))| (position, file, block)).collect();
        pending.sort_by_key(|(_, _, block)| block.start_ns);
        Self {
            pending: pending.into(),
            current: None,
            waiting: BTreeMap::new(),
            active_bytes: 0,
            spare: LoadedBlock::default(),
            compressed: Vec::new(),
            budget,
            damaged: Vec::new(),
            count: 0,
        }
    }

    /// Returns the next message, `None` after the last.
    ///
    /// # Errors
    /// When the file cannot be read, or decompresses to too much. Damaged blocks are skipped and counted.
    pub fn next(&mut self) -> Result<Option<RawMessage<'_>>, RecordingError> {
        self.release();
        while self.needs_next_block() {
            self.load_next()?;
        }
        self.select();
        let Some(active) = &mut self.current else { return Ok(None) };
        let Some(entry) = active.loaded.entries.get(active.next) else { return Ok(None) };
        active.next += 1;
        let data = Payload { bytes: &active.loaded.bytes[entry.data.clone()], wire: active.file.wire(entry.channel) };
        let channel = active.file.channel_id(entry.channel);
        Ok(Some(RawMessage { channel, log_time_ns: entry.log_time_ns, data }))
    }

    /// Blocks found unreadable so far, completely or in part.
    pub fn damaged(&self) -> &[DamagedBlock] {
        &self.damaged
    }

    /// Number of messages in the blocks read so far.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Releases the current block if it is completely read.
    fn release(&mut self) {
        if let Some(done) = self.current.take_if(|active| active.key().is_none()) {
            self.active_bytes -= done.loaded.size();
            self.spare = done.loaded;
        }
    }

    /// Makes the block of the earliest message the current one.
    fn select(&mut self) {
        let current = self.current.as_ref().and_then(ActiveBlock::key);
        if let Some(first) = self.waiting.first_entry()
            && current.is_none_or(|key| *first.key() < key)
        {
            let before = self.current.replace(first.remove());
            self.waiting.extend(current.zip(before));
        }
    }

    /// Whether the next block may contain a message before those of the blocks in memory.
    fn needs_next_block(&self) -> bool {
        let Some((_, _, block)) = self.pending.front() else { return false };
        let current = self.current.as_ref().and_then(ActiveBlock::key);
        match current.into_iter().chain(self.waiting.keys().next().copied()).min() {
            None => true,
            Some((time, _)) => block.start_ns <= time && self.active_bytes < MAX_ACTIVE_BYTES,
        }
    }

    fn load_next(&mut self) -> Result<(), RecordingError> {
        let Some((position, file, block)) = self.pending.pop_front() else { return Ok(()) };
        let mut loaded = std::mem::take(&mut self.spare);
        if let Err(damage) = loaded.load(&file.store, block, &mut self.compressed, &mut self.budget)? {
            self.damaged.push(DamagedBlock { damage, bytes: block.length });
        }
        self.count += loaded.entries.len() as u64;
        let active = ActiveBlock { position, file, loaded, next: 0 };
        match active.key() {
            Some(key) => {
                self.active_bytes += active.loaded.size();
                self.waiting.insert(key, active);
            }
            None => self.spare = active.loaded,
        }
        Ok(())
    }
}
