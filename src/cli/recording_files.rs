//! The files of a simulated recording, reserved before anything is computed.

use super::output::{candidates, check_not_inputs, create_parent, exists, file_exists, in_use, lock_file};
use super::usage::Usage;
use anyhow::{Context, anyhow, bail, ensure};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use zsim_base::files;
use zsim_recording::other_format;

/// A file next to a recording, with the same name and another ending.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Companion {
    /// True trajectory.
    Truth,
    /// Layout of Foxglove.
    Layout,
    /// The head as URDF.
    HeadModel,
}

impl Companion {
    const ALL: [Self; 3] = [Self::Truth, Self::Layout, Self::HeadModel];

    fn of(self, recording: &Path) -> PathBuf {
        recording.with_extension(match self {
            Self::Truth => "tum",
            Self::Layout => "foxglove.json",
            Self::HeadModel => "urdf",
        })
    }
}

/// A recording with the files next to it, as files that only this process has created.
///
/// Files that exist are replaced only by [`finish`](Self::finish): until then the new files have temporary names, so
/// that a failed run destroys no file.
pub(super) struct RecordingFiles {
    recording: PathBuf,
    companions: Vec<Companion>,
    /// Final path of the complete recording, if it is written under a temporary name.
    replaces: Option<PathBuf>,
    is_finished: bool,
    /// Locks the recording against other processes; the system releases it when the process ends for any reason.
    _lock: File,
}

impl RecordingFiles {
    /// Reserves `wanted` and its `companions`. No file of `inputs` is ever replaced.
    ///
    /// # Errors
    /// When without `force` one of the files or another companion exists, the ending is that of another format, two of the files would be one, an input would be replaced, another process
    /// writes the files, or they cannot be created.
    pub fn reserve(wanted: &Path, companions: &[Companion], force: bool, inputs: &[PathBuf]) -> anyhow::Result<Self> {
        if let Some(same) = Companion::ALL.iter().find(|companion| is_same_name(&companion.of(wanted), wanted)) {
            let message = format!(
                "--out {}: the recording needs another ending, such as .mcap; {} is written next to it",
                wanted.display(),
                same.of(wanted).display()
            );
            return Err(Usage(message).into());
        }
        if let Some(format) = other_format(wanted) {
            let message =
                format!("--out {}: this is the ending of {format}; recordings are MCAP: use .mcap", wanted.display());
            return Err(Usage(message).into());
        }
        create_parent(wanted)?;
        let outputs: Vec<PathBuf> =
            [wanted.to_owned()].into_iter().chain(Companion::ALL.map(|companion| companion.of(wanted))).collect();
        let existing = outputs.iter().find(|path| exists(path));
        if let Some(existing) = existing.filter(|_| !force) {
            bail!(if is_locked(existing) { in_use(wanted) } else { file_exists(existing) });
        }
        if existing.is_none() {
            return Self::create(wanted, companions, None)?.ok_or_else(|| anyhow!(file_exists(wanted)));
        }
        ensure!(!is_locked(wanted), in_use(wanted));
        let truth = Companion::Truth.of(wanted);
        ensure!(
            companions.contains(&Companion::Truth) || !truth.exists(),
            "{} next to it is the true trajectory of another recording: choose another --out",
            truth.display()
        );
        let model = Companion::HeadModel.of(wanted);
        ensure!(
            !model.exists() || is_head_model(&model),
            "{} next to it was not written by zsim: choose another --out",
            model.display()
        );
        for path in &outputs {
            ensure!(!path.is_dir(), "{} is a folder; a file's name is needed", path.display());
        }
        check_not_inputs(inputs, &outputs)?;
        Self::create_partial(wanted, companions)
    }

    /// Creates the files that will replace `replaced`, under the first temporary name of which no file exists.
    fn create_partial(replaced: &Path, companions: &[Companion]) -> anyhow::Result<Self> {
        let ending = replaced.extension().map(|ending| format!(".{}", ending.to_string_lossy())).unwrap_or_default();
        for recording in candidates(&replaced.with_extension(format!("partial{ending}"))) {
            // A run that was killed leaves an unlocked file.
            ensure!(!is_locked(&recording), in_use(replaced));
            if let Some(files) = Self::create(&recording, companions, Some(replaced))? {
                return Ok(files);
            }
        }
        bail!("thousands of partial files of {} exist already", replaced.display());
    }

    /// Creates the files; `None` if one of their names is taken.
    ///
    /// [`finish`](Self::finish) then moves them to `replaces`, if given.
    fn create(recording: &Path, companions: &[Companion], replaces: Option<&Path>) -> anyhow::Result<Option<Self>> {
        let Some(lock) = create_locked(recording)? else { return Ok(None) };
        let (recording, replaces) = (recording.to_owned(), replaces.map(Path::to_owned));
        // Dropped, it removes what it has created.
        let mut files = Self { recording, companions: vec![], replaces, is_finished: false, _lock: lock };
        for companion in companions {
            if !is_created(&companion.of(&files.recording))? {
                return Ok(None);
            }
            files.companions.push(*companion);
        }
        Ok(Some(files))
    }

    /// Where the recording is written.
    pub fn recording(&self) -> &Path {
        &self.recording
    }

    /// Where a file next to the recording is written, if it is.
    pub fn companion(&self, companion: Companion) -> Option<PathBuf> {
        self.companions.contains(&companion).then(|| companion.of(&self.recording))
    }

    /// Moves the complete files to the names that they replace, and removes an old model of another head; returns the final names
    /// of the recording and of the true trajectory.
    ///
    /// # Errors
    /// When they cannot be moved.
    pub fn finish(mut self) -> anyhow::Result<(PathBuf, Option<PathBuf>)> {
        self.is_finished = true;
        let recording = self.replaces.take().unwrap_or_else(|| self.recording.clone());
        let truth = self.companions.contains(&Companion::Truth).then(|| Companion::Truth.of(&recording));
        if recording == self.recording {
            return Ok((recording, truth));
        }
        for companion in Companion::ALL {
            let (from, to) = (companion.of(&self.recording), companion.of(&recording));
            if self.companions.contains(&companion) {
                replace(&from, &to)?;
            } else if to.exists() {
                std::fs::remove_file(&to).with_context(|| format!("{} cannot be removed", to.display()))?;
            }
        }
        replace(&self.recording, &recording)?;
        Ok((recording, truth))
    }
}

impl Drop for RecordingFiles {
    /// Removes the files of a run that failed before it wrote anything.
    fn drop(&mut self) {
        if self.is_finished {
            return;
        }
        let companions = self.companions.iter().map(|companion| companion.of(&self.recording));
        for path in companions.chain([self.recording.clone()]) {
            if std::fs::metadata(&path).is_ok_and(|file| file.len() == 0) {
                // A file that cannot be removed is empty and harmless.
                let _ = std::fs::remove_file(path);
            }
        }
    }
}

/// Whether a file is a model of a head as `zsim` writes it; an empty one is of a run that was killed.
fn is_head_model(path: &Path) -> bool {
    let is_ours = |text: String| text.is_empty() || text.contains("<robot name=\"zsim_head\">");
    files::open(path).and_then(std::io::read_to_string).is_ok_and(is_ours)
}

/// Whether two paths in one folder name one file, also where case does not matter.
fn is_same_name(a: &Path, b: &Path) -> bool {
    a.to_string_lossy().eq_ignore_ascii_case(&b.to_string_lossy())
}

fn replace(from: &Path, to: &Path) -> anyhow::Result<()> {
    std::fs::rename(from, to).with_context(|| format!("{} cannot be moved to {}", from.display(), to.display()))
}

/// Creates an empty file that is locked; `None` if the name exists, even as a dangling link.
fn create_locked(path: &Path) -> anyhow::Result<Option<File>> {
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let failed = || format!("{} cannot be created", path.display());
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // It gets its name when it is locked, so that no other process finds it without the lock.
    let file = builder.prefix(".partial-").tempfile_in(folder).with_context(failed)?;
    lock_file(file.as_file());
    match file.persist_noclobber(path) {
        Ok(file) => Ok(Some(file)),
        Err(error) if error.error.kind() == ErrorKind::AlreadyExists => Ok(None),
        Err(error) => Err(error.error).with_context(failed),
    }
}

/// Whether another process has locked a file. Processes that only ask do not exclude each other.
fn is_locked(path: &Path) -> bool {
    let is_excluded = |file: File| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock));
    cfg!(unix) && path.is_file() && File::open(path).is_ok_and(is_excluded)
}

/// Creates an empty file; `false` if the name exists, even as a dangling link.
fn is_created(path: &Path) -> anyhow::Result<bool> {
    match OpenOptions::new().write(true).create_new(true).open(path) {
        Ok(_) => Ok(true),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(false),
        Err(error) => Err(error).with_context(|| format!("{} cannot be created", path.display())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: &[Companion] = &Companion::ALL;

    #[test]
    fn no_file_replaces_one_that_exists() {
        let here = tempfile::tempdir().unwrap();
        let wanted = here.path().join("run.mcap");
        std::fs::write(here.path().join("run.tum"), "foreign").unwrap();
        std::fs::write(here.path().join("other.urdf"), "foreign").unwrap();
        for (name, companions, taken) in [
            ("run.mcap", ALL, "run.tum exists"),
            ("run.mcap", &[], "run.tum exists"),
            ("other.mcap", &[Companion::Truth], "other.urdf exists"),
        ] {
            let error = RecordingFiles::reserve(&here.path().join(name), companions, false, &[]).err().unwrap();
            assert!(error.to_string().contains(taken), "{error}");
        }
        let free = RecordingFiles::reserve(&here.path().join("free.mcap"), ALL, false, &[]).unwrap();
        assert_eq!(free.companion(Companion::Layout), Some(here.path().join("free.foxglove.json")));
        drop(free);
        assert_eq!(std::fs::read_dir(here.path()).unwrap().count(), 2, "empty files are removed");
        std::fs::write(&wanted, "old").unwrap();
        assert!(RecordingFiles::reserve(&wanted, &[], true, &[]).is_err(), "the truth next to it is another's");
        for name in ["y.tum", "y.TUM", "y.urdf", "y.bag", "y.DB3"] {
            assert!(RecordingFiles::reserve(&here.path().join(name), ALL, true, &[]).is_err());
        }
        assert!(RecordingFiles::reserve(Path::new(""), ALL, true, &[]).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn one_process_at_a_time_replaces_a_recording() {
        let here = tempfile::tempdir().unwrap();
        let wanted = here.path().join("run.mcap");
        let reserve = |force| RecordingFiles::reserve(&wanted, ALL, force, &[]);
        let is_in_use = || reserve(true).err().unwrap().to_string().contains("run.mcap is in use by another zsim");
        let first = reserve(false).unwrap();
        assert!(is_in_use(), "the first writes it in place");
        std::fs::write(first.recording(), "first").unwrap();
        first.finish().unwrap();
        // A run that was killed has left its files.
        std::fs::write(here.path().join("run.partial.mcap"), "killed").unwrap();
        let second = reserve(true).unwrap();
        assert_eq!(second.recording(), here.path().join("run.partial-2.mcap"));
        assert!(is_in_use(), "the second will replace it");
        std::fs::write(second.recording(), "second").unwrap();
        second.finish().unwrap();
        assert_eq!(std::fs::read_to_string(&wanted).unwrap(), "second");
        assert!(reserve(true).is_ok());
    }

    #[test]
    fn with_force_the_old_files_last_until_the_new_ones_are_complete() {
        let here = tempfile::tempdir().unwrap();
        let wanted = here.path().join("run.mcap");
        let (old, model) = (here.path().join("run.tum"), here.path().join("run.urdf"));
        std::fs::write(&old, "old").unwrap();
        std::fs::write(&model, "a robot").unwrap();
        let error = RecordingFiles::reserve(&wanted, ALL, true, &[]).err().unwrap();
        assert!(error.to_string().contains("not written by zsim"), "{error}");
        std::fs::write(&model, "<robot name=\"zsim_head\">").unwrap();
        let files = RecordingFiles::reserve(&wanted, &[Companion::Truth, Companion::Layout], true, &[]).unwrap();
        std::fs::write(files.recording(), "new recording").unwrap();
        std::fs::write(files.companion(Companion::Truth).unwrap(), "new").unwrap();
        assert_eq!(std::fs::read_to_string(&old).unwrap(), "old");
        assert_eq!(files.finish().unwrap(), (wanted.clone(), Some(old.clone())));
        assert_eq!(std::fs::read_to_string(&old).unwrap(), "new");
        assert!(!model.exists(), "the new head has no model");
        assert_eq!(std::fs::read_dir(here.path()).unwrap().count(), 3);
        let error = RecordingFiles::reserve(&wanted, ALL, true, &[old]).err().unwrap();
        assert!(error.to_string().contains("would be replaced"), "{error}");
    }
}
