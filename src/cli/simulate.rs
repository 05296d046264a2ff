//! `zsim simulate`: a recording.

use super::Completion;
use super::arguments::{Global, ScenarioArguments};
use super::bars::{Bars, stop_flag};
use super::recording_files::{Companion, RecordingFiles};
use super::{output, recording_size};
use anyhow::Context;
use clap::Args;
use serde_json::json;
use std::io::Write;
use std::path::{Path, PathBuf};
use zsim_base::files;
use zsim_recording::write_rosbag2_metadata;
use zsim_run::{ProgressMonitor, ViewerFiles};
use zsim_simulation::{Outputs, Simulation, SimulationSummary};

/// Simulate and record: an MCAP file with the truth inside, and next to it the true trajectory and files for viewers
#[derive(Args)]
#[command(
    after_help = "Examples:\n  zsim simulate --scene office --duration 2min --out office.mcap\n  zsim simulate --scene \
                        office --rosbag2 office\n  zsim simulate --scene open_field --head rigid --motion stand --imu-only \
                        --duration 6h"
)]
pub(super) struct Arguments {
    /// The world, a name under scenes/ or a file
    #[arg(long, value_name = "NAME|FILE")]
    scene: String,
    #[command(flatten)]
    scenario: ScenarioArguments,
    /// The recording; next to it: .tum, the true trajectory; .foxglove.json, a layout of Foxglove; .urdf, the head on its spring
    /// [default: <scene>.mcap]
    #[arg(long, short, value_name = "FILE.mcap")]
    out: Option<PathBuf>,
    /// Write the recording into this new folder as rosbag2 does, with metadata.yaml, for `ros2 bag play DIR`
    #[arg(long, value_name = "DIR", conflicts_with_all = ["out", "force"])]
    rosbag2: Option<PathBuf>,
    /// Replace the recording and the files of its name next to it, once the new ones are complete
    #[arg(long)]
    force: bool,
    /// Show the true head in /tf, for looking; an estimate of one's own would contradict it
    #[arg(long)]
    truth_tf: bool,
    /// Record the IMU only, without lidar and truth, many times as fast: long records for Allan deviations
    #[arg(long, conflicts_with = "truth_tf")]
    imu_only: bool,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let simulation = Simulation::prepare(&arguments.scenario.scenario(&arguments.scene))?;
    let default = || PathBuf::from(format!("{}.mcap", simulation.world().name()));
    let mut inputs = arguments.scenario.inputs(&arguments.scene);
    inputs.extend(simulation.world().mesh_files().iter().cloned());
    let folder = arguments.rosbag2.as_ref().map(|folder| output::folder(folder, false)).transpose()?;
    let wanted = match &folder {
        Some(folder) => folder.join(rosbag2_file(folder)),
        None => arguments.out.clone().unwrap_or_else(default),
    };
    let mut bars = Bars::new(global);
    let outputs = if arguments.imu_only { Outputs::Imus } else { Outputs::All };
    recording_size::check(&simulation, outputs, &wanted, |note| bars.note(note))?;
    let viewers = (!arguments.imu_only).then(|| ViewerFiles::of(&simulation));
    let files = RecordingFiles::reserve(&wanted, &companions(viewers.as_ref()), arguments.force, &inputs)?;

    simulation.world().notes().iter().for_each(|note| bars.note(note));
    let mut watch = ProgressMonitor { stop: stop_flag(), report: &mut |event| bars.update(event) };
    let recorded = match files.companion(Companion::Truth) {
        Some(truth) => zsim_run::record(&simulation, files.recording(), &truth, arguments.truth_tf, &mut watch),
        None => zsim_run::record_imus(&simulation, files.recording(), &mut watch),
    };
    bars.finish();
    let summary = recorded.inspect_err(|_| super::full_run::print_partial_results(files.recording()))?;
    if let Some(viewers) = &viewers {
        write_for_viewers(viewers, &files)?;
    }
    let (recording, truth) = files.finish()?;
    if folder.is_some() {
        write_rosbag2_metadata(&recording)?;
    }
    let mut figures = serde_json::to_value(summary)?;
    if let Some(object) = figures.as_object_mut() {
        object.insert("scene".to_owned(), json!(simulation.world().name()));
        object.insert("seed".to_owned(), json!(simulation.inputs().seed));
        object.insert("truth".to_owned(), json!(truth.map(|truth| truth.display().to_string())));
    }
    output::print_result(global, &text(&summary, outputs), figures, Some(folder.as_deref().unwrap_or(&recording)))
}

/// The files next to a recording; one of the IMU alone has none.
fn companions(viewers: Option<&ViewerFiles>) -> Vec<Companion> {
    let Some(viewers) = viewers else { return Vec::new() };
    let head_model = viewers.head_model.as_ref().map(|_| Companion::HeadModel);
    [Companion::Truth, Companion::Layout].into_iter().chain(head_model).collect()
}

/// Writes the layout and the model of the head.
fn write_for_viewers(viewers: &ViewerFiles, files: &RecordingFiles) -> anyhow::Result<()> {
    let contents = [(Companion::Layout, Some(viewers.layout)), (Companion::HeadModel, viewers.head_model.as_deref())];
    for (path, text) in contents.into_iter().filter_map(|(of, text)| files.companion(of).zip(text)) {
        let written = files::create(&path).and_then(|mut file| file.write_all(text.as_bytes()));
        written.with_context(|| format!("{} cannot be written", path.display()))?;
    }
    Ok(())
}

/// Name of the file in a folder of rosbag2: that of the folder, with the number 0.
fn rosbag2_file(folder: &Path) -> String {
    format!("{}_0.mcap", folder.file_name().unwrap_or_default().to_string_lossy())
}

fn text(summary: &SimulationSummary, outputs: Outputs) -> String {
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let mut rows = vec![
        row("duration", format!("{} s", summary.duration_s)),
        row("wall time", format!("{:.2} s ({:.0} x real time)", summary.wall_s, summary.duration_s / summary.wall_s)),
    ];
    if outputs == Outputs::All {
        rows.push(row("scans", summary.scans.to_string()));
        rows.push(row("beams", summary.beams.to_string()));
        rows.push(row("returns", summary.returns.to_string()));
    }
    rows.push(row("IMU samples", format!("{} ({} saturated)", summary.imu_samples, summary.imu_samples_at_limit)));
    rows.extend(summary.coil_contact.map(|contact| {
        row("coil contact", format!("first at {:.2} s, {:.2} s in total", contact.first_t_s, contact.contact_s))
    }));
    zsim_report::table(&[], &rows, true)
}
