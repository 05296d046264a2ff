//! `zsim sweep`: plan, run, status, merge, submit.

use super::arguments::{Global, spec_file};
use super::bars::{WorkBar, end_polling, stop_flag};
use super::usage::Usage;
use super::{Completion, output, repeat, submit};
use anyhow::{Context, bail};
use clap::{Args, Subcommand};
use serde_json::json;
use std::io::Write;
use std::path::{Path, PathBuf};
use zsim_base::spec::{Kind, NamedSpec, SpecError, find};
use zsim_study::design::DesignSpec;
use zsim_study::sweep::{
    ComparedNumber, MergedReport, Plan, Runner, Shard, Sweep, SweepSpec, SweepStatus, limit_process,
};

/// Repeat a run with other parameters: plan, run in pieces on any machines, merge
///
/// A sweep is a spec under specs/studies/: a run, its varied parameters, its measures. `plan` writes it to a folder;
/// `run` does missing runs, on this machine's threads or as one of many processes on many machines; `merge` creates one
/// table, the same bytes for any division of the work, with plots. Finished runs survive any interruption.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  zsim sweep plan spring_sweep -o results/springs\n  zsim sweep run results/springs\n  zsim sweep merge results/springs"
)]
pub(super) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

impl Arguments {
    /// Whether this process is a worker of another one.
    pub(super) fn is_worker(&self) -> bool {
        matches!(self.command, Command::Task(_))
    }
}

#[derive(Subcommand)]
enum Command {
    Plan(PlanArguments),
    Run(RunArguments),
    /// Report how many runs of a sweep are complete, failed or missing
    Status(FolderArguments),
    /// Merge the finished runs to table.csv, with a summary, plots and a page
    Merge(FolderArguments),
    Repeat(repeat::Arguments),
    Submit(submit::Arguments),
    #[command(hide = true)]
    Task(TaskArguments),
}

/// Check a sweep and all specs that it names; write the plan to a folder
#[derive(Args)]
#[command(after_help = "Example:\n  zsim sweep plan spring_sweep -o results/springs")]
struct PlanArguments {
    /// The sweep, a name under specs/studies/ or a file
    #[arg(value_name = "SPEC")]
    spec: String,
    /// Folder for the plan and the results; a sweep in it is continued [default: results/<name>]
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace another plan in the folder; runs that are in both stay done
    #[arg(long)]
    force: bool,
}

/// Do the missing runs, or a part of them
///
/// In a Slurm array or a Kubernetes Indexed Job the index is SLURM_ARRAY_TASK_ID or JOB_COMPLETION_INDEX.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  zsim sweep run results/springs --threads 8\n  zsim sweep run results/springs --index 3 --count 16"
)]
struct RunArguments {
    /// Folder of the sweep, created by `zsim sweep plan`
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Part of the runs that this process does, from 0
    #[arg(long, value_name = "I")]
    index: Option<usize>,
    /// Number of parts that the runs are divided into
    #[arg(long, value_name = "M")]
    count: Option<usize>,
    /// Then repeat each full run and keep its files and its page in DIR/runs
    #[arg(long)]
    keep_runs: bool,
}

// Without a docstring: it would replace those of the commands.
#[derive(Args)]
#[command(after_help = "Examples:\n  zsim sweep status results/springs --json\n  zsim sweep merge results/springs")]
struct FolderArguments {
    /// Folder of the sweep, created by `zsim sweep plan`
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// Do one task in a confined process and report each run on stdout; `run` starts it for journeys
#[derive(Args)]
struct TaskArguments {
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    #[arg(long)]
    task: usize,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    match &arguments.command {
        Command::Plan(plan) => plan_in(plan, global),
        Command::Run(run) => run_shard(run, global),
        Command::Status(folder) => {
            print_status(global, &Sweep::open(&folder.folder)?.status(Shard::WHOLE)?, &folder.folder)
        }
        Command::Merge(FolderArguments { folder }) => {
            let sweep = Sweep::open(folder)?;
            merge(&sweep, &output::shared_folder(folder)?, global)
        }
        Command::Repeat(repeat) => repeat::run(repeat, global),
        Command::Submit(arguments) => submit::run(arguments, global),
        Command::Task(task) => run_task(task),
    }
}

/// The plan that a spec describes.
pub(super) fn plan_of(name: &str) -> anyhow::Result<Plan> {
    let source = find(Kind::Study, name)?;
    let stem = Path::new(name).file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let spec = SweepSpec::parse(&source).map_err(|error| match DesignSpec::parse(&source) {
        Ok(_) => {
            SpecError::plain(&source.name, format!("it is a spring search, not a sweep: zsim spring design {name}"))
        }
        Err(_) => error,
    })?;
    Ok(Plan::new(&stem, &spec, &source)?)
}

/// Rejects a plan that would replace the file of its own spec.
pub(super) fn check_spec_stays(spec: &str, folder: &Path) -> anyhow::Result<()> {
    let inputs: Vec<PathBuf> = spec_file(Kind::Study, spec).into_iter().collect();
    output::check_not_inputs(&inputs, &["plan.ron", "points.csv"].map(|name| folder.join(name)))
}

fn plan_in(arguments: &PlanArguments, global: &Global) -> anyhow::Result<Completion> {
    let plan = plan_of(&arguments.spec)?;
    let folder = arguments.out.clone().unwrap_or_else(|| Path::new("results").join(plan.name()));
    check_spec_stays(&arguments.spec, &folder)?;
    let folder = output::folder_to_resume(&folder)?;
    let sweep = plan.write(&folder, arguments.force)?;
    let figures = json!({ "points": plan.runs(), "tasks": sweep.jobs() });
    let words = format!("{} runs in {} tasks", plan.runs(), sweep.jobs());
    output::print_result(global, &words, figures, Some(&folder))?;
    Ok(Completion::Done)
}

fn run_shard(arguments: &RunArguments, global: &Global) -> anyhow::Result<Completion> {
    let sweep = Sweep::open(&arguments.folder)?;
    let _lock = output::shared_folder(&arguments.folder)?;
    let shard = shard(arguments)?;
    if arguments.keep_runs {
        // Refuse a sweep without files to keep before its first run.
        sweep.runs_to_keep(shard)?;
    }
    run_sweep(&sweep, shard, arguments.keep_runs, global)?;
    print_status(global, &sweep.status(shard)?, &arguments.folder)
}

/// Runs the missing runs of a part, with a progress bar; with `keeps_runs`, then repeats each with its files.
pub(super) fn run_sweep(sweep: &Sweep, shard: Shard, keeps_runs: bool, global: &Global) -> anyhow::Result<()> {
    let program = std::env::current_exe().context("this program's own path is not known")?;
    let bar = WorkBar::new(global, "sweeping");
    let on_progress = |fraction: f64| bar.set_fraction(fraction);
    sweep.run(shard, &Runner { program: &program, stop: stop_flag(), on_progress: &on_progress })?;
    drop(bar);
    if keeps_runs {
        repeat::keep_runs(sweep, shard, global)?;
    }
    end_polling();
    Ok(())
}

/// The part given on the command line or by the scheduler.
fn shard(arguments: &RunArguments) -> anyhow::Result<Shard> {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<usize>().ok());
    let slurm = number("SLURM_ARRAY_TASK_ID");
    let given = arguments.index.or(slurm).or_else(|| number("JOB_COMPLETION_INDEX"));
    match (given, arguments.count) {
        (None, None) => Ok(Shard::WHOLE),
        (Some(index), Some(count)) => Ok(Shard { index, count }),
        (Some(index), None) if arguments.index.is_none() && slurm.is_some() => {
            let (first, step) = (number("SLURM_ARRAY_TASK_MIN"), number("SLURM_ARRAY_TASK_STEP"));
            let index = index.saturating_sub(first.unwrap_or(0)) / step.unwrap_or(1).max(1);
            let count = number("SLURM_ARRAY_TASK_COUNT");
            let count = count.ok_or_else(|| Usage("SLURM_ARRAY_TASK_COUNT is not set: pass --count".to_owned()))?;
            Ok(Shard { index, count })
        }
        (Some(index), None) => Err(Usage(format!("--index {index} needs --count")).into()),
        (None, Some(count)) => Err(Usage(format!("--count {count} needs --index")).into()),
    }
}

fn run_task(arguments: &TaskArguments) -> anyhow::Result<Completion> {
    let sweep = Sweep::open(&arguments.folder)?;
    limit_process(sweep.limit())?;
    sweep.run_job(arguments.task, &|word| {
        // The supervisor has ended: end this process too.
        if writeln!(std::io::stdout().lock(), "{word}").is_err() {
            std::process::exit(1);
        }
    })?;
    Ok(Completion::Done)
}

/// Merges the finished runs and writes plots and page, with a progress bar.
pub(super) fn merge_with_bar(sweep: &Sweep, global: &Global) -> anyhow::Result<MergedReport> {
    let _bar = WorkBar::new(global, "merging");
    Ok(sweep.merge_and_report()?)
}

/// Merges the finished runs and prints a summary.
pub(super) fn merge(sweep: &Sweep, folder: &Path, global: &Global) -> anyhow::Result<Completion> {
    let merged = merge_with_bar(sweep, global)?;
    let words = format!("{}\n{}", merged.text, status_text(&merged.status));
    let figures = json!({ "status": merged.status, "summary": merged.summary, "claims": merged.claims });
    output::print_result(global, &words, figures, Some(folder))?;
    if merged.status.failed == merged.status.points {
        let first = sweep.first_failure()?.unwrap_or_default();
        bail!("all {} runs failed: {first}", merged.status.points);
    }
    let missed: Vec<&ComparedNumber> = merged.claims.iter().filter(|claim| claim.is_missed()).collect();
    if let Some(first) = missed.first() {
        bail!("{} of {} claims missed, the first: {}: {}", missed.len(), merged.claims.len(), first.what, first.ours);
    }
    Ok(if merged.status.missing == 0 { Completion::Done } else { Completion::WithLoss })
}

/// Progress of a sweep.
fn status_text(status: &SweepStatus) -> String {
    let mut rows = vec![
        ("runs", status.points.to_string()),
        ("completed", status.done.to_string()),
        ("failed", status.failed.to_string()),
        ("missing", status.missing.to_string()),
    ];
    if status.damaged > 0 {
        rows.push(("damaged", status.damaged.to_string()));
    }
    let remaining = status.thread_s_left.filter(|_| status.missing > 0);
    rows.extend(remaining.map(|seconds| ("remaining time, one thread", duration(seconds))));
    zsim_report::Table::facts(rows).text()
}

/// A duration in readable units.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

fn print_status(global: &Global, status: &SweepStatus, folder: &Path) -> anyhow::Result<Completion> {
    output::print_result(global, &status_text(status), serde_json::to_value(status)?, Some(folder))?;
    Ok(Completion::Done)
}
