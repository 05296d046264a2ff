//! `zsim sweep repeat`: a run of a sweep with all its files, and the runs that a sweep keeps.

use super::arguments::Global;
use super::bars::{Bars, WorkBar, stop_flag};
use super::{Completion, full_run, output};
use clap::Args;
use serde_json::{Map, Value, json};
use std::path::PathBuf;
use zsim_run::ProgressMonitor;
use zsim_study::sweep::{Measure, RepeatedRun, Shard, Sweep};

/// Repeat one run of a sweep with all its files: recording, trajectories, metrics, report.html
///
/// The figures are those of the sweep's table. The next `zsim sweep merge` links the run from the sweep's report.html. Of
/// a closed form or a gain measurement, the head is written as head.ron.
#[derive(Args)]
#[command(after_help = "Example:\n  zsim sweep repeat results/imu_quality --run 12")]
pub(super) struct Arguments {
    /// Folder of the sweep, created by `zsim sweep plan`
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Number of the run in the tables, from 0
    #[arg(long, value_name = "N")]
    run: u64,
    /// Folder for the run [default: the run's own in DIR/runs]
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write into the folder even if it exists
    #[arg(long)]
    force: bool,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let sweep = Sweep::open(&arguments.folder)?;
    let _lock = output::shared_folder(&arguments.folder)?;
    sweep.check_repeat(arguments.run)?;
    let wanted = arguments.out.clone().map_or_else(|| sweep.create_run_folder(arguments.run), Ok)?;
    let mut bars = Bars::new(global);
    // The run's own folder is written again unless it is complete.
    let is_partial = arguments.out.is_none() && !wanted.join("metrics.json").is_file();
    let folder = output::folder(&wanted, arguments.force || is_partial)?;
    full_run::note_other_folder(&folder, &wanted, &bars);
    let mut watch = ProgressMonitor { stop: stop_flag(), report: &mut |event| bars.update(event) };
    let repeated = sweep.repeat(arguments.run, &folder, &mut watch);
    bars.finish();
    match repeated.inspect_err(|_| full_run::print_partial_results(&folder))? {
        RepeatedRun::Journey(result) => full_run::print_outcome(global, &result, false, &folder),
        RepeatedRun::OfHead(measures) => {
            output::print_result(global, &text(&measures), Value::Object(figures(&measures)), Some(&folder))
        }
    }
}

fn text(measures: &[(Measure, Option<f64>)]) -> String {
    let row = |(measure, value): &(Measure, Option<f64>)| {
        (zsim_report::quantity_name(measure.key()), value.map_or("-".to_owned(), |value| format!("{value:.6}")))
    };
    zsim_report::Table::facts(measures.iter().map(row)).text()
}

fn figures(measures: &[(Measure, Option<f64>)]) -> Map<String, Value> {
    measures.iter().map(|(measure, value)| (measure.key().to_owned(), json!(value))).collect()
}

/// Repeats the finished runs of a part that have no folder yet, one after the other. A run that fails is a note.
pub(super) fn keep_runs(sweep: &Sweep, shard: Shard, global: &Global) -> anyhow::Result<()> {
    let numbers = sweep.runs_to_keep(shard)?;
    let bar = WorkBar::new(global, "keeping runs");
    for (done, number) in numbers.iter().enumerate() {
        bar.set_fraction(done as f64 / numbers.len() as f64);
        bar.set_task(format!("run {number}"));
        let folder = output::folder(&sweep.create_run_folder(*number)?, true)?;
        let mut watch = ProgressMonitor { stop: stop_flag(), report: &mut |_| () };
        match sweep.repeat(*number, &folder, &mut watch) {
            Err(error) if error.is_stopped() => return Err(error.into()),
            Err(error) if !global.quiet => bar.note(&format!("run {number} has no page: {error}")),
            _ => {}
        }
    }
    Ok(())
}
