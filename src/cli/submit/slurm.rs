//! `zsim sweep submit`: a sweep as a Slurm job array.

use super::arguments::Global;
use super::usage::Usage;
use super::{Completion, output};
use anyhow::{Context, bail};
use clap::Args;
use serde_json::json;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use zsim::study::replace_text;
use zsim::study::sweep::{Shard, Sweep};

/// Default number of runs per array element; a scheduler needs about 1 s for each element.
const RUNS_PER_ELEMENT: u64 = 20;
/// Maximum default number of elements; the default limit of Slurm is 1001.
const MAX_ELEMENTS: u64 = 1000;
/// Maximum length of a job name, characters.
const MAX_NAME_LENGTH: usize = 64;
/// Memory above the limit of a run, MiB: for the process that supervises the runs.
const SUPERVISOR_MEMORY_MIB: u64 = 256;

/// Submit a sweep to a scheduler as a job array; each element does a part of the runs
///
/// All nodes must see the folder. Merge when the array is done; submit a second time for missing runs.
#[derive(Args)]
#[command(after_help = "Example:\n  zsim sweep submit results/springs --slurm --elements 16")]
pub(super) struct Arguments {
    /// Folder of the sweep, created by `zsim sweep plan`
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Submit to Slurm (the only supported scheduler)
    #[arg(long, required = true)]
    slurm: bool,
    /// Number of array elements [default: one for 20 runs, 1000 at most]
    #[arg(long, value_name = "M")]
    elements: Option<u64>,
    /// Options for sbatch, such as "--partition=long --time=2:00:00"
    #[arg(long, value_name = "OPTIONS", default_value = "", allow_hyphen_values = true)]
    sbatch: String,
    /// Write DIR/slurm/array.sh and do not submit it
    #[arg(long)]
    dry_run: bool,
}

pub(super) fn run(arguments: &Arguments, global: &Global) -> anyhow::Result<Completion> {
    let folder = arguments.folder.canonicalize();
    let folder = folder.with_context(|| format!("{} cannot be found", arguments.folder.display()))?;
    let log = log_option(&folder)?;
    let sweep = Sweep::open(&folder)?;
    let status = sweep.status(Shard::WHOLE)?;
    if status.missing == 0 {
        output::print_result(global, "all runs are complete", json!({ "job": null, "elements": 0 }), Some(&folder))?;
        return Ok(Completion::Done);
    }
    let wanted = arguments.elements.unwrap_or_else(|| status.missing.div_ceil(RUNS_PER_ELEMENT).min(MAX_ELEMENTS));
    if wanted == 0 {
        return Err(Usage("--elements 0: must be at least 1".to_owned()).into());
    }
    let elements = wanted.min(sweep.tasks() as u64).max(1);
    let logs = folder.join("slurm");
    std::fs::create_dir_all(&logs).with_context(|| format!("cannot create {}", logs.display()))?;
    let script = logs.join("array.sh");
    let threads = global.threads.map_or(1, std::num::NonZeroUsize::get);
    replace_text(&script, &text(&sweep, &log, &folder, elements, threads)?)?;
    if arguments.dry_run {
        output::print_result(global, "", json!({ "job": null, "elements": elements }), Some(&script))?;
        return Ok(Completion::Done);
    }
    let job = submit_script(&script, &arguments.sbatch)?;
    let words = format!("job {job}: {elements} elements for {} runs; then: zsim sweep merge", status.missing);
    output::print_result(global, &words, json!({ "job": job, "elements": elements }), Some(&folder))?;
    Ok(Completion::Done)
}

/// The script of the job array.
fn text(sweep: &Sweep, log: &str, folder: &Path, elements: u64, threads: usize) -> anyhow::Result<String> {
    let program = std::env::current_exe().context("this program's own path is not known")?;
    let memory_mib =
        sweep.limit().map_or(SUPERVISOR_MEMORY_MIB, |limit| limit.memory_mib * threads as u64) + SUPERVISOR_MEMORY_MIB;
    let mut text = "#!/bin/sh\n".to_owned();
    for option in [
        format!("--job-name=zsim-{}", job_name(sweep.plan().name())),
        format!("--array=0-{}", elements - 1),
        format!("--cpus-per-task={threads}"),
        format!("--mem={memory_mib}M"),
        log.to_owned(),
    ] {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "#SBATCH {option}");
    }
    let (program, folder) = (quoted(&program)?, quoted(folder)?);
    let _ = writeln!(
        text,
        "exec {program} sweep run {folder} --index \"$SLURM_ARRAY_TASK_ID\" --count {elements} --threads {threads} --quiet"
    );
    Ok(text)
}

/// The job name of a sweep: letters, digits, `.`, `_` and `-`. Other characters are replaced by `_`, because sbatch or a
/// shell could interpret them.
fn job_name(name: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || ['.', '_', '-'].contains(&c);
    name.chars().take(MAX_NAME_LENGTH).map(|c| if is_plain(c) { c } else { '_' }).collect()
}

/// The option with the log files of the elements, `folder/slurm/<job>_<element>.log`.
///
/// # Errors
/// When the path has a character with a special meaning: sbatch has particular quoting rules, and interprets `%` and `\`
/// in this option.
fn log_option(folder: &Path) -> anyhow::Result<String> {
    let is_plain = |c: char| c.is_alphanumeric() || " ./_-+=:,@~".contains(c);
    let path = folder.to_str().filter(|path| path.chars().all(is_plain)).ok_or_else(|| {
        let message = format!(
            "{folder:?}: the path in a job script can only have letters, digits, spaces and ./_-+=:,@~: move the folder to such \
             a path"
        );
        Usage(message)
    })?;
    Ok(format!("--output='{path}/slurm/%A_%a.log'"))
}

/// A path quoted for the shell.
fn quoted(path: &Path) -> anyhow::Result<String> {
    let text = path.to_str().with_context(|| format!("{} is not UTF-8", path.display()))?;
    Ok(format!("'{}'", text.replace('\'', "'\\''")))
}

/// Submits the script with sbatch and returns the job number.
fn submit_script(script: &Path, options: &str) -> anyhow::Result<u64> {
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
    fn names_and_paths_cannot_inject_commands() {
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
