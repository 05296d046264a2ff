//! `zsim info`: the contents of a recording.

use super::arguments::Global;
use super::outlook::Outlook;
use super::{Completion, message, output, quantity};
use clap::Args;
use std::path::PathBuf;
use zsim_base::printable::printable_name;
use zsim_base::time::Span;
use zsim_recording::{ClockStep, Reader, RecordingInfo, TopicInfo};

/// Summarise a recording: topics, rates, gaps, clocks, losses, and what `zsim estimate` would do with it
#[derive(Args)]
#[command(after_help = "Example:\n  zsim info recording.mcap")]
pub(super) struct Arguments {
    /// The recording: MCAP, a ROS 1 bag, a rosbag2 database, or a folder of rosbag2
    #[arg(value_name = "RECORDING")]
    recording: PathBuf,
    /// Minimum gap between messages of a topic that is reported
    #[arg(long, value_name = "TIME", default_value = "0.5s", value_parser = quantity::seconds, allow_hyphen_values = true)]
    gap: f64,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let reader = Reader::open(&arguments.recording)?;
    let info = reader.info(Span::from_seconds(arguments.gap))?;
    let outlook = Outlook::new(&reader, &info)?;
    let mut json = serde_json::to_value(&info)?;
    if let Some(object) = json.as_object_mut() {
        object.insert("estimate".to_owned(), serde_json::to_value(&outlook)?);
    }
    output::print_result(global, &format!("{}\n{}", text(&info), outlook.text()), json, None)?;
    let steps = ClockStep::sentence(&info.loss.clock_steps);
    info.loss.notes().iter().chain(&steps).for_each(|note| message::note(note));
    if info.loss.is_none() {
        return Ok(Completion::Done);
    }
    info.loss.sentences().iter().for_each(|loss| message::loss(loss));
    Ok(Completion::WithLoss)
}

fn text(info: &RecordingInfo) -> String {
    let mebibytes = info.length_bytes as f64 / (1 << 20) as f64;
    let maker = if info.has_manifest { ", made by zsim" } else { "" };
    let head =
        format!("{}: {:.3} s, {} messages, {mebibytes:.1} MiB{maker}", info.name, info.duration_s, info.messages);
    let topics = zsim_report::table(
        &["topic", "type", "count", "Hz", "max s", "gaps", "lost", "late"],
        &info.topics.iter().map(topic_row).collect::<Vec<_>>(),
        true,
    );
    let clocks: Vec<_> = info.topics.iter().filter_map(clock_row).collect();
    let clocks = zsim_report::table(
        &["stamps against log time", "offset ms", "drift ppm", "jitter ms", "pattern"],
        &clocks,
        true,
    );
    format!("{}\n{topics}\n{clocks}", zsim_report::wrapped(&head, "  "))
}

fn topic_row(topic: &TopicInfo) -> Vec<String> {
    let number = |figure: Option<f64>, decimals: usize| figure.map_or("-".to_owned(), |x| format!("{x:.decimals$}"));
    let short = topic.type_name.rsplit('/').next().unwrap_or_default();
    vec![
        printable_name(&topic.topic),
        printable_name(short),
        topic.messages.to_string(),
        number(topic.rate_hz, 1),
        number(topic.longest_gap_s, 3),
        topic.gaps.to_string(),
        topic.missing.to_string(),
        topic.out_of_order.to_string(),
    ]
}

fn clock_row(topic: &TopicInfo) -> Option<Vec<String>> {
    let clock = topic.clock?;
    Some(vec![
        printable_name(&topic.topic),
        format!("{:.3}", clock.offset_s * 1e3),
        format!("{:.2}", clock.drift_ppm),
        format!("{:.3}", clock.jitter_s * 1e3),
        topic.pattern.unwrap_or("-").to_owned(),
    ])
}
