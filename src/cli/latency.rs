//! `zsim latency`: the effect of timing errors on a map.

use super::arguments::{Global, ScenarioArguments};
use super::bars::{WorkBar, stop_flag};
use super::{Completion, output};
use anyhow::Context;
use clap::Args;
use std::path::{Path, PathBuf};
use zsim::spec::{Kind, SpecError, find, parse};
use zsim::study::latency::{
    ClockState, LatencyResult, LatencySpec, LatencyStudy, csv, curve_figure, map_figure, text_table,
};
use zsim::study::reproduction::ExperimentSpec;

/// The experiment with the default latencies and noises.
const FIGURE_4: &str = "fig4";

/// Put latency and timing noise on one recording: maps as in the paper's figure 4, and curves of error with their bands
///
/// Each latency and noise is estimated with the clock state off (as in the paper) and on (as zsim estimates).
/// Writes latency.csv, metrics.json and plots. A second start in the same folder skips finished runs and
/// continues.
#[derive(Args)]
#[command(after_help = "Example:\n  zsim latency --scene office.ron --out results/latency")]
pub(super) struct Arguments {
    /// The world, a name under scenes/ or a file
    #[arg(long, value_name = "NAME|FILE")]
    scene: String,
    #[command(flatten)]
    scenario: ScenarioArguments,
    /// The estimator's settings, a name under specs/estimators/ or a file
    #[arg(long, value_name = "NAME|FILE", default_value = "default")]
    estimator: String,
    /// Folder for results; an interrupted study in it is continued [default: results/latency]
    #[arg(long, short, value_name = "DIR", default_value = "results/latency")]
    out: PathBuf,
    /// Start anew even if the folder has another study of this kind
    #[arg(long)]
    force: bool,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let source = find(Kind::Experiment, FIGURE_4)?;
    let ExperimentSpec::Latency(shipped) = parse(&source)? else {
        return Err(SpecError::plain(source.name, "is not a latency experiment").into());
    };
    let scenario = arguments.scenario.scenario(&arguments.scene);
    let spec = LatencySpec { scenario, estimator: arguments.estimator.clone(), ..*shipped };
    let latency = LatencyStudy::new(&spec, &source)?;
    let folder = output::folder_to_resume(&arguments.out)?;
    let bar = WorkBar::new(global, "estimating");
    let ran = latency.run(&folder, arguments.force, stop_flag(), &|fraction| bar.set_fraction(fraction));
    drop(bar);
    let study = ran.inspect_err(|_| super::full_run::print_partial_results(&folder))?;
    write_results(&study, &folder)?;
    output::print_result(global, &text_table(&study), serde_json::to_value(&study)?, Some(&folder))?;
    Ok(Completion::Done)
}

fn write_results(study: &LatencyResult, folder: &Path) -> anyhow::Result<()> {
    for (name, text) in [("latency.csv", csv(study)), ("metrics.json", serde_json::to_string_pretty(study)? + "\n")] {
        let path = folder.join(name);
        std::fs::write(&path, text).with_context(|| format!("{} cannot be written", path.display()))?;
    }
    let plots = folder.join("plots");
    std::fs::create_dir_all(&plots).with_context(|| format!("cannot create {}", plots.display()))?;
    map_figure(study, ClockState::Off).save(&plots, "maps")?;
    map_figure(study, ClockState::On).save(&plots, "maps_clock_on")?;
    curve_figure(study).save(&plots, "curves")?;
    Ok(())
}
