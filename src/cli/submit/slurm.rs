//! A sweep as a Slurm job array.

use super::super::usage::Usage;
use super::submission::{Submission, output_of};
use anyhow::Context;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Maximum length of a job name, characters.
const MAX_NAME_LENGTH: usize = 64;

/// Writes the script of the job array; returns its path.
pub(super) fn write(submission: &Submission) -> anyhow::Result<PathBuf> {
    submission.write("slurm", "array.sh", &text(submission)?)
}

/// The script of the job array.
fn text(submission: &Submission) -> anyhow::Result<String> {
    let Submission { sweep, folder, elements, threads } = submission;
    let program = std::env::current_exe().context("this program's own path is not known")?;
    let mut text = "#!/bin/sh\n".to_owned();
    for option in [
        format!("--job-name=zsim-{}", job_name(sweep.plan().name())),
        format!("--array=0-{}", elements - 1),
        format!("--cpus-per-task={threads}"),
        format!("--mem={}M", submission.memory_mib()),
        log_option(folder)?,
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
pub(super) fn submit(script: &Path, options: &str) -> anyhow::Result<u64> {
    let mut sbatch = Command::new("sbatch");
    let printed = output_of(sbatch.arg("--parsable").args(options.split_whitespace()).arg(script), "Slurm")?;
    // `number` or `number;cluster`.
    let number = printed.split(';').next().and_then(|number| number.parse().ok());
    number.with_context(|| format!("sbatch printed \"{printed}\", expected a job number"))
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
