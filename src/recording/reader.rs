//! A recording, opened for reading: by zsim or by anybody.

use crate::recording::container::{BlockKind, Channel, Directory, Ending, Loaded, Messages, Source, walk};
use crate::recording::{Loss, RecordingError};
use std::io::{Read, Seek};
use std::path::Path;

/// An MCAP recording. Opening it finds what is where; messages are read as they are asked for, a chunk or two in memory
/// at a time, from files that are cut short or damaged as from whole ones.
pub struct Reader {
    name: String,
    source: Source,
    directory: Directory,
    channels: Vec<Channel>,
    loss: Loss,
}

impl Reader {
    /// Opens the file at `path`.
    ///
    /// # Errors
    /// When it cannot be opened or read, or is no MCAP file. A file that is cut short or damaged is opened.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let file =
            std::fs::File::open(path).map_err(|source| RecordingError::File { path: path.to_owned(), source })?;
        Self::new(&path.display().to_string(), file)
    }

    /// Opens `input`, which messages call `name`.
    ///
    /// # Errors
    /// When it cannot be read, or is no MCAP file.
    pub fn new(name: &str, input: impl Read + Seek + Send + 'static) -> Result<Self, RecordingError> {
        let source = Source::new(input)?;
        let mut directory = walk(&source, name)?;
        if directory.ending != Ending::Complete || directory.channels.is_empty() {
            find_definitions(&source, &mut directory)?;
        }
        let channels = directory.channels().collect();
        let loss = Loss::of_file(&directory);
        Ok(Self { name: name.to_owned(), source, directory, channels, loss })
    }

    /// The file's name, for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The manifest of the run that zsim recorded; `None` in a recording by others.
    pub fn manifest(&self) -> Option<&str> {
        Some(self.directory.metadata.get("zsim")?.get("manifest")?.as_str())
    }

    /// What the file as a whole lost. Damaged chunks show only when they are read: each pass counts those it meets.
    pub fn loss(&self) -> &Loss {
        &self.loss
    }

    /// Bytes in the file.
    pub(super) fn length_bytes(&self) -> u64 {
        self.source.length()
    }

    pub(super) fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// The numbers under which a topic's messages are in the file.
    pub(super) fn ids_of(&self, topic: &str) -> Vec<u16> {
        self.channels.iter().filter(|channel| channel.topic == topic).map(|channel| channel.id).collect()
    }

    /// The topics with their types, for messages.
    pub(super) fn what_it_has(&self) -> String {
        let mut topics: Vec<_> = self.channels.iter().map(|c| format!("{} ({})", c.topic, c.type_name)).collect();
        topics.sort();
        topics.dedup();
        if topics.is_empty() { "no topics at all".to_owned() } else { topics.join(", ") }
    }

    /// All messages in the order of their log time.
    pub(super) fn messages(&self) -> Messages<'_> {
        Messages::new(&self.source, self.directory.blocks.iter())
    }

    /// The messages of blocks that seem to hold some of `channels`, among others of those blocks.
    pub(super) fn messages_near(&self, channels: &[u16]) -> Messages<'_> {
        Messages::new(&self.source, self.directory.blocks.iter().filter(|block| block.seems_to_hold(channels)))
    }

    /// How many messages the summary counts.
    pub(super) fn expected_messages(&self) -> Option<u64> {
        self.directory.expected_messages
    }
}

/// Reads the definitions that stand in chunks, where no summary repeats them.
fn find_definitions(source: &Source, directory: &mut Directory) -> Result<(), RecordingError> {
    let mut loaded = Loaded::default();
    for k in 0..directory.blocks.len() {
        let block = &directory.blocks[k];
        if matches!(block.kind, BlockKind::Chunk(_)) && loaded.load(source, block)?.is_ok() {
            for (opcode, fields) in &loaded.definitions {
                directory.define(*opcode, &loaded.bytes[fields.clone()]);
            }
        }
    }
    Ok(())
}
