//! `zsim reproduce`: the paper's experiments.

use super::arguments::Global;
use super::bars::{WorkBar, end_polling, stop_flag};
use super::usage::Usage;
use super::{Completion, output};
use anyhow::Context;
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use zsim_base::files::replace_text;
use zsim_base::files::subfolder;
use zsim_study::reproduction::{Experiment, Extent, Finding, PAPER_TITLE, paper_document};
use zsim_study::sweep::Runner;

/// Repeat the paper's experiments: compare the published results with zsim's
///
/// Each writes its figures to DIR/paper/NAME/; DIR/paper.md has the tables and verdicts of all finished ones,
/// DIR/paper/report.html also their plots. An interrupted experiment continues from its last finished run.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  zsim reproduce\n  zsim reproduce fig3 --out results\n  zsim reproduce accuracy --seeds 1,2,3 --out fresh"
)]
pub(super) struct Arguments {
    /// Experiments, names under specs/experiments/ or files [default: all]
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// Folder for all results
    #[arg(long, short, value_name = "DIR", default_value = "results")]
    out: PathBuf,
    /// Smoke test: run a small variant of each experiment, in seconds, in DIR/paper-quick/; do not use its results
    #[arg(long)]
    quick: bool,
    /// Seeds instead of those of the experiments, for example 1,2,3; use another folder than that of the usual seeds
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', requires = "names")]
    seeds: Vec<u64>,
    /// Text for the head of the table, such as the date of the program
    #[arg(long, value_name = "TEXT")]
    label: Option<String>,
    /// Start anew even if a folder has work by another spec or version
    #[arg(long)]
    force: bool,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let all = Experiment::all();
    let names = if arguments.names.is_empty() { &all } else { &arguments.names };
    // Check all names before the first experiment runs for hours.
    let wanted = names.iter().map(|name| load(name, &arguments.seeds)).collect::<anyhow::Result<Vec<_>>>()?;
    let extent = if arguments.quick { Extent::Quick } else { Extent::Whole };
    let folder = arguments.out.join(extent.folder());
    check_table(&folder.with_extension("md"), arguments.force)?;
    let folder = output::folder_to_resume(&folder)?;
    let program = std::env::current_exe().context("this program's own path is not known")?;
    let mut found = Vec::new();
    table(arguments, extent, &folder, &found)?;
    for experiment in &wanted {
        let bar = WorkBar::new(global, "reproducing");
        bar.set_task(experiment.name.clone());
        let on_progress = |fraction: f64| bar.set_fraction(fraction);
        let runner = Runner { program: &program, stop: stop_flag(), on_progress: &on_progress };
        let result = experiment.run(&subfolder(&folder, &experiment.name)?, extent, arguments.force, &runner)?;
        found.push(Finding { experiment: experiment.clone(), result: Some(result) });
        table(arguments, extent, &folder, &found)?;
        end_polling();
    }
    let words = paper_document(&found, &folder, extent, "", None)?.text();
    let figures = found.iter().filter_map(|Finding { experiment, result }| {
        let result = result.as_ref()?;
        Some(json!({ "name": experiment.given, "rows": result.rows, "notes": result.notes }))
    });
    output::print_result(global, &words, json!({ "experiments": figures.collect::<Vec<_>>() }), Some(&folder))?;
    Ok(Completion::Done)
}

/// Loads an experiment, with other seeds if there are any.
fn load(name: &str, seeds: &[u64]) -> anyhow::Result<Experiment> {
    let experiment = Experiment::load(name)?;
    Ok(if seeds.is_empty() { experiment } else { experiment.with_seeds(seeds)? })
}

/// Refuses to replace a table that `zsim reproduce` did not write.
fn check_table(path: &Path, force: bool) -> anyhow::Result<()> {
    let is_foreign = |text: Vec<u8>| !text.starts_with(format!("# {PAPER_TITLE}").as_bytes());
    if !force && std::fs::read(path).is_ok_and(is_foreign) {
        let message = format!(
            "{} was not written by zsim reproduce: name another folder with --out, or replace it with --force",
            path.display()
        );
        return Err(Usage(message).into());
    }
    Ok(())
}

/// Writes the table and the page of the findings of this and earlier runs.
fn table(arguments: &Arguments, extent: Extent, folder: &Path, found: &[Finding]) -> anyhow::Result<()> {
    let mut findings = Vec::new();
    for name in Experiment::all() {
        let earlier = || -> anyhow::Result<Finding> {
            let experiment = Experiment::load(&name)?;
            let result = experiment.finished(&folder.join(&name), extent)?;
            Ok(Finding { experiment, result })
        };
        let of_this_run = found.iter().find(|finding| finding.experiment.given == name);
        findings.push(of_this_run.map_or_else(earlier, |finding| Ok(finding.clone()))?);
    }
    let is_built_in =
        |finding: &Finding| findings.iter().any(|other| other.experiment.given == finding.experiment.given);
    let others: Vec<Finding> = found.iter().filter(|finding| !is_built_in(finding)).cloned().collect();
    findings.extend(others);
    let mut options = if arguments.quick { " --quick".to_owned() } else { String::new() };
    if arguments.out != Path::new("results") {
        options += &format!(" --out {}", arguments.out.display());
    }
    let path = folder.with_extension("md");
    std::fs::create_dir_all(&arguments.out).with_context(|| format!("cannot create {}", arguments.out.display()))?;
    let document = paper_document(&findings, folder, extent, &options, arguments.label.as_deref())?;
    replace_text(&path, &document.markdown(&format!("{}/", extent.folder())))?;
    Ok(replace_text(&folder.join("report.html"), &document.html())?)
}
