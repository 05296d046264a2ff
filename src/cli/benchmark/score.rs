//! `zsim benchmark score`: the errors of systems on the recordings of a suite.

use super::scores::{Score, System, document, figures, runs_csv};
use super::suite::Suite;
use crate::arguments::Global;
use crate::trajectory_file::{self, Truth, TruthTimes};
use crate::usage::Usage;
use crate::{Completion, message, output};
use anyhow::Context;
use clap::Args;
use std::path::{Path, PathBuf};
use zsim_base::files::replace_text;
use zsim_base::printable::{printable, printable_name};
use zsim_evaluation::TrajectoryErrors;

/// Compare the trajectories of one or more systems with the truth of a suite
///
/// A system's folder has a TUM file NAME.tum for each recording NAME.mcap: poses of the frame `head`, stamped by the clock of
/// the lidar. Each is aligned with the truth, as by `zsim compare`. A recording without a trajectory counts as failed, as does
/// one of which less than --min-coverage is estimated. The table has the medians over all recordings; a failed one counts as
/// an infinite error. DIR/scores.csv has a row per recording and system, DIR/scores.json all figures, DIR/scores.html the page.
#[derive(Args)]
#[command(after_help = "Example:\n  zsim benchmark score suite --system ours=estimates --system kiss=kiss_icp")]
pub(super) struct Arguments {
    /// Folder of the suite, made by `zsim benchmark plan`
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// A system: its name, and the folder with its trajectories; can be repeated
    #[arg(long, value_name = "NAME=FOLDER", required = true, value_parser = system)]
    system: Vec<(String, PathBuf)>,
    /// Least fraction of the truth's time that a trajectory covers (95% or 0.95)
    #[arg(long, value_name = "FRACTION", default_value = "90%", value_parser = crate::limit::fraction)]
    min_coverage: f64,
}

fn system(text: &str) -> Result<(String, PathBuf), String> {
    match text.split_once('=') {
        Some((name, folder)) if !name.is_empty() && !folder.is_empty() => Ok((name.to_owned(), folder.into())),
        _ => Err("expected NAME=FOLDER".to_owned()),
    }
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let Some(suite) = Suite::read(&arguments.folder)? else {
        let message = format!("{} has no suite: zsim benchmark plan makes one", arguments.folder.display());
        return Err(Usage(message).into());
    };
    let mut systems: Vec<System> = Vec::new();
    for (name, folder) in &arguments.system {
        if !folder.is_dir() {
            return Err(Usage(format!("--system {name}: {} is not a folder", folder.display())).into());
        }
        if systems.iter().any(|other| other.name == *name) {
            return Err(Usage(format!("--system {name} is given twice")).into());
        }
        systems.push(System { name: name.clone(), scores: Vec::new() });
    }
    for item in &suite.recordings {
        let truth = Truth::read(&arguments.folder.join(&item.truth), &TruthTimes::default())?;
        for (system, (_, folder)) in systems.iter_mut().zip(&arguments.system) {
            let path = folder.join(format!("{}.tum", item.name));
            system.scores.push(score(&path, &truth, arguments.min_coverage));
        }
    }
    let folder = &arguments.folder;
    replace_text(&folder.join("scores.csv"), &runs_csv(&suite, &systems))?;
    let figures = figures(&suite, &systems, arguments.min_coverage);
    replace_text(&folder.join("scores.json"), &(serde_json::to_string_pretty(&figures)? + "\n"))?;
    let document = document(&suite, &systems, arguments.min_coverage);
    replace_text(&folder.join("scores.html"), &document.html())?;
    output::print_result(global, &document.text(), figures, Some(&folder.join("scores.html")))?;
    for (name, folder) in &arguments.system {
        note_unused(name, folder, &suite)?;
    }
    Ok(Completion::Done)
}

/// Notes the trajectories of a system that have the name of no recording.
fn note_unused(system: &str, folder: &Path, suite: &Suite) -> anyhow::Result<()> {
    let entries = std::fs::read_dir(folder).with_context(|| format!("cannot list {}", folder.display()))?;
    let names = entries.flatten().map(|entry| PathBuf::from(entry.file_name()));
    let of_recording = |name: &Path| suite.recordings.iter().any(|item| Some(item.name.as_ref()) == name.file_stem());
    let mut unused: Vec<PathBuf> =
        names.filter(|name| name.extension().is_some_and(|ending| ending == "tum") && !of_recording(name)).collect();
    unused.sort();
    for name in unused {
        let name = printable_name(&name.display().to_string());
        message::note(&format!("{system}: {name} has the name of no recording and is not used"));
    }
    Ok(())
}

/// The errors of the trajectory in the file `path`, or why there are none.
fn score(path: &Path, truth: &Truth, min_coverage: f64) -> Score {
    if !path.is_file() {
        return Score { errors: None, failure: Some("no trajectory".to_owned()) };
    }
    let errors = trajectory_file::estimate(path).and_then(|estimate| {
        let pairs = truth.pairs(&estimate)?;
        Ok(TrajectoryErrors::of(&pairs, &truth.trajectory)?.0)
    });
    match errors {
        Err(error) => Score { errors: None, failure: Some(printable(&format!("{error:#}")).into_owned()) },
        Ok(errors) => {
            let is_short = errors.coverage < min_coverage;
            let failure = is_short.then(|| format!("covers {:.1} %", 100.0 * errors.coverage));
            Score { errors: Some(errors), failure }
        }
    }
}
