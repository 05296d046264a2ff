//! `zsim sweep submit`: a sweep as a Slurm job array.

use super::arguments::Global;
use super::failure::Usage;
use super::{End, output};
use anyhow::{Context, bail};
use clap::Args;
use serde_json::json;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use zsim::study::sweep::{Share, Sweep};

/// Runs that an array's element has at least: a scheduler takes about a second for each.
const RUNS_IN_AN_ELEMENT: u64 = 20;
/// Most elements: Slurm's own default is 1001.
const MOST_ELEMENTS: u64 = 1000;
/// Longest name of a job, characters.
const LONGEST_NAME: usize = 64;
/// Memory above the limit of a run, MiB: for the process that supervises the runs.
const MEMORY_BESIDE_MIB: u64 = 256;

/// Submit a sweep to a scheduler as a job array; each element does a part of the runs
///
/// All nodes must see the folder. Merge when the array is done; submit a second time for missing runs.
#[derive(Args)]
#[command(after_help = "Example:\n  zsim sweep submit results/springs --slurm --elements 16")]
pub(super) struct Arguments {
    /// The folder of the plan
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// As a Slurm job array
    #[arg(long, required = true)]
    slurm: bool,
    /// How many elements the array has [default: one for 20 runs, 1000 at most]
    #[arg(long, value_name = "M")]
    elements: Option<u64>,
    /// Options for sbatch, such as "--partition=long --time=2:00:00"
    #[arg(long, value_name = "OPTIONS", default_value = "", allow_hyphen_values = true)]
    sbatch: String,
    /// Write DIR/slurm/array.sh and do not submit it
    #[arg(long)]
    dry_run: bool,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<End> {
    let folder = arguments.folder.canonicalize();
    let folder = folder.with_context(|| format!("{} cannot be found", arguments.folder.display()))?;
    let log = log_option(&folder)?;
    let sweep = Sweep::open(&folder)?;
    let status = sweep.status(Share::WHOLE)?;
    if status.missing == 0 {
        output::tell(global, "nothing is missing", json!({ "job": null, "elements": 0 }), Some(&folder))?;
        return Ok(End::Done);
    }
    let wanted = arguments.elements.unwrap_or_else(|| status.missing.div_ceil(RUNS_IN_AN_ELEMENT).min(MOST_ELEMENTS));
    if wanted == 0 {
        return Err(Usage("--elements 0: an array has at least one".to_owned()).into());
    }
    let elements = wanted.min(sweep.tasks() as u64).max(1);
    let logs = folder.join("slurm");
    std::fs::create_dir_all(&logs).with_context(|| format!("cannot create {}", logs.display()))?;
    let script = logs.join("array.sh");
    let threads = global.threads.map_or(1, std::num::NonZeroUsize::get);
    std::fs::write(&script, text((&sweep, &log), &folder, elements, threads)?)
        .with_context(|| format!("{} cannot be written", script.display()))?;
    if arguments.dry_run {
        output::tell(global, "", json!({ "job": null, "elements": elements }), Some(&script))?;
        return Ok(End::Done);
    }
    let job = submitted(&script, &arguments.sbatch)?;
    let words = format!("job {job}: {elements} elements for {} runs; then: zsim sweep merge", status.missing);
    output::tell(global, &words, json!({ "job": job, "elements": elements }), Some(&folder))?;
    Ok(End::Done)
}

/// The array's script.
fn text((sweep, log): (&Sweep, &str), folder: &Path, elements: u64, threads: usize) -> anyhow::Result<String> {
    let program = std::env::current_exe().context("this program's own path is not known")?;
    let memory_mib =
        sweep.limit().map_or(MEMORY_BESIDE_MIB, |limit| limit.memory_mib * threads as u64) + MEMORY_BESIDE_MIB;
    let mut text = "#!/bin/sh\n".to_owned();
    for option in [
        format!("--job-name=zsim-{}", job_name(sweep.plan().name())),
        format!("--array=0-{}", elements - 1),
        format!("--cpus-per-task={threads}"),
        format!("--mem={memory_mib}M"),
        log.to_owned(),
    ] {
        // Writing to a string does not fail.
        let _ = writeln!(text, "#SBATCH {option}");
    }
    let (program, folder) = (quoted(&program)?, quoted(folder)?);
    let _ = writeln!(
        text,
        "exec {program} sweep run {folder} --index \"$SLURM_ARRAY_TASK_ID\" --count {elements} --threads {threads} --quiet"
    );
    Ok(text)
}

/// A job's name for a sweep's: letters, digits, `.`, `_` and `-`; others, which sbatch or a shell could read as more
/// than a name, become `_`.
fn job_name(name: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || ['.', '_', '-'].contains(&c);
    name.chars().take(LONGEST_NAME).map(|c| if is_plain(c) { c } else { '_' }).collect()
}

/// The option that names the elements' logs, `folder/slurm/<job>_<element>.log`.
///
/// # Errors
/// When the folder's path has a character that a line of sbatch's options cannot hold as it is: sbatch has quoting
/// rules of its own, and interprets `%` and `\` in this option.
fn log_option(folder: &Path) -> anyhow::Result<String> {
    let is_plain = |c: char| c.is_alphanumeric() || " ./_-+=:,@~".contains(c);
    let path = folder.to_str().filter(|path| path.chars().all(is_plain)).ok_or_else(|| {
        let message = format!(
            "{folder:?}: a job's script can hold a path of letters, digits, spaces and ./_-+=:,@~ only: move the folder \
             to such a path"
        );
        Usage(message)
    })?;
    Ok(format!("--output='{path}/slurm/%A_%a.log'"))
}

/// A path as a shell reads it.
fn quoted(path: &Path) -> anyhow::Result<String> {
    let text = path.to_str().with_context(|| format!("{} is not UTF-8", path.display()))?;
    Ok(format!("'{}'", text.replace('\'', "'\\''")))
}

/// Hands the script to sbatch; returns the job number.
fn submitted(script: &Path, options: &str) -> anyhow::Result<u64> {
    let mut sbatch = Command::new("sbatch");
    sbatch.arg("--parsable").args(options.split_whitespace()).arg(script);
    let output = sbatch.output().context("sbatch cannot be run: is Slurm installed here?")?;
    if !output.status.success() {
        bail!("sbatch refused: {}", String::from_utf8_lossy(&output.stderr).trim());
    }
    // `number` or `number;cluster`.
    let printed = String::from_utf8_lossy(&output.stdout);
    let number = printed.trim().split(';').next().and_then(|number| number.parse().ok());
    number.with_context(|| format!("sbatch printed \"{}\", expected a job number", printed.trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_paths_add_nothing_to_the_script() {
        assert_eq!(job_name("spring_sweep-2.b"), "spring_sweep-2.b");
        assert_eq!(job_name("a --uid=0\n#SBATCH -x\ntouch b"), "a_--uid_0__SBATCH_-x_touch_b");
        assert_eq!(log_option(Path::new("/data/my sweep")).unwrap(), "--output='/data/my sweep/slurm/%A_%a.log'");
        for path in ["/a\nrm -rf b", "/it's", "/%u", "/a\"b", "/a\\b", "/$(b)", "/`b`", "/a;b"] {
            let error = log_option(Path::new(path)).unwrap_err();
            assert!(error.to_string().contains("move the folder"), "{error}");
        }
        assert_eq!(quoted(Path::new("/it's; $(b)")).unwrap(), "'/it'\\''s; $(b)'");
    }
}
