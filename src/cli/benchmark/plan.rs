//! `zsim benchmark plan`: simulates the recordings of a suite.

use super::suite::{Item, SUITE, Suite};
use crate::arguments::Global;
use crate::bars::{WorkBar, stop_flag};
use crate::usage::Usage;
use crate::{Completion, output, sweep};
use anyhow::Context;
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use zsim_base::files;
use zsim_base::files::replace_text;
use zsim_run::ProgressMonitor;
use zsim_study::sweep::{Plan, SuiteRecording};

/// Simulate the recordings of a suite, with the truth apart
///
/// DIR/suite.json lists the recordings with their settings; DIR/recordings/NAME.mcap has the measurements, DIR/truth/NAME.tum
/// the true trajectory of the frame `head` in lidar time. A suite is a study of journeys: its grid of scenes, motions,
/// faults, sensors and seeds. A second start continues.
#[derive(Args)]
#[command(after_help = "Examples:\n  zsim benchmark plan -o suite\n  zsim benchmark plan my_suite.ron -o suite")]
pub(super) struct Arguments {
    /// The suite, a name under specs/studies/ or a file
    #[arg(value_name = "SUITE", default_value = "benchmark")]
    suite: String,
    /// Folder for the recordings; an interrupted suite in it is continued [default: results/<name>]
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace another suite in the folder; recordings that are in both stay
    #[arg(long)]
    force: bool,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let plan = sweep::plan_of(&arguments.suite)?;
    let recordings = plan.suite()?;
    let suite = Suite::of(&plan, &recordings)?;
    let wanted = arguments.out.clone().unwrap_or_else(|| Path::new("results").join(plan.name()));
    let folder = output::folder_to_resume(&wanted)?;
    let earlier = Suite::read(&folder)?;
    if earlier.as_ref().is_some_and(|earlier| *earlier != suite) && !arguments.force {
        let message = format!("{} has another suite: name another folder with --out, or --force", folder.display());
        return Err(Usage(message).into());
    }
    if earlier.is_none() && !arguments.force && std::fs::read_dir(&folder)?.next().is_some() {
        let message = format!("{} has other files: name another folder with --out, or --force", folder.display());
        return Err(Usage(message).into());
    }
    for name in ["recordings", "truth"] {
        files::subfolder(&folder, name)?;
    }
    remove_others(&folder, &suite, earlier.as_ref())?;
    replace_text(&folder.join(SUITE), &(serde_json::to_string_pretty(&suite)? + "\n"))?;
    let bar = WorkBar::new(global, "recording");
    let count = recordings.len();
    for (index, (recording, item)) in recordings.iter().zip(&suite.recordings).enumerate() {
        let (file, truth) = (files::inside(&folder, &item.recording)?, files::inside(&folder, &item.truth)?);
        bar.set_task(format!("{} of {count}", index + 1));
        bar.set_fraction(index as f64 / count as f64);
        if !(file.is_file() && truth.is_file()) {
            record(&plan, recording, &file, &truth)?;
        }
    }
    drop(bar);
    let words = format!("{count} recordings; then: zsim benchmark score {} --system NAME=FOLDER", folder.display());
    output::print_result(global, &words, json!({ "recordings": count }), Some(&folder))
}

/// Removes the recordings of the suite that are of another one, before the list names them as its own.
fn remove_others(folder: &Path, suite: &Suite, earlier: Option<&Suite>) -> anyhow::Result<()> {
    let is_kept = |item: &&Item| earlier.is_some_and(|earlier| earlier.recordings.contains(item));
    let mine = suite.recordings.iter().filter(|item| !is_kept(item));
    let theirs =
        earlier.into_iter().flat_map(|earlier| &earlier.recordings).filter(|item| !suite.recordings.contains(item));
    for name in mine.chain(theirs).flat_map(|item| [&item.recording, &item.truth]) {
        let path = files::inside(folder, name)?;
        match std::fs::remove_file(&path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(error).with_context(|| format!("{} cannot be removed", path.display()));
            }
            _ => {}
        }
    }
    Ok(())
}

/// Simulates a recording; its files get their names when both are complete.
fn record(plan: &Plan, recording: &SuiteRecording, file: &Path, truth: &Path) -> anyhow::Result<()> {
    let part = |path: &Path| path.with_extension("part");
    let mut watch = ProgressMonitor { stop: stop_flag(), report: &mut |_| {} };
    plan.record(recording, &part(file), &part(truth), &mut watch)?;
    for path in [truth, file] {
        std::fs::rename(part(path), path).with_context(|| format!("{} cannot be written", path.display()))?;
    }
    Ok(())
}
