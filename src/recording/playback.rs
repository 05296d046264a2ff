//! The messages of a recording as they were written, for whoever publishes them again.

use crate::container::ChannelId;
use crate::wire::WireFormat;
use crate::{Loss, Reader, RecordingError};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use zsim_base::time::Stamp;

/// Serialisation of the messages of ROS 2.
const CDR: &str = "cdr";

/// A message of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordedMessage<'a> {
    /// Topic name.
    pub topic: &'a str,
    /// Log time.
    pub log_time: Stamp,
    /// The message in CDR, with its encapsulation header.
    pub cdr: &'a [u8],
}

impl Reader {
    /// The topics whose messages are in CDR, the serialisation of ROS 2, each with its type.
    pub fn cdr_topics(&self) -> BTreeMap<String, String> {
        let is_cdr = |channel: &&super::container::Channel| {
            channel.encoding == CDR && channel.wire == Some(WireFormat::Cdr) && !channel.type_name.is_empty()
        };
        self.channels().iter().filter(is_cdr).map(|c| (c.topic.clone(), c.type_name.clone())).collect()
    }

    /// Calls `take` with the messages of the given topics in order of log time, until it breaks. Returns what could not be
    /// read.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn play(
        &self,
        topics: &BTreeMap<String, String>,
        mut take: impl FnMut(RecordedMessage<'_>) -> ControlFlow<()>,
    ) -> Result<Loss, RecordingError> {
        let channels = self.channels().iter().filter(|channel| topics.contains_key(&channel.topic));
        let names: BTreeMap<ChannelId, &str> = channels.map(|channel| (channel.id, channel.topic.as_str())).collect();
        let mut messages = self.messages();
        let mut loss = self.loss().clone();
        while let Some(message) = messages.next()? {
            let Some(topic) = names.get(&message.channel) else { continue };
            let log_time = Stamp::from_nanos(i64::try_from(message.log_time_ns).unwrap_or(i64::MAX));
            if take(RecordedMessage { topic, log_time, cdr: message.data.bytes }).is_break() {
                return Ok(loss);
            }
        }
        loss.add_pass(&messages, self.expected_messages());
        Ok(loss)
    }
}
