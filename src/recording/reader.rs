//! A recording, opened for reading: by zsim or by anybody.

use crate::recording::container::{Block, Channel, ChannelId, Messages, Part, RawMessage};
use crate::recording::folder::files_of;
use crate::recording::{Loss, RecordingError};
use std::io::{Read, Seek};
use std::path::Path;

/// A recording: an MCAP file, a ROS 1 bag, a rosbag2 database, or several files of these, split by their recorder.
/// Opening it finds what is where; messages are read as they are asked for, a chunk or two in memory at a time, from
/// files that are cut short or damaged as from whole ones.
pub struct Reader {
    name: String,
    parts: Vec<Part>,
    channels: Vec<Channel>,
    loss: Loss,
}

impl Reader {
    /// Opens the file at `path`, or the one in the folder at `path`, as rosbag2 makes them: all of its files where the
    /// recording is split.
    ///
    /// # Errors
    /// When it cannot be opened or read, or is of no format that is read. A file that is cut short or damaged is
    /// opened.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let files = files_of(path)?;
        let parts = files.iter().zip(0..).map(|(file, place)| Part::open(place, file)).collect::<Result<_, _>>()?;
        let name = if files.len() == 1 { &files[0] } else { path };
        Ok(Self::of(&name.display().to_string(), parts))
    }

    /// Opens `input`, one file, which messages call `name`.
    ///
    /// # Errors
    /// When it cannot be read, or is of no format that is read.
    pub fn new(name: &str, input: impl Read + Seek + Send + 'static) -> Result<Self, RecordingError> {
        Ok(Self::of(name, vec![Part::new_input(name, input)?]))
    }

    fn of(name: &str, parts: Vec<Part>) -> Self {
        let channels = parts.iter().flat_map(Part::channels).collect();
        let loss = Loss::of_files(parts.iter().map(|part| &part.directory));
        Self { name: name.to_owned(), parts, channels, loss }
    }

    /// The file's name, for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The manifest of the run that zsim recorded; `None` in a recording by others.
    pub fn manifest(&self) -> Option<&str> {
        self.parts.iter().find_map(|part| Some(part.directory.metadata.get("zsim")?.get("manifest")?.as_str()))
    }

    /// What the files as a whole lost. Damaged chunks show only when they are read: each pass counts those it meets.
    pub fn loss(&self) -> &Loss {
        &self.loss
    }

    /// Bytes in the files.
    pub(super) fn length_bytes(&self) -> u64 {
        self.parts.iter().map(|part| part.store.length()).sum()
    }

    pub(super) fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// The numbers under which a topic's messages are in the recording.
    pub(super) fn ids_of(&self, topic: &str) -> Vec<ChannelId> {
        self.channels.iter().filter(|channel| channel.topic == topic).map(|channel| channel.id).collect()
    }

    /// The topics with their types, for messages.
    pub(super) fn what_it_has(&self) -> String {
        let mut topics: Vec<_> = self.channels.iter().map(|c| format!("{} ({})", c.topic, c.type_name)).collect();
        topics.sort();
        topics.dedup();
        if topics.is_empty() { "no topics at all".to_owned() } else { topics.join(", ") }
    }

    fn blocks(&self) -> impl Iterator<Item = (&Part, &Block)> {
        self.parts.iter().flat_map(|part| part.directory.blocks.iter().map(move |block| (part, block)))
    }

    /// All messages in the order of their log time.
    pub(super) fn messages(&self) -> Messages<'_> {
        Messages::new(self.blocks())
    }

    /// The messages of blocks that seem to hold some of `channels`, among others of those blocks.
    pub(super) fn messages_near(&self, channels: &[ChannelId]) -> Messages<'_> {
        Messages::new(self.blocks_near(channels).into_iter())
    }

    fn blocks_near(&self, channels: &[ChannelId]) -> Vec<(&Part, &Block)> {
        let near = |part: &Part| part.local(channels);
        let blocks = self.parts.iter().map(|part| (part, near(part)));
        let blocks = blocks.flat_map(|(part, ids)| {
            let seem = part.directory.blocks.iter().filter(move |block| block.seems_to_hold(&ids));
            seem.map(move |block| (part, block))
        });
        blocks.collect()
    }

    /// Gives `take` messages of `channels` from all over the recording: of `blocks` blocks, evenly chosen, the first
    /// `each`.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub(super) fn sample(
        &self,
        channels: &[ChannelId],
        (blocks, each): (usize, usize),
        mut take: impl FnMut(&RawMessage<'_>),
    ) -> Result<(), RecordingError> {
        let near = self.blocks_near(channels);
        let step = near.len().div_ceil(blocks).max(1);
        for block in near.iter().step_by(step) {
            let (mut messages, mut left) = (Messages::new(std::iter::once(*block)), each);
            while left > 0 {
                let Some(message) = messages.next()? else { break };
                if channels.contains(&message.channel) {
                    take(&message);
                    left -= 1;
                }
            }
        }
        Ok(())
    }

    /// How many messages the summaries count.
    pub(super) fn expected_messages(&self) -> Option<u64> {
        self.parts.iter().map(|part| part.directory.expected_messages).sum()
    }
}
