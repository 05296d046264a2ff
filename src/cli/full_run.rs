//! `zsim --scene`: the full run, from simulation to report.

use super::Completion;
use super::arguments::{EstimatorArguments, Global, OutArguments, ScenarioArguments};
use super::bars::{Bars, end_polling, stop_flag};
use super::live::{Live, LiveArguments};
use super::{message, output, recording_size};
use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use zsim_report::page::LivePage;
use zsim_report::{self, Metrics};
use zsim_run::{EstimateResult, ProgressMonitor, RunError, RunEvent};
use zsim_simulation::{Outputs, Simulation};

#[derive(Args)]
pub(super) struct Arguments {
    /// The world, a name under scenes/ or a file
    #[arg(long, value_name = "NAME|FILE", required = true)]
    pub scene: Option<String>,
    #[command(flatten)]
    scenario: ScenarioArguments,
    #[command(flatten)]
    estimator: EstimatorArguments,
    #[command(flatten)]
    out: OutArguments,
    #[command(flatten)]
    live: LiveArguments,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let scene = arguments.scene.as_deref().unwrap_or_default();
    let options = arguments.estimator.options()?;
    let simulation = Simulation::prepare(&arguments.scenario.scenario(scene))?;
    let wanted = arguments.out.out.clone().unwrap_or_else(|| default_folder(simulation.world().name()));
    let live = arguments.live.start(|| LivePage::of_simulation(&simulation))?;
    let bars = Bars::new(global);
    recording_size::check(&simulation, Outputs::All, &wanted, |note| bars.note(note))?;
    let folder = output::folder(&wanted, arguments.out.force)?;
    let inputs = arguments.scenario.inputs(scene).into_iter().chain(arguments.estimator.settings.file());
    let inputs = inputs.chain(simulation.world().mesh_files().iter().cloned());
    output::check_not_inputs(inputs, zsim_run::full_run_files().iter().map(|name| folder.join(name)))?;
    note_other_folder(&folder, &wanted, &bars);

    simulation.world().notes().iter().for_each(|note| bars.note(note));
    let work = |watch: &mut ProgressMonitor| zsim_run::simulate_and_estimate(&simulation, &options, &folder, watch);
    let outcome = observed(work, live, bars, &folder)?;
    print_outcome(global, &outcome, arguments.estimator.profile, &folder)
}

/// Does an estimate with its progress in the bars, and on the live page if there is one.
pub(super) fn observed(
    work: impl FnOnce(&mut ProgressMonitor) -> Result<EstimateResult, RunError>,
    mut live: Option<Live>,
    mut bars: Bars,
    folder: &Path,
) -> Result<EstimateResult, RunError> {
    let mut report = |event: RunEvent| {
        live.iter_mut().for_each(|live| live.observe(&event));
        bars.update(event);
    };
    let outcome = work(&mut ProgressMonitor { stop: stop_flag(), report: &mut report });
    bars.finish();
    live.into_iter().for_each(|live| live.finish(&outcome, folder));
    outcome.inspect_err(|_| print_partial_results(folder))
}

/// Notes at the start that the results go to another folder than that `wanted`, which exists.
pub(super) fn note_other_folder(folder: &Path, wanted: &Path, bars: &Bars) {
    if folder != wanted {
        bars.note(&format!("{} exists: the results go to {}", wanted.display(), folder.display()));
    }
}

/// Default folder for results.
pub(super) fn default_folder(name: &str) -> PathBuf {
    Path::new("results").join(name)
}

/// Prints the folder that has the parts completed before a failure.
pub(super) fn print_partial_results(folder: &Path) {
    message::line(&format!("completed parts are in {}", folder.display()));
}

/// Time of each part of the estimator, s, and of the open loop in total.
fn seconds_by_part(outcome: &EstimateResult) -> Value {
    let parts = outcome.timing.parts().into_iter().map(|part| (format!("{}_s", part.name), json!(part.seconds)));
    let whole = ("open_loop_s".to_owned(), json!(outcome.metrics.open_loop.wall_s));
    Value::Object(parts.chain([whole]).collect())
}

/// Prints the results of an estimate, its times with `profile`, and its losses.
pub(super) fn print_outcome(
    global: &Global,
    outcome: &EstimateResult,
    profile: bool,
    folder: &Path,
) -> anyhow::Result<Completion> {
    // A signal during the last plots comes too late to stop the run, but still determines the exit code.
    end_polling();
    let mut figures = serde_json::to_value(&outcome.metrics)?;
    if let (true, Value::Object(object)) = (profile, &mut figures) {
        object.insert("profile".to_owned(), seconds_by_part(outcome));
    }
    let mut words =
        if global.verbose { zsim_report::summary(&outcome.metrics) } else { zsim_report::brief(&outcome.metrics) };
    if let (true, Some(wall_s)) = (profile, outcome.metrics.open_loop.wall_s) {
        words += "\n";
        words += &zsim_report::timing_table(&outcome.timing, wall_s);
    }
    output::print_result(global, &words, figures, Some(folder))?;
    let Metrics { losses, status, .. } = &outcome.metrics;
    losses.iter().for_each(|loss| message::loss(&loss.line()));
    let is_good = status.as_deref().is_none_or(|status| status == "good");
    Ok(if losses.is_empty() && is_good { Completion::Done } else { Completion::WithLoss })
}
