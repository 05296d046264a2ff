//! `zsim play`: publish a recording on ROS 2 topics.

use super::bridge::Bridge;
use super::frame::{Frame, Quality, RosTopic, TopicId};
use super::{NetworkArguments, depth_of};
use crate::arguments::Global;
use crate::bars::{WorkBar, stop_flag};
use crate::completion::Completion;
use crate::output;
use crate::usage::Usage;
use anyhow::ensure;
use clap::Args;
use serde_json::json;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};
use zsim_base::parallel::check;
use zsim_base::time::Stamp;
use zsim_recording::{Loss, Reader, RecordedMessage};

/// The topic whose messages a late subscriber needs.
const LATCHED: &str = "/tf_static";
/// Time for subscribers to discover the topics, and without new subscribers with `--wait`.
const DISCOVERY: Duration = Duration::from_secs(1);
/// Maximum time between looks at the stop flag.
const NAP: Duration = Duration::from_millis(100);

/// Publish a recording on ROS 2 topics, at its own pace
///
/// The messages are those of the recording, with their stamps. The topic /tf_static is transient local, so that late
/// subscribers get it; all are reliable. DDS is that of the program zsim-ros2, which must be in the folder of zsim or on
/// the path; it works with every RMW that uses DDS (Cyclone DDS, Fast DDS).
#[derive(Args)]
#[command(after_help = "Examples:\n  zsim play recording.mcap\n  zsim play recording.mcap --topic /scan --topic \
                        /imu/data_raw --rate 2 --wait")]
pub(crate) struct PlayCommand {
    /// The recording: MCAP, or rosbag2 (a folder or a database)
    #[arg(value_name = "RECORDING")]
    recording: PathBuf,
    /// Publish this topic only; may be repeated
    #[arg(long = "topic", value_name = "TOPIC")]
    topics: Vec<String>,
    /// Publish this many times as fast as recorded
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    rate: f64,
    /// Wait until there is a subscriber
    #[arg(long)]
    wait: bool,
    #[command(flatten)]
    network: NetworkArguments,
}

pub(crate) fn run(command: &PlayCommand, global: &Global) -> anyhow::Result<Completion> {
    ensure!(
        command.rate.is_finite() && command.rate > 0.0,
        Usage(format!("--rate {}: a factor above 0 is needed", command.rate))
    );
    let reader = Reader::open(&command.recording)?;
    let topics = selected(&reader, &command.topics)?;
    let mut player = Player {
        bridge: Bridge::start(command.network.domain()?, &command.network.peers())?,
        ids: topics.keys().cloned().zip(0..).collect(),
        rate: command.rate,
        stop: stop_flag(),
        counts: BTreeMap::new(),
        latest: Duration::ZERO,
    };
    let bar = WorkBar::new(global, "playing");
    for (name, type_name) in &topics {
        let topic = RosTopic { name: name.clone(), type_name: type_name.clone() };
        let quality = Quality { reliable: true, transient_local: name == LATCHED, depth: depth_of(type_name) };
        player.bridge.send(&Frame::Advertise(player.ids[name], topic, quality))?;
    }
    player.discover(command.wait, &bar)?;
    let loss = player.play(&reader, &topics, &bar)?;
    let Player { bridge, counts, latest, .. } = player;
    bridge.finish()?;
    drop(bar);
    let done = print(&counts, latest, &loss, global)?;
    Ok(if loss.is_none() { done } else { Completion::WithLoss })
}

/// The topics to publish, with their types.
fn selected(reader: &Reader, wanted: &[String]) -> anyhow::Result<BTreeMap<String, String>> {
    let mut topics = reader.cdr_topics();
    ensure!(
        !topics.is_empty(),
        Usage(format!(
            "{}: no topic has messages of ROS 2; convert a ROS 1 bag with `rosbags-convert --src IN.bag --dst OUT`",
            reader.name()
        ))
    );
    if let Some(missing) = wanted.iter().find(|name| !topics.contains_key(*name)) {
        let has = topics.keys().cloned().collect::<Vec<_>>().join(", ");
        return Err(Usage(format!("{}: no topic {missing}; it has {has}", reader.name())).into());
    }
    topics.retain(|name, _| wanted.is_empty() || wanted.contains(name));
    Ok(topics)
}

/// Publishes the messages.
struct Player {
    bridge: Bridge,
    ids: BTreeMap<String, TopicId>,
    rate: f64,
    stop: &'static AtomicBool,
    /// Number of messages by topic.
    counts: BTreeMap<String, u64>,
    /// Longest time after which a message was published too late.
    latest: Duration,
}

impl Player {
    /// Waits until subscribers had time to discover the topics; with `wait`, until there is one.
    fn discover(&mut self, wait: bool, bar: &WorkBar) -> anyhow::Result<()> {
        bar.set_task(if wait { "waiting for a subscriber" } else { "waiting for discovery" }.to_owned());
        let (mut since, mut is_subscribed) = (Instant::now(), false);
        while (wait && !is_subscribed) || since.elapsed() < DISCOVERY {
            check(self.stop)?;
            if let Some(Frame::Subscribers(_, count)) = self.bridge.receive(NAP)? {
                is_subscribed |= count > 0;
                since = if wait { Instant::now() } else { since };
            }
        }
        bar.set_task(String::new());
        Ok(())
    }

    fn play(&mut self, reader: &Reader, topics: &BTreeMap<String, String>, bar: &WorkBar) -> anyhow::Result<Loss> {
        let span = reader.log_span();
        let length_s = span.map_or(0.0, |(first, last)| last.seconds_since(first));
        let mut outcome = Ok(());
        let mut start: Option<(Instant, Stamp)> = None;
        let loss = reader.play(topics, |message| {
            let (started, first) = *start.get_or_insert((Instant::now(), message.log_time));
            let after_s = message.log_time.seconds_since(first).max(0.0);
            if length_s > 0.0 {
                bar.set_fraction((after_s / length_s).min(1.0));
            }
            outcome = self.publish(&message, started + Duration::from_secs_f64(after_s / self.rate));
            if outcome.is_ok() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        })?;
        outcome.map(|()| loss)
    }

    /// Publishes a message at `due`.
    fn publish(&mut self, message: &RecordedMessage<'_>, due: Instant) -> anyhow::Result<()> {
        loop {
            check(self.stop)?;
            let Some(left) = due.checked_duration_since(Instant::now()).filter(|left| !left.is_zero()) else { break };
            std::thread::sleep(left.min(NAP));
        }
        self.latest = self.latest.max(due.elapsed());
        // What DDS reports has no effect here; it must not pile up.
        while self.bridge.receive(Duration::ZERO)?.is_some() {}
        self.bridge.send(&Frame::Publish(self.ids[message.topic], message.cdr.to_vec()))?;
        *self.counts.entry(message.topic.to_owned()).or_default() += 1;
        Ok(())
    }
}

fn print(counts: &BTreeMap<String, u64>, latest: Duration, loss: &Loss, global: &Global) -> anyhow::Result<Completion> {
    let mut text = String::new();
    for (topic, count) in counts {
        writeln!(text, "{topic:<28} {count:>9} messages")?;
    }
    writeln!(text, "latest after its time        {:>9.1} ms", 1e3 * latest.as_secs_f64())?;
    for sentence in loss.sentences() {
        writeln!(text, "loss: {sentence}")?;
    }
    let json = json!({ "messages": counts, "latest_s": latest.as_secs_f64(), "losses": loss.sentences() });
    output::print_result(global, &text, json, None)
}
