//! `zsim study`: a sweep from its spec to its tables.

use super::arguments::Global;
use super::{Completion, output, sweep};
use clap::Args;
use std::path::{Path, PathBuf};
use zsim_study::sweep::Shard;

/// Vary the parameters of a run and report their effects: `zsim sweep` plan, run and merge in one
///
/// Writes table.csv, a row per run, and its schema; summary.csv and study.md, the effect of each axis and its
/// significance; report.html, a page with both, the plots and all runs to sort and filter; and plots.
/// A second start in the same folder skips finished runs and continues. If the study has claims, it exits with
/// code 1 when one is missed.
#[derive(Args)]
#[command(after_help = "Example:\n  zsim study estimator_ablation --out results/estimator_ablation")]
pub(super) struct Arguments {
    /// The study, a name under specs/studies/ or a file
    #[arg(value_name = "FILE")]
    file: String,
    /// Folder for results; an interrupted study in it is continued [default: results/<name>]
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace another plan in the folder; runs that are in both stay done
    #[arg(long)]
    force: bool,
    /// Then repeat each full run and keep its files in DIR/runs; report.html links to their pages
    #[arg(long)]
    keep_runs: bool,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let plan = sweep::plan_of(&arguments.file)?;
    let folder = arguments.out.clone().unwrap_or_else(|| Path::new("results").join(plan.name()));
    sweep::check_spec_stays(&arguments.file, &folder)?;
    let folder = output::folder_to_resume(&folder)?;
    let planned = plan.write(&folder, arguments.force)?;
    if arguments.keep_runs {
        // Refuse a study without files to keep before its first run.
        planned.runs_to_keep(Shard::WHOLE)?;
    }
    sweep::run_sweep(&planned, Shard::WHOLE, arguments.keep_runs, global)
        .inspect_err(|_| super::full_run::print_partial_results(&folder))?;
    sweep::merge(&planned, &folder, global)
}
