//! The messages of a file in the order of their log time.

use super::chunk::{Damage, Loaded};
use super::directory::Block;
use super::part::{ChannelId, Part};
use crate::recording::RecordingError;
use crate::recording::wire::Payload;
use std::collections::VecDeque;

/// Greatest size of blocks in memory at once, bytes. Blocks overlap in time where a program writes topic after topic:
/// then one of each is held. Beyond this, messages come in the order of the file.
const MOST_HELD: usize = 256 << 20;

/// A message as it is in the file.
#[derive(Debug, Clone, Copy)]
pub struct RawMessage<'a> {
    /// Number of its topic.
    pub channel: ChannelId,
    /// When it was written down, ns.
    pub log_time_ns: u64,
    /// Its bytes.
    pub data: Payload<'a>,
}

/// A block that cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DamagedBlock {
    /// Why.
    pub damage: Damage,
    /// Its bytes in the file.
    pub bytes: u64,
}

/// Reads messages in the order of their log time; of those with one log time, in the order of the file.
///
/// A block is in memory from its first message's time to its last's, so as many are held as overlap in time: one, in a
/// file written as time went on.
pub struct Messages<'r> {
    /// Blocks to come, by the time of their first message, with their place in the recording.
    to_come: VecDeque<(usize, &'r Part, &'r Block)>,
    held: Vec<Held<'r>>,
    spare: Vec<Loaded>,
    damaged: Vec<DamagedBlock>,
    count: u64,
}

struct Held<'r> {
    place: usize,
    part: &'r Part,
    loaded: Loaded,
    next: usize,
}

impl Held<'_> {
    fn key(&self) -> Option<(u64, usize)> {
        Some((self.loaded.entries.get(self.next)?.log_time_ns, self.place))
    }
}

impl<'r> Messages<'r> {
    /// The messages of `blocks`.
    pub fn new(blocks: impl Iterator<Item = (&'r Part, &'r Block)>) -> Self {
        let mut to_come: Vec<_> = blocks.enumerate().map(|(place, (part, block))| (place, part, block)).collect();
        to_come.sort_by_key(|(_, _, block)| block.start_ns);
        Self { to_come: to_come.into(), held: Vec::new(), spare: Vec::new(), damaged: Vec::new(), count: 0 }
    }

    /// The next message, `None` after the last.
    ///
    /// # Errors
    /// When the file cannot be read. Damaged blocks are passed over and counted.
    pub fn next(&mut self) -> Result<Option<RawMessage<'_>>, RecordingError> {
        self.release();
        while self.wants_another() {
            self.load_next()?;
        }
        let Some(first) = (0..self.held.len()).min_by_key(|k| self.held[*k].key().unwrap_or((u64::MAX, usize::MAX)))
        else {
            return Ok(None);
        };
        let held = &mut self.held[first];
        let Some(entry) = held.loaded.entries.get(held.next) else { return Ok(None) };
        held.next += 1;
        let data = Payload { bytes: &held.loaded.bytes[entry.data.clone()], wire: held.part.wire(entry.channel) };
        let channel = held.part.channel_id(entry.channel);
        Ok(Some(RawMessage { channel, log_time_ns: entry.log_time_ns, data }))
    }

    /// Blocks that could not be read so far.
    pub fn damaged(&self) -> &[DamagedBlock] {
        &self.damaged
    }

    /// Messages in the blocks that could be read so far.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Lets go of blocks that are read to their end.
    fn release(&mut self) {
        while let Some(done) = self.held.iter().position(|held| held.key().is_none()) {
            self.spare.push(self.held.swap_remove(done).loaded);
        }
        self.spare.truncate(2);
    }

    /// Whether the next block may hold a message before those in memory.
    fn wants_another(&self) -> bool {
        let Some((_, _, block)) = self.to_come.front() else { return false };
        match self.held.iter().filter_map(Held::key).min() {
            None => true,
            Some((time, _)) => block.start_ns <= time && self.bytes_held() < MOST_HELD,
        }
    }

    fn bytes_held(&self) -> usize {
        self.held.iter().map(|held| held.loaded.bytes.len()).sum()
    }

    fn load_next(&mut self) -> Result<(), RecordingError> {
        let Some((place, part, block)) = self.to_come.pop_front() else { return Ok(()) };
        let mut loaded = self.spare.pop().unwrap_or_default();
        match loaded.load(&part.store, block)? {
            Ok(()) => {
                self.count += loaded.entries.len() as u64;
                self.held.push(Held { place, part, loaded, next: 0 });
            }
            Err(damage) => {
                self.damaged.push(DamagedBlock { damage, bytes: block.length });
                self.spare.push(loaded);
            }
        }
        Ok(())
    }
}
