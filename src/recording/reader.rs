//! Opens a recording for reading, written by zsim or by another program.

use crate::container::{Block, Budget, Channel, ChannelId, Messages, RawMessage, RecordingFile};
use crate::folder::list_files;
use crate::topics::shortened;
use crate::{Loss, RecordingError};
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};
use zsim_base::time::Stamp;

/// Maximum number of topics in a message.
const MAX_LISTED_TOPICS: usize = 100;

/// A recording: an MCAP file, a ROS 1 bag, a rosbag2 database, or several of these from a split recording.
///
/// Opening builds an index. Messages are read on demand, with one or two chunks in memory at a time. Truncated and
/// damaged files are readable too.
pub struct Reader {
    name: String,
    files: Vec<RecordingFile>,
    channels: Vec<Channel>,
    loss: Loss,
}

impl Reader {
    /// Opens the file at `path`, or the recording in the folder at `path`, as rosbag2 writes it.
    ///
    /// Of a split recording, all files are opened.
    ///
    /// # Errors
    /// When a file cannot be opened or read, or the format is not supported. A truncated or damaged file is opened.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let paths = list_files(path)?;
        let mut budget = Budget::new(&path.display().to_string(), 0);
        let open = |(path, number): (&PathBuf, _)| RecordingFile::open(number, path, &mut budget);
        let files = paths.iter().zip(0..).map(open).collect::<Result<_, _>>()?;
        let name = if paths.len() == 1 { &paths[0] } else { path };
        Ok(Self::from_files(&name.display().to_string(), files))
    }

    /// Opens `input`, a single file, called `name` in messages.
    ///
    /// # Errors
    /// When it cannot be read, or the format is not supported.
    pub fn new(name: &str, input: impl Read + Seek + Send + 'static) -> Result<Self, RecordingError> {
        Ok(Self::from_files(name, vec![RecordingFile::from_input(name, input)?]))
    }

    fn from_files(name: &str, files: Vec<RecordingFile>) -> Self {
        let channels = files.iter().flat_map(RecordingFile::channels).collect();
        let loss = Loss::of_files(files.iter().map(|file| &file.index));
        Self { name: name.to_owned(), files, channels, loss }
    }

    /// File name, for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Manifest of the run that zsim recorded; `None` for a recording by another program.
    pub fn manifest(&self) -> Option<&str> {
        self.files.iter().find_map(|file| file.index.manifest.as_deref())
    }

    /// Losses known from the index.
    ///
    /// Damaged chunks show only when they are read: each pass counts those that it encounters.
    pub fn loss(&self) -> &Loss {
        &self.loss
    }

    /// Log times of the first message and of the beginning of the last block; `None` without messages.
    pub fn log_span(&self) -> Option<(Stamp, Stamp)> {
        let stamp = |ns: u64| Stamp::from_nanos(i64::try_from(ns).unwrap_or(i64::MAX));
        let first = self.blocks().map(|(_, block)| block.start_ns).min()?;
        let last = self.blocks().map(|(_, block)| block.start_ns).max()?;
        Some((stamp(first), stamp(last)))
    }

    /// Total size of the files, bytes.
    pub(super) fn length_bytes(&self) -> u64 {
        self.files.iter().map(|file| file.store.length()).sum()
    }

    pub(super) fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// Channel numbers of a topic in the recording.
    pub(super) fn ids_of(&self, topic: &str) -> Vec<ChannelId> {
        self.channels.iter().filter(|channel| channel.topic == topic).map(|channel| channel.id).collect()
    }

    /// List of the topics with their types, for messages.
    pub(super) fn topic_list(&self) -> String {
        let mut topics: Vec<_> =
            self.channels.iter().map(|c| format!("{} ({})", shortened(&c.topic), shortened(&c.type_name))).collect();
        topics.sort();
        topics.dedup();
        let others = topics.len().saturating_sub(MAX_LISTED_TOPICS);
        topics.truncate(MAX_LISTED_TOPICS);
        match (topics.is_empty(), others) {
            (true, _) => "no topics".to_owned(),
            (_, 0) => topics.join(", "),
            _ => format!("{} and {others} other topics", topics.join(", ")),
        }
    }

    fn blocks(&self) -> impl Iterator<Item = (&RecordingFile, &Block)> {
        self.files.iter().flat_map(|file| file.index.blocks.iter().map(move |block| (file, block)))
    }

    /// What one pass through the messages may use.
    fn budget(&self) -> Budget {
        Budget::new(&self.name, self.length_bytes())
    }

    /// All messages in order of log time.
    pub(super) fn messages(&self) -> Messages<'_> {
        Messages::new(self.blocks(), self.budget())
    }

    /// Messages of all blocks that may contain messages of `channels`; includes other messages of these blocks.
    pub(super) fn messages_in_blocks_of(&self, channels: &[ChannelId]) -> Messages<'_> {
        Messages::new(self.blocks_of(channels).into_iter(), self.budget())
    }

    fn blocks_of(&self, channels: &[ChannelId]) -> Vec<(&RecordingFile, &Block)> {
        let local_ids = |file: &RecordingFile| file.local_ids(channels);
        let blocks = self.files.iter().map(|file| (file, local_ids(file)));
        let blocks = blocks.flat_map(|(file, ids)| {
            let candidates = file.index.blocks.iter().filter(move |block| block.may_contain(&ids));
            candidates.map(move |block| (file, block))
        });
        blocks.collect()
    }

    /// Calls `take` with a sample of the messages of `channels`.
    ///
    /// The sample is the first `each` messages of `blocks` blocks, evenly spaced over the recording.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub(super) fn sample(
        &self,
        channels: &[ChannelId],
        blocks: usize,
        each: usize,
        mut take: impl FnMut(&RawMessage<'_>),
    ) -> Result<(), RecordingError> {
        let candidates = self.blocks_of(channels);
        let step = candidates.len().div_ceil(blocks).max(1);
        for block in candidates.iter().step_by(step) {
            let (mut messages, mut remaining) = (Messages::new(std::iter::once(*block), self.budget()), each);
            while remaining > 0 {
                let Some(message) = messages.next()? else { break };
                if channels.contains(&message.channel) {
                    take(&message);
                    remaining -= 1;
                }
            }
        }
        Ok(())
    }

    /// Number of messages according to the summaries; `None` if a file has none.
    pub(super) fn expected_messages(&self) -> Option<u64> {
        let counts = self.files.iter().map(|file| file.index.expected_messages);
        counts.reduce(|a, b| Some(a?.saturating_add(b?))).flatten()
    }
}
