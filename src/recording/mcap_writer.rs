//! Writes messages to an MCAP file: batches them here, compresses and writes them on a separate thread.
//!
//! A batch of messages becomes one chunk, which is passed to the operating system completely before the next begins. A
//! killed process loses the batches in flight and nothing before them. At most [`BATCHES`] batches exist, so memory
//! does not grow with the recording. The bytes written do not depend on thread scheduling.

use crate::RecordingError;
use crate::topics::Topic;
use crate::wire::Encoder;
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use std::collections::BTreeMap;
use std::io::{BufWriter, Error, Write};
use std::ops::Range;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;
use zsim_base::time::Stamp;

/// Bytes of messages per chunk: more compress slightly better, fewer lose less if the process is killed.
pub const CHUNK_BYTES: usize = 1 << 20;

/// Number of batches: one being filled, one being written, one in flight.
const BATCHES: usize = 3;

/// Zstd level: 1, because the low bits of ranges and poses are noise, which no level compresses.
const ZSTD_LEVEL: u32 = 1;

type LibraryWriter<W> = mcap::Writer<NoSeek<BufWriter<W>>>;

/// Messages of the next chunk.
#[derive(Default)]
struct Batch {
    bytes: Vec<u8>,
    messages: Vec<Entry>,
}

struct Entry {
    topic: Topic,
    log_time_ns: u64,
    bytes: Range<usize>,
}

/// Writes messages to an MCAP file, one chunk at a time.
pub struct McapWriter {
    filling: Batch,
    full: Option<SyncSender<Batch>>,
    empty: Receiver<Batch>,
    thread: Option<JoinHandle<Result<(), RecordingError>>>,
}

impl McapWriter {
    /// Starts a recording in `file`, with `metadata` under the name `zsim`.
    ///
    /// # Errors
    /// When the start of the file cannot be written.
    pub fn new<W: Write + Send + 'static>(file: W, metadata: BTreeMap<String, String>) -> Result<Self, RecordingError> {
        let writer = start_file(file, metadata)?;
        let (full, to_write) = sync_channel(BATCHES - 2);
        let (emptied, empty) = sync_channel(BATCHES);
        for _ in 1..BATCHES {
            // The channel has capacity for all of them.
            let _ = emptied.send(Batch::default());
        }
        let thread = std::thread::spawn(move || write_batches(writer, &to_write, &emptied));
        Ok(Self { filling: Batch::default(), full: Some(full), empty, thread: Some(thread) })
    }

    /// Appends a message that `encode` writes.
    ///
    /// # Errors
    /// When `encode` fails, `arrival` is before time zero, or the file cannot be written.
    pub fn message(
        &mut self,
        topic: Topic,
        arrival: Stamp,
        encode: impl FnOnce(&mut Encoder<'_>) -> Result<(), RecordingError>,
    ) -> Result<(), RecordingError> {
        let log_time_ns = u64::try_from(arrival.nanos()).map_err(|_| RecordingError::Unwritable {
            what: "the time of a message",
            value: format!("{} ns", arrival.nanos()),
            limit: "recordings start at 0 ns",
        })?;
        let start = self.filling.bytes.len();
        if let Err(error) = encode(&mut Encoder::new(&mut self.filling.bytes)) {
            self.filling.bytes.truncate(start);
            return Err(error);
        }
        self.filling.messages.push(Entry { topic, log_time_ns, bytes: start..self.filling.bytes.len() });
        if self.filling.bytes.len() >= CHUNK_BYTES { self.send() } else { Ok(()) }
    }

    /// Writes the last chunk, the summary and the index.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.close()
    }

    fn close(&mut self) -> Result<(), RecordingError> {
        if self.full.is_some() && !self.filling.messages.is_empty() {
            self.send()?;
        }
        self.join()
    }

    /// Sends the batch to the thread and takes an empty one.
    fn send(&mut self) -> Result<(), RecordingError> {
        let Ok(next) = self.empty.recv() else { return self.stopped() };
        let batch = std::mem::replace(&mut self.filling, next);
        match self.full.as_ref().map(|full| full.send(batch)) {
            Some(Ok(())) => Ok(()),
            _ => self.stopped(),
        }
    }

    /// Ends the thread and returns the result. A second call has no effect.
    fn join(&mut self) -> Result<(), RecordingError> {
        self.full = None;
        match self.thread.take().map(JoinHandle::join) {
            None => Ok(()),
            Some(Ok(result)) => result,
            Some(Err(_)) => Err(RecordingError::Write(Error::other("the writer's thread panicked"))),
        }
    }

    /// Returns the error that stopped the thread.
    fn stopped(&mut self) -> Result<(), RecordingError> {
        self.join()?;
        Err(RecordingError::Write(Error::other("the writer has stopped")))
    }
}

impl Drop for McapWriter {
    fn drop(&mut self) {
        // A writer dropped without `finish` was abandoned after an error: still make the messages readable, if
        // possible.
        let _ = self.close();
    }
}

fn start_file<W: Write>(file: W, metadata: BTreeMap<String, String>) -> Result<LibraryWriter<W>, RecordingError> {
    let mut writer = mcap::WriteOptions::new()
        .profile("ros2")
        .library(concat!("zsim ", env!("CARGO_PKG_VERSION")))
        .compression(Some(mcap::Compression::Zstd))
        .compression_level(ZSTD_LEVEL)
        .compression_threads(0)
        .chunk_size(None)
        .disable_seeking(true)
        .create(NoSeek::new(BufWriter::new(file)))?;
    writer.write_metadata(&Metadata { name: "zsim".to_owned(), metadata })?;
    Ok(writer)
}

/// Writes all `full` batches, then the summary. Returns each batch to `empty` for reuse.
fn write_batches<W: Write>(
    mut writer: LibraryWriter<W>,
    full: &Receiver<Batch>,
    empty: &SyncSender<Batch>,
) -> Result<(), RecordingError> {
    let mut channels = Channels::default();
    for mut batch in full {
        for entry in &batch.messages {
            let header = channels.header(&mut writer, entry)?;
            writer.write_to_known_channel(&header, &batch.bytes[entry.bytes.clone()])?;
        }
        writer.flush()?;
        batch.bytes.clear();
        batch.messages.clear();
        // The receiver is gone when the recording is being finished.
        let _ = empty.send(batch);
    }
    writer.finish()?;
    Ok(())
}

/// Channels written so far; a topic gets one with the first message.
#[derive(Default)]
struct Channels {
    known: [Option<Channel>; Topic::COUNT],
}

#[derive(Clone, Copy)]
struct Channel {
    id: u16,
    messages: u32,
}

impl Channels {
    fn header<W: Write>(
        &mut self,
        writer: &mut LibraryWriter<W>,
        entry: &Entry,
    ) -> Result<MessageHeader, RecordingError> {
        let slot = &mut self.known[entry.topic as usize];
        let channel = match slot {
            Some(channel) => channel,
            None => slot.insert(Channel { id: add_channel(writer, entry.topic)?, messages: 0 }),
        };
        let sequence = channel.messages;
        channel.messages = sequence.wrapping_add(1);
        let log_time = entry.log_time_ns;
        Ok(MessageHeader { channel_id: channel.id, sequence, log_time, publish_time: log_time })
    }
}

fn add_channel<W: Write>(writer: &mut LibraryWriter<W>, topic: Topic) -> Result<u16, RecordingError> {
    let kind = topic.message_type();
    let schema = writer.add_schema(kind.name(), "ros2msg", kind.definition().as_bytes())?;
    let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), topic.qos())]);
    Ok(writer.add_channel(schema, topic.name(), "cdr", &metadata)?)
}
