//! What the jobs of all schedulers need.

use anyhow::Context;
use std::path::{Path, PathBuf};
use std::process::Command;
use zsim_base::files;
use zsim_base::files::replace_text;
use zsim_study::sweep::Sweep;

/// Memory above the limit of a run, MiB: for the process that supervises the runs.
const SUPERVISOR_MEMORY_MIB: u64 = 256;

/// A sweep, and the resources of each element.
pub(super) struct Submission<'a> {
    pub(super) sweep: &'a Sweep,
    /// Absolute path of the sweep's folder.
    pub(super) folder: &'a Path,
    pub(super) elements: u64,
    pub(super) threads: usize,
}

impl Submission<'_> {
    /// Memory of an element, MiB.
    pub(super) fn memory_mib(&self) -> u64 {
        let runs_mib = self
            .sweep
            .limit()
            .map_or(SUPERVISOR_MEMORY_MIB, |limit| limit.memory_mib.saturating_mul(self.threads as u64));
        runs_mib.saturating_add(SUPERVISOR_MEMORY_MIB)
    }

    /// Replaces the file `name` in the subfolder `subfolder` of the sweep; returns its path.
    pub(super) fn write(&self, subfolder: &str, name: &str, text: &str) -> anyhow::Result<PathBuf> {
        let folder = files::subfolder(self.folder, subfolder)?;
        replace_text(&folder.join(name), text)?;
        Ok(folder.join(name))
    }
}

/// The output of a scheduler's command.
///
/// # Errors
/// If it cannot be run or if it fails.
pub(super) fn output_of(command: &mut Command, scheduler: &str) -> anyhow::Result<String> {
    let name = command.get_program().to_string_lossy().into_owned();
    let output = command.output().with_context(|| format!("{name} cannot be run: is {scheduler} installed here?"))?;
    if !output.status.success() {
        anyhow::bail!("{name} refused: {}", String::from_utf8_lossy(&output.stderr).trim());
    }
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
