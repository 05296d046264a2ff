//! Reads the messages of a recording in order of log time.

use super::entry::Damage;
use super::file_index::Block;
use super::file_index::ChannelId;
use super::loaded_block::LoadedBlock;
use super::recording_file::RecordingFile;
use crate::RecordingError;
use crate::wire::Payload;
use std::collections::VecDeque;

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
    active: Vec<ActiveBlock<'r>>,
    spare: Vec<LoadedBlock>,
    damaged: Vec<DamagedBlock>,
    count: u64,
}

struct ActiveBlock<'r> {
    position: usize,
    file: &'r RecordingFile,
    loaded: LoadedBlock,
    next: usize,
}

impl ActiveBlock<'_> {
    fn key(&self) -> Option<(u64, usize)> {
        Some((self.loaded.entries.get(self.next)?.log_time_ns, self.position))
    }
}

impl<'r> Messages<'r> {
    /// Reads the messages of `blocks`.
    pub fn new(blocks: impl Iterator<Item = (&'r RecordingFile, &'r Block)>) -> Self {
        let mut pending: Vec<_> = blocks.enumerate().map(|(position, (file, block))| (position, file, block)).collect();
        pending.sort_by_key(|(_, _, block)| block.start_ns);
        Self { pending: pending.into(), active: Vec::new(), spare: Vec::new(), damaged: Vec::new(), count: 0 }
    }

    /// Returns the next message, `None` after the last.
    ///
    /// # Errors
    /// When the file cannot be read. Damaged blocks are skipped and counted.
    pub fn next(&mut self) -> Result<Option<RawMessage<'_>>, RecordingError> {
        self.release();
        while self.needs_next_block() {
            self.load_next()?;
        }
        let Some(first) =
            (0..self.active.len()).min_by_key(|k| self.active[*k].key().unwrap_or((u64::MAX, usize::MAX)))
        else {
            return Ok(None);
        };
        let active = &mut self.active[first];
        let Some(entry) = active.loaded.entries.get(active.next) else { return Ok(None) };
        active.next += 1;
        let data = Payload { bytes: &active.loaded.bytes[entry.data.clone()], wire: active.file.wire(entry.channel) };
        let channel = active.file.channel_id(entry.channel);
        Ok(Some(RawMessage { channel, log_time_ns: entry.log_time_ns, data }))
    }

    /// Blocks found unreadable so far.
    pub fn damaged(&self) -> &[DamagedBlock] {
        &self.damaged
    }

    /// Number of messages in the blocks read so far.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Releases completely read blocks.
    fn release(&mut self) {
        while let Some(done) = self.active.iter().position(|active| active.key().is_none()) {
            self.spare.push(self.active.swap_remove(done).loaded);
        }
        self.spare.truncate(2);
    }

    /// Whether the next block may contain a message before those of the blocks in memory.
    fn needs_next_block(&self) -> bool {
        let Some((_, _, block)) = self.pending.front() else { return false };
        match self.active.iter().filter_map(ActiveBlock::key).min() {
            None => true,
            Some((time, _)) => block.start_ns <= time && self.active_bytes() < MAX_ACTIVE_BYTES,
        }
    }

    fn active_bytes(&self) -> usize {
        self.active.iter().map(|active| active.loaded.bytes.len()).sum()
    }

    fn load_next(&mut self) -> Result<(), RecordingError> {
        let Some((position, file, block)) = self.pending.pop_front() else { return Ok(()) };
        let mut loaded = self.spare.pop().unwrap_or_default();
        match loaded.load(&file.store, block)? {
            Ok(()) => {
                self.count += loaded.entries.len() as u64;
                self.active.push(ActiveBlock { position, file, loaded, next: 0 });
            }
            Err(damage) => {
                self.damaged.push(DamagedBlock { damage, bytes: block.length });
                self.spare.push(loaded);
            }
        }
        Ok(())
    }
}
