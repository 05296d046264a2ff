//! Writes messages of any topic, as they were received, to an MCAP file.

use crate::RecordingError;
use crate::mcap_writer::CHUNK_BYTES;
use crate::schema::MessageType;
use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use std::collections::BTreeMap;
use std::io::{BufWriter, Write};
use zsim_base::time::Stamp;

/// Zstd level, as of simulated recordings.
const ZSTD_LEVEL: u32 = 1;

/// Writes CDR messages of any topics to an MCAP file in the ROS 2 profile.
///
/// A killed process loses the current chunk of about 1 MiB and nothing before it.
pub struct ReceivedWriter<W: Write> {
    writer: mcap::Writer<NoSeek<BufWriter<W>>>,
    /// Number of each channel, and of its messages, by topic.
    channels: BTreeMap<String, (u16, u32)>,
    /// Bytes since the last flush.
    waiting: usize,
}

impl<W: Write> ReceivedWriter<W> {
    /// Starts a recording in `file`.
    ///
    /// # Errors
    /// When the start of the file cannot be written.
    pub fn new(file: W) -> Result<Self, RecordingError> {
        let writer = mcap::WriteOptions::new()
            .profile("ros2")
            .library(concat!("zsim ", env!("CARGO_PKG_VERSION")))
            .compression(Some(mcap::Compression::Zstd))
            .compression_level(ZSTD_LEVEL)
            .compression_threads(0)
            .chunk_size(None)
            .disable_seeking(true)
            .create(NoSeek::new(BufWriter::new(file)))?;
        Ok(Self { writer, channels: BTreeMap::new(), waiting: 0 })
    }

    /// Appends a message of `topic`, which arrived at `arrival`; a topic gets its channel with the first message.
    ///
    /// # Errors
    /// When the file cannot be written, or the time is before 1970.
    pub fn message(
        &mut self,
        topic: &str,
        type_name: &str,
        arrival: Stamp,
        message: &[u8],
    ) -> Result<(), RecordingError> {
        let log_time = u64::try_from(arrival.nanos()).map_err(|_| RecordingError::Unwritable {
            what: "the time of a message",
            value: format!("{} ns", arrival.nanos()),
            limit: "recordings start at 0 ns",
        })?;
        let (channel_id, sequence) = match self.channels.get(topic) {
            Some(channel) => *channel,
            None => (self.add_channel(topic, type_name)?, 0),
        };
        self.channels.insert(topic.to_owned(), (channel_id, sequence.wrapping_add(1)));
        let header = MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
        self.writer.write_to_known_channel(&header, message)?;
        self.waiting += message.len();
        if self.waiting >= CHUNK_BYTES {
            self.waiting = 0;
            self.writer.flush()?;
        }
        Ok(())
    }

    fn add_channel(&mut self, topic: &str, type_name: &str) -> Result<u16, RecordingError> {
        // A type that zsim does not know has no definition here; programs with that type know it by its name.
        let definition = MessageType::named(type_name).map(MessageType::definition).unwrap_or_default();
        let schema = self.writer.add_schema(type_name, "ros2msg", definition.as_bytes())?;
        Ok(self.writer.add_channel(schema, topic, "cdr", &BTreeMap::new())?)
    }

    /// Writes the last chunk, the summary and the index.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.writer.finish()?;
        Ok(())
    }
}
