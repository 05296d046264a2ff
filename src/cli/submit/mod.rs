//! `zsim sweep submit`: a sweep on a cluster.

mod kubernetes;
mod slurm;
mod submission;

use super::arguments::Global;
use super::usage::Usage;
use super::{Completion, output};
use anyhow::Context;
use clap::{ArgGroup, Args};
use serde_json::json;
use std::path::PathBuf;
use submission::Submission;
use zsim_study::sweep::{Shard, Sweep};

/// Default number of runs per element; a scheduler needs about 1 s for each element.
const RUNS_PER_ELEMENT: u64 = 20;
/// Maximum default number of elements; the default limit of Slurm is 1001.
const MAX_ELEMENTS: u64 = 1000;
/// Submit a sweep to a scheduler as an array of jobs; each element does a part of the runs
///
/// All nodes must see the folder. Merge when the array is done; submit a second time for missing runs.
#[derive(Args)]
#[command(
    group = ArgGroup::new("scheduler").required(true),
    after_help = "Examples:\n  zsim sweep submit results/springs --slurm --elements 16\n  \
                  zsim sweep submit /data/springs --kubernetes --image zsim:1 --claim data"
)]
pub(super) struct Arguments {
    /// Folder of the sweep, created by `zsim sweep plan`
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Submit to Slurm, as a job array
    #[arg(long, group = "scheduler")]
    slurm: bool,
    /// Submit to Kubernetes, as an Indexed Job (1.29 or later)
    #[arg(long, group = "scheduler", requires_all = ["image", "claim"])]
    kubernetes: bool,
    /// Number of array elements [default: one for 20 runs, 1000 at most]
    #[arg(long, value_name = "M")]
    elements: Option<u64>,
    /// Options for sbatch, such as "--partition=long --time=2:00:00"
    #[arg(long, value_name = "OPTIONS", default_value = "", allow_hyphen_values = true, conflicts_with = "kubernetes")]
    sbatch: String,
    /// Image whose entry point is zsim, of the same version as this program
    #[arg(long, value_name = "IMAGE", conflicts_with = "slurm", value_parser = kubernetes::image)]
    image: Option<String>,
    /// Persistent volume claim with the folder that contains DIR; it is mounted at the same path
    #[arg(long, value_name = "NAME", conflicts_with = "slurm", value_parser = kubernetes::claim)]
    claim: Option<String>,
    /// Write DIR/slurm/array.sh or DIR/kubernetes/job.json and do not submit it
    #[arg(long)]
    dry_run: bool,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let folder = arguments.folder.canonicalize();
    let folder = folder.with_context(|| format!("{} cannot be found", arguments.folder.display()))?;
    let sweep = Sweep::open(&folder)?;
    let status = sweep.status(Shard::WHOLE)?;
    if status.missing == 0 {
        return output::print_result(
            global,
            "all runs are complete",
            json!({ "job": null, "elements": 0 }),
            Some(&folder),
        );
    }
    let wanted = arguments.elements.unwrap_or_else(|| status.missing.div_ceil(RUNS_PER_ELEMENT).min(MAX_ELEMENTS));
    if wanted == 0 {
        return Err(Usage("--elements 0: must be at least 1".to_owned()).into());
    }
    let elements = wanted.min(sweep.jobs() as u64).max(1);
    let threads = global.threads.map_or(1, std::num::NonZeroUsize::get);
    let submission = Submission { sweep: &sweep, folder: &folder, elements, threads };
    let file = match (&arguments.image, &arguments.claim) {
        (Some(image), Some(claim)) if arguments.kubernetes => kubernetes::write(&submission, image, claim)?,
        _ => slurm::write(&submission)?,
    };
    if arguments.dry_run {
        return output::print_result(global, "", json!({ "job": null, "elements": elements }), Some(&file));
    }
    let job = if arguments.slurm {
        json!(slurm::submit(&file, &arguments.sbatch)?)
    } else {
        json!(kubernetes::submit(&file)?)
    };
    let words = format!("job {job}: {elements} elements for {} runs; then: zsim sweep merge", status.missing);
    output::print_result(global, &words, json!({ "job": job, "elements": elements }), Some(&folder))
}
