//! The DDS participant: writers and readers of topics.

use crate::frame::{Frame, Quality, RosTopic, TopicId};
use crate::names;
use crate::peers::Relay;
use crate::raw::{Message, Raw};
use futures::channel::mpsc;
use futures::future::ready;
use futures::stream::{AbortHandle, Fuse, SelectAll, StreamExt, abortable, select};
use rustdds::no_key::{DataReader, DataWriter};
use rustdds::policy::{Durability, History, Reliability};
use rustdds::{
    DomainParticipant, DomainParticipantStatusEvent, Duration, GUID, Publisher, QosPolicies, QosPolicyBuilder,
    RTPSEntity, StatusEvented, Subscriber, Topic, TopicKind,
};
use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::io::Write;
use std::pin::Pin;
use std::time::{SystemTime, UNIX_EPOCH};

/// Maximum time that a writer waits for slow readers.
const MAX_BLOCKING: Duration = Duration::from_millis(100);
/// Maximum time that each subscriber gets at the end to acknowledge the last messages.
const FAREWELL: std::time::Duration = std::time::Duration::from_secs(1);

type Outcome<T> = Result<T, Box<dyn Error>>;
type Messages = Pin<Box<dyn futures::Stream<Item = Event>>>;

/// What happens while the node runs.
enum Event {
    Command(Frame),
    Received(TopicId, Message),
    Status(Box<DomainParticipantStatusEvent>),
    End,
}

/// A topic that is published.
struct Output {
    writer: DataWriter<Message, Raw>,
    /// The readers of other programs.
    subscribers: BTreeSet<GUID>,
}

/// A participant in a DDS domain with its topics.
pub struct Node {
    participant: DomainParticipant,
    publisher: Publisher,
    subscriber: Subscriber,
    writers: BTreeMap<TopicId, Output>,
    readers: BTreeMap<TopicId, AbortHandle>,
}

impl Node {
    /// Joins `domain`, and announces itself to the `peers`, also where multicast does not reach them.
    pub fn new(domain: u16, peers: &[String]) -> Outcome<Self> {
        // Before the participant, whose first announcement comes at once.
        let relay = if peers.is_empty() { None } else { Some(Relay::new(domain, peers)?) };
        let participant = DomainParticipant::new(domain)?;
        if let Some(relay) = relay {
            relay.run(participant.guid().prefix.as_ref().to_vec())?;
        }
        let qos = QosPolicies::qos_none();
        let (publisher, subscriber) = (participant.create_publisher(&qos)?, participant.create_subscriber(&qos)?);
        Ok(Self { participant, publisher, subscriber, writers: BTreeMap::new(), readers: BTreeMap::new() })
    }

    /// Carries out the `commands` until they end, and writes what arrives to `out`.
    pub async fn run(mut self, commands: Fuse<mpsc::Receiver<Frame>>, out: &mut impl Write) -> Outcome<()> {
        let listener = self.participant.clone().status_listener();
        let statuses = listener.as_async_status_stream().map(|status| Event::Status(Box::new(status)));
        let commands = commands.map(Event::Command).chain(futures::stream::once(ready(Event::End)));
        let mut others = select(commands, statuses);
        let mut messages: SelectAll<Messages> = SelectAll::new();
        // An empty set of streams ends at once; this one keeps it open.
        messages.push(Box::pin(futures::stream::pending()));
        loop {
            match select(&mut others, &mut messages).next().await {
                Some(Event::Command(frame)) => messages.extend(self.carry_out(frame)?),
                Some(Event::Received(id, message)) => Frame::Received(id, now_ns(), message.0).write(out)?,
                Some(Event::Status(status)) => self.report(&status, out)?,
                Some(Event::End) | None => return self.finish(),
            }
        }
    }

    /// Carries out a command; returns the messages of a new subscription.
    fn carry_out(&mut self, frame: Frame) -> Outcome<Option<Messages>> {
        match frame {
            Frame::Advertise(id, topic, quality) => {
                let (topic, qos) = self.topic(&topic, quality)?;
                let writer = self.publisher.create_datawriter_no_key(&topic, Some(qos))?;
                self.writers.insert(id, Output { writer, subscribers: BTreeSet::new() });
            }
            Frame::Publish(id, message) => {
                if let Some(output) = self.writers.get(&id) {
                    output.writer.write(Message(message), None).map_err(|error| error.to_string())?;
                }
            }
            Frame::Subscribe(id, topic, quality) => {
                self.unsubscribe(id);
                let (topic, qos) = self.topic(&topic, quality)?;
                let reader: DataReader<Message, Raw> = self.subscriber.create_datareader_no_key(&topic, Some(qos))?;
                // A message that cannot be read is one of another encoding or a broken one: it is not a measurement.
                let samples = reader.async_sample_stream().filter_map(|sample| ready(sample.ok()));
                let events = samples.map(move |sample| Event::Received(id, sample.into_value()));
                let (events, handle) = abortable(events);
                self.readers.insert(id, handle);
                return Ok(Some(Box::pin(events)));
            }
            Frame::Unsubscribe(id) => self.unsubscribe(id),
            Frame::Discovered(..) | Frame::Received(..) | Frame::Subscribers(..) => {}
        }
        Ok(None)
    }

    fn unsubscribe(&mut self, id: TopicId) {
        self.readers.remove(&id).into_iter().for_each(|handle| handle.abort());
    }

    fn topic(&self, topic: &RosTopic, quality: Quality) -> Outcome<(Topic, QosPolicies)> {
        let reliability = match quality.reliable {
            true => Reliability::Reliable { max_blocking_time: MAX_BLOCKING },
            false => Reliability::BestEffort,
        };
        let durability = if quality.transient_local { Durability::TransientLocal } else { Durability::Volatile };
        let depth = i32::try_from(quality.depth)?.max(1);
        let qos = QosPolicyBuilder::new().reliability(reliability).durability(durability);
        let qos = qos.history(History::KeepLast { depth }).build();
        let (name, type_name) = names::to_dds(topic);
        Ok((self.participant.create_topic(name, type_name, &qos, TopicKind::NoKey)?, qos))
    }

    /// Reports publishers that were discovered, and changes of the number of subscribers.
    fn report(&mut self, status: &DomainParticipantStatusEvent, out: &mut impl Write) -> Outcome<()> {
        match status {
            DomainParticipantStatusEvent::WriterDetected { writer } => {
                let Some(topic) = names::from_dds(&writer.topic_name, &writer.type_name) else { return Ok(()) };
                let reliable = matches!(writer.qos.reliability(), Some(Reliability::Reliable { .. }));
                let transient_local = !matches!(writer.qos.durability(), None | Some(Durability::Volatile));
                Frame::Discovered(topic, Quality { reliable, transient_local, depth: 0 }).write(out)?;
            }
            DomainParticipantStatusEvent::RemoteReaderMatched { local_writer, remote_reader } => {
                let matched = self.writers.iter_mut().find(|(_, output)| output.writer.guid() == *local_writer);
                if let Some((id, output)) = matched
                    && output.subscribers.insert(*remote_reader)
                {
                    Frame::Subscribers(*id, u32::try_from(output.subscribers.len())?).write(out)?;
                }
            }
            DomainParticipantStatusEvent::ReaderLost { guid, .. } => {
                for (id, output) in &mut self.writers {
                    if output.subscribers.remove(guid) {
                        Frame::Subscribers(*id, u32::try_from(output.subscribers.len())?).write(out)?;
                    }
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Waits until the subscribers have everything, but not for long.
    fn finish(self) -> Outcome<()> {
        for output in self.writers.values() {
            // A subscriber that does not answer has left.
            let _ = output.writer.wait_for_acknowledgments(FAREWELL);
        }
        Ok(())
    }
}

/// The time of arrival: it becomes the log time of the message.
#[expect(clippy::disallowed_methods, reason = "messages that arrive from other programs have a time of arrival")]
fn now_ns() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
}
