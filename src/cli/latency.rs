//! `zsim latency`: the effect of timing errors on a map.

use super::arguments::{Global, ScenarioArguments};
use super::{Completion, output, sweep};
use anyhow::anyhow;
use clap::Args;
use std::path::PathBuf;
use zsim_base::random::Seed;
use zsim_base::spec::{Kind, NamedSpec, find};
use zsim_study::latency::document;
use zsim_study::sweep::{BaseSpec, Plan, Shard, SweepSpec};

/// The study with the latencies and noises.
const STUDY: &str = "timing";

/// Put latency and timing noise on one recording: maps as in the paper's figure 4, and curves of error with their bands
///
/// Runs the study specs/studies/timing.ron in another scenario: each latency and noise is estimated with the clock state
/// off (as in the paper) and on (as zsim estimates). Writes latency.csv, metrics.json and plots. A second start in the
/// same folder skips finished runs and continues.
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
    /// Folder for results; an interrupted study in it is continued
    #[arg(long, short, value_name = "DIR", default_value = "results/latency")]
    out: PathBuf,
    /// Replace another study in the folder; runs that are in both stay done
    #[arg(long)]
    force: bool,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let source = find(Kind::Study, STUDY)?;
    let mut spec = SweepSpec::parse(&source)?;
    let scenario = arguments.scenario.scenario(&arguments.scene);
    let Seed(seed) = scenario.seed;
    spec.seeds = vec![seed];
    if let BaseSpec::Journey(journey) = spec.base {
        spec.base = BaseSpec::Journey(journey.in_scenario(scenario, &arguments.estimator));
    }
    let plan = Plan::new(STUDY, &spec, &source)?;
    let folder = output::folder_to_resume(&arguments.out)?;
    let planned = plan.write(&folder, arguments.force)?;
    sweep::run_sweep(&planned, Shard::WHOLE, false, global)
        .inspect_err(|_| super::full_run::print_partial_results(&folder))?;
    let merged = sweep::merge_with_bar(&planned, global)?;
    let failed =
        || anyhow!("failed runs: {}; {} has their errors", merged.status.failed, folder.join("table.csv").display());
    let study = merged.latency.as_ref().ok_or_else(failed)?;
    output::print_result(global, &document(study).text(), serde_json::to_value(study)?, Some(&folder))?;
    Ok(Completion::Done)
}
