//! The files of a simulated recording, reserved before anything is computed.

use super::output::{candidates, check_not_inputs, create_parent};
use super::usage::Usage;
use anyhow::{Context, bail, ensure};
use std::fs::OpenOptions;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// A recording and, unless it has none, the true trajectory next to it, as files that only this process has created.
///
/// Files that exist are replaced only by [`finish`](Self::finish): until then the new files have temporary names, so
/// that a failed run destroys no file.
pub(super) struct RecordingFiles {
    recording: PathBuf,
    truth: Option<PathBuf>,
    /// Final path of the complete recording, if it is written under a temporary name.
    replaces: Option<PathBuf>,
    is_finished: bool,
}

impl RecordingFiles {
    /// Reserves `wanted` and, with `truth`, the file of the same name that ends in `.tum`. Where one of them exists a number is
    /// added to both names, unless `force` permits to replace them. No file of `inputs` is ever replaced.
    ///
    /// # Errors
    /// When the two files would be one, an input would be replaced, or they cannot be created.
    pub fn reserve(wanted: &Path, truth: bool, force: bool, inputs: &[PathBuf]) -> anyhow::Result<Self> {
        if wanted.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("tum")) {
            let message = format!(
                "--out {}: the recording needs another ending, such as .mcap; the true trajectory is written next to it \
                 as .tum",
                wanted.display()
            );
            return Err(Usage(message).into());
        }
        create_parent(wanted)?;
        let outputs: Vec<PathBuf> = [wanted.to_owned()].into_iter().chain(truth.then(|| truth_of(wanted))).collect();
        if !(force && outputs.iter().any(|path| path.exists())) {
            return Self::first_free(wanted, truth, None);
        }
        ensure!(
            truth || !truth_of(wanted).exists(),
            "{} next to it is the true trajectory of another recording: choose another --out",
            truth_of(wanted).display()
        );
        for path in &outputs {
            ensure!(!path.is_dir(), "{} is a folder; a file's name is needed", path.display());
        }
        check_not_inputs(inputs, &outputs)?;
        let ending = wanted.extension().map(|ending| format!(".{}", ending.to_string_lossy())).unwrap_or_default();
        Self::first_free(&wanted.with_extension(format!("partial{ending}")), truth, Some(wanted))
    }

    /// Creates the files under the first name, `wanted` or `wanted` with a number, that neither a recording nor a true
    /// trajectory has taken.
    ///
    /// [`finish`](Self::finish) then moves them to `replaces`, if given.
    fn first_free(wanted: &Path, truth: bool, replaces: Option<&Path>) -> anyhow::Result<Self> {
        for recording in candidates(wanted) {
            let truth_file = truth_of(&recording);
            if !is_created(&recording)? {
                continue;
            }
            let is_free = if truth { is_created(&truth_file)? } else { !truth_file.exists() };
            if is_free {
                let (truth, replaces) = (truth.then_some(truth_file), replaces.map(Path::to_owned));
                return Ok(Self { recording, truth, replaces, is_finished: false });
            }
            std::fs::remove_file(&recording).with_context(|| format!("{} cannot be removed", recording.display()))?;
        }
        bail!("{} and thousands of numbered files exist already", wanted.display());
    }

    /// Where the recording is written.
    pub fn recording(&self) -> &Path {
        &self.recording
    }

    /// Where the true trajectory is written, if it is.
    pub fn truth(&self) -> Option<&Path> {
        self.truth.as_deref()
    }

    /// Moves the complete files to the names that they replace; returns the final names.
    ///
    /// # Errors
    /// When they cannot be moved.
    pub fn finish(mut self) -> anyhow::Result<(PathBuf, Option<PathBuf>)> {
        self.is_finished = true;
        let Some(wanted) = self.replaces.take() else { return Ok((self.recording.clone(), self.truth.clone())) };
        let truth = self.truth.as_ref().map(|from| (from, truth_of(&wanted)));
        for (from, to) in truth.iter().map(|(from, to)| (*from, to)).chain([(&self.recording, &wanted)]) {
            std::fs::rename(from, to)
                .with_context(|| format!("{} cannot be moved to {}", from.display(), to.display()))?;
        }
        Ok((wanted.clone(), truth.map(|(_, truth)| truth)))
    }
}

impl Drop for RecordingFiles {
    /// Removes the files of a run that failed before it wrote anything.
    fn drop(&mut self) {
        for path in [&self.recording].into_iter().chain(&self.truth).filter(|_| !self.is_finished) {
            if std::fs::metadata(path).is_ok_and(|file| file.len() == 0) {
                // A file that cannot be removed is empty and harmless.
                let _ = std::fs::remove_file(path);
            }
        }
    }
}

/// Creates an empty file; `false` if the name exists, even as a dangling link.
fn is_created(path: &Path) -> anyhow::Result<bool> {
    match OpenOptions::new().write(true).create_new(true).open(path) {
        Ok(_) => Ok(true),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(false),
        Err(error) => Err(error).with_context(|| format!("{} cannot be created", path.display())),
    }
}

fn truth_of(recording: &Path) -> PathBuf {
    recording.with_extension("tum")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neither_file_replaces_one_that_exists() {
        let here = tempfile::tempdir().unwrap();
        let wanted = here.path().join("run.mcap");
        std::fs::write(here.path().join("run.tum"), "foreign").unwrap();
        let first = RecordingFiles::reserve(&wanted, true, false, &[]).unwrap();
        let second = RecordingFiles::reserve(&wanted, true, false, &[]).unwrap();
        assert_eq!(first.recording(), here.path().join("run-2.mcap"));
        assert_eq!(second.recording(), here.path().join("run-3.mcap"));
        assert_eq!(second.truth(), Some(here.path().join("run-3.tum").as_path()));
        drop((first, second));
        assert_eq!(std::fs::read_dir(here.path()).unwrap().count(), 1, "empty files are removed");
        let without_truth = RecordingFiles::reserve(&wanted, false, false, &[]).unwrap();
        assert_eq!(
            (without_truth.recording(), without_truth.truth()),
            (here.path().join("run-2.mcap").as_path(), None)
        );
        std::fs::write(&wanted, "old").unwrap();
        assert!(RecordingFiles::reserve(&wanted, false, true, &[]).is_err(), "the truth next to it is another's");
        assert!(RecordingFiles::reserve(&here.path().join("y.tum"), true, true, &[]).is_err());
        assert!(RecordingFiles::reserve(Path::new(""), true, false, &[]).is_err());
    }

    #[test]
    fn with_force_the_old_files_last_until_the_new_ones_are_complete() {
        let here = tempfile::tempdir().unwrap();
        let wanted = here.path().join("run.mcap");
        let old = here.path().join("run.tum");
        std::fs::write(&old, "old").unwrap();
        let files = RecordingFiles::reserve(&wanted, true, true, &[]).unwrap();
        std::fs::write(files.recording(), "new recording").unwrap();
        std::fs::write(files.truth().unwrap(), "new").unwrap();
        assert_eq!(std::fs::read_to_string(&old).unwrap(), "old");
        assert_eq!(files.finish().unwrap(), (wanted.clone(), Some(old.clone())));
        assert_eq!(std::fs::read_to_string(&old).unwrap(), "new");
        assert_eq!(std::fs::read_dir(here.path()).unwrap().count(), 2);
        let error = RecordingFiles::reserve(&wanted, true, true, &[old]).err().unwrap();
        assert!(error.to_string().contains("would be replaced"), "{error}");
    }
}
