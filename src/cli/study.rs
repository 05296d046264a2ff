//! `zsim study`: which of the estimator's settings matter.

use super::arguments::Global;
use super::bars::{Bars, stop_flag};
use super::{End, output};
use anyhow::Context;
use clap::Args;
use std::path::{Path, PathBuf};
use zsim::spec::{Kind, find, parse};
use zsim::study::Watch;
use zsim::study::comparison::{Comparison, csv, markdown, ratio_figure, words};

/// Compare settings of the estimator: each scene and seed is simulated once and estimated with every variant
///
/// Writes runs.csv, a row a run as soon as it is done; summary.csv and study.md, the ratios to the settings as they are and
/// whether they differ; and plots. What is in the folder already is not done again: a study that was stopped goes on.
#[derive(Args)]
#[command(after_help = "Example:\n  zsim study estimator_ablation --out results/estimator_ablation")]
pub(super) struct Arguments {
    /// What is compared, a name under specs/studies/ or a file
    #[arg(value_name = "FILE")]
    file: String,
    /// The folder for results, in which a study that was stopped goes on [default: results/<name>]
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<End> {
    let source = find(Kind::Study, &arguments.file)?;
    let comparison = Comparison::new(&parse(&source)?, &source)?;
    let stem = Path::new(&arguments.file).file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let folder = arguments.out.clone().unwrap_or_else(|| Path::new("results").join(&stem));

    let mut bars = Bars::new(global);
    bars.remark(&format!("{} runs in all", comparison.runs()));
    let mut watch = Watch { stop: stop_flag(), tell: &mut |news| bars.tell(news) };
    let ran = comparison.run(&folder, &mut watch);
    bars.finish();
    let summary = ran.inspect_err(|_| {
        if folder.exists() {
            super::journey::left_behind(&folder);
        }
    })?;

    write(&folder.join("summary.csv"), &csv(&summary))?;
    write(&folder.join("study.md"), &markdown(&summary, &format!("zsim study {stem}")))?;
    ratio_figure(&summary).save(&folder, "ratios")?;
    output::tell(global, &words(&summary), serde_json::to_value(&summary)?, Some(&folder))?;
    Ok(End::Done)
}

fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    std::fs::write(path, text).with_context(|| format!("{} cannot be written", path.display()))
}
