//! Output of results: folders and files that are not overwritten, and stdout.

use super::arguments::Global;
use super::completion::Completion;
use super::usage::Usage;
use anyhow::{Context, anyhow, bail, ensure};
use serde_json::Value;
use std::fs::{File, TryLockError};
use std::io::{ErrorKind, Write};
use std::ops::Deref;
use std::path::{Path, PathBuf};
use zsim_base::printable::{printable, printable_json};

/// Maximum number that is appended to a name.
const MAX_NUMBER: u32 = 10_000;

/// A folder for results, locked against other processes while this value exists.
pub(super) struct Folder {
    path: PathBuf,
    /// The advisory lock on the folder; the system releases it when the process ends for any reason.
    _lock: Option<File>,
}

impl Deref for Folder {
    type Target = Path;

    fn deref(&self) -> &Path {
        &self.path
    }
}

impl AsRef<Path> for Folder {
    fn as_ref(&self) -> &Path {
        &self.path
    }
}

/// Creates and locks a folder for results: `wanted`, or if that is not empty or in use, `wanted-2`, `wanted-3`, ...
///
/// # Errors
/// When it cannot be created, or with `force` when another process uses it.
pub(super) fn folder(wanted: &Path, force: bool) -> anyhow::Result<Folder> {
    create_parent(wanted)?;
    for candidate in candidates(wanted) {
        match std::fs::create_dir(&candidate) {
            Err(error) if error.kind() != ErrorKind::AlreadyExists => {
                return Err(error).with_context(|| format!("{} cannot be created", candidate.display()));
            }
            _ => {}
        }
        if !candidate.is_dir() {
            ensure!(!force, "{} exists and is not a folder", candidate.display());
            continue;
        }
        match Folder::locked(&candidate)? {
            Some(folder) if force || is_empty(&candidate)? => return Ok(folder),
            None if force => bail!(in_use(&candidate)),
            _ => {}
        }
    }
    bail!("{} and thousands of numbered folders exist already", wanted.display());
}

/// Creates and locks a folder in which an earlier run can be resumed.
///
/// # Errors
/// When it cannot be created, or another process uses it.
pub(super) fn folder_to_resume(wanted: &Path) -> anyhow::Result<Folder> {
    std::fs::create_dir_all(wanted).with_context(|| format!("{} cannot be created", wanted.display()))?;
    Folder::locked(wanted)?.ok_or_else(|| anyhow!(in_use(wanted)))
}

/// Locks a folder that several processes may use at the same time, against those that need it alone.
///
/// # Errors
/// When it cannot be read, or another process needs it alone.
pub(super) fn shared_folder(path: &Path) -> anyhow::Result<Folder> {
    Folder::locked_by(path, File::try_lock_shared)?.ok_or_else(|| anyhow!(in_use(path)))
}

/// The error for an output that another process writes.
pub(super) fn in_use(path: &Path) -> String {
    format!("{} is in use by another zsim: wait until it ends, or pass another path with --out", path.display())
}

impl Folder {
    /// Locks the folder at `path`; `None` when another process has locked it.
    ///
    /// The lock is on the folder itself, so that no lock file remains.
    fn locked(path: &Path) -> anyhow::Result<Option<Self>> {
        Self::locked_by(path, File::try_lock)
    }

    fn locked_by(path: &Path, lock: fn(&File) -> Result<(), TryLockError>) -> anyhow::Result<Option<Self>> {
        if !cfg!(unix) {
            return Ok(Some(Self { path: path.to_owned(), _lock: None }));
        }
        let handle = File::open(path).with_context(|| format!("{} cannot be read", path.display()))?;
        Ok(is_locked(&lock(&handle)).then(|| Self { path: path.to_owned(), _lock: Some(handle) }))
    }
}

/// Whether no other process has the lock. Where the system has no such locks (some network file systems), nobody has.
fn is_locked(result: &Result<(), TryLockError>) -> bool {
    !matches!(result, Err(TryLockError::WouldBlock))
}

/// Locks a file against other processes until it is closed; `false` when another process has locked it.
pub(super) fn lock_file(file: &File) -> bool {
    // On Windows a lock would also exclude other handles of this process.
    !cfg!(unix) || is_locked(&file.try_lock())
}

/// Checks that a file for results can be written to `wanted`, and creates its folder.
///
/// # Errors
/// When a folder has this name, or without `force` when a file has it.
pub(super) fn check_file(wanted: &Path, force: bool) -> anyhow::Result<()> {
    create_parent(wanted)?;
    ensure!(!wanted.is_dir(), "{} is a folder; a file's name is needed", wanted.display());
    ensure!(force || !exists(wanted), file_exists(wanted));
    Ok(())
}

/// Whether a name is taken, also by a link to nothing.
pub(super) fn exists(path: &Path) -> bool {
    path.symlink_metadata().is_ok()
}

/// The error for a file that would be replaced.
pub(super) fn file_exists(path: &Path) -> String {
    format!("{} exists: pass --force to replace it, or another name", path.display())
}

/// Creates the folder that `wanted` will be in.
pub(super) fn create_parent(wanted: &Path) -> anyhow::Result<()> {
    if wanted.file_name().is_none() {
        return Err(Usage(format!("--out \"{}\" is not a file or folder name", wanted.display())).into());
    }
    match wanted.parent() {
        Some(parent) => {
            std::fs::create_dir_all(parent).with_context(|| format!("{} cannot be created", parent.display()))
        }
        None => Ok(()),
    }
}

/// Rejects outputs that are inputs of the command, also under another name, and outputs in a folder that is an input.
///
/// # Errors
/// When there is one.
pub(super) fn check_not_inputs(
    inputs: impl IntoIterator<Item: AsRef<Path>>,
    outputs: impl IntoIterator<Item: AsRef<Path>>,
) -> anyhow::Result<()> {
    let inputs: Vec<FileIdentity> = inputs.into_iter().flat_map(|path| FileIdentity::of_all(path.as_ref())).collect();
    for output in outputs {
        let Ok(path) = output.as_ref().canonicalize() else { continue };
        ensure!(
            !path.ancestors().filter_map(FileIdentity::of).any(|identity| inputs.contains(&identity)),
            Usage(format!(
                "{} is an input of this command and would be replaced by the result: pass another path",
                output.as_ref().display()
            ))
        );
    }
    Ok(())
}

/// What identifies a file under all its names: device and inode number.
#[cfg(unix)]
#[derive(PartialEq)]
struct FileIdentity(u64, u64);

#[cfg(unix)]
impl FileIdentity {
    fn of(path: &Path) -> Option<Self> {
        use std::os::unix::fs::MetadataExt;
        std::fs::metadata(path).ok().map(|found| Self(found.dev(), found.ino()))
    }
}

/// What identifies a file: its path without links.
#[cfg(not(unix))]
#[derive(PartialEq)]
struct FileIdentity(PathBuf);

#[cfg(not(unix))]
impl FileIdentity {
    fn of(path: &Path) -> Option<Self> {
        path.canonicalize().ok().map(Self)
    }
}

impl FileIdentity {
    /// The identities of a file, or of a folder and the files in it (a recording of rosbag2).
    fn of_all(path: &Path) -> Vec<Self> {
        let files = std::fs::read_dir(path).into_iter().flatten().flatten().map(|entry| entry.path());
        files.chain([path.to_owned()]).filter_map(|path| Self::of(&path)).collect()
    }
}

/// `a/b.c`, `a/b-2.c`, `a/b-3.c`, ...
pub(super) fn candidates(wanted: &Path) -> impl Iterator<Item = PathBuf> + '_ {
    let ending = wanted.extension().map(|ending| format!(".{}", ending.to_string_lossy())).unwrap_or_default();
    let stem = wanted.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let numbered = move |number: u32| wanted.with_file_name(format!("{stem}-{number}{ending}"));
    std::iter::once(wanted.to_path_buf()).chain((2..MAX_NUMBER).map(numbered))
}

fn is_empty(folder: &Path) -> anyhow::Result<bool> {
    let mut entries = std::fs::read_dir(folder).with_context(|| format!("{} cannot be read", folder.display()))?;
    Ok(entries.next().is_none())
}

/// Prints the result of a command: text, or JSON with `--json`. The output path is the last line, or the key `out`.
pub(super) fn print_result(
    global: &Global,
    text: &str,
    mut json: Value,
    out: Option<&Path>,
) -> anyhow::Result<Completion> {
    let out = out.map(|path| path.display().to_string());
    if global.json {
        if let (Some(out), Some(object)) = (out, json.as_object_mut()) {
            object.insert("out".to_owned(), Value::String(out));
        }
        write_to_stdout(&printable_json(&(serde_json::to_string_pretty(&json)? + "\n")))?;
        return Ok(Completion::Done);
    }
    let text = if text.is_empty() { String::new() } else { format!("{}\n", text.trim_end()) };
    print(&(text + &out.map(|out| out + "\n").unwrap_or_default()))?;
    Ok(Completion::Done)
}

/// Prints to stdout, with control characters escaped.
pub(super) fn print(text: &str) -> anyhow::Result<()> {
    write_to_stdout(&printable(text))
}

/// Writes to stdout without escapes; a closed pipe is not an error.
pub(super) fn write_to_stdout(text: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error).context("stdout cannot be written"),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_is_not_empty_is_not_used() {
        let here = tempfile::tempdir().unwrap();
        let wanted = here.path().join("deep/run");
        let created =
            |force| folder(&wanted, force).map(|folder| folder.path.clone()).map_err(|error| error.to_string());
        assert_eq!(created(false).unwrap(), wanted);
        assert_eq!(created(false).unwrap(), wanted, "an empty folder is used");
        std::fs::write(wanted.join("x"), "").unwrap();
        assert_eq!(created(false).unwrap(), here.path().join("deep/run-2"));
        assert_eq!(created(true).unwrap(), wanted);
    }

    #[cfg(unix)]
    #[test]
    fn a_folder_in_use_is_not_used() {
        let here = tempfile::tempdir().unwrap();
        let wanted = here.path().join("run");
        let first = folder(&wanted, false).unwrap();
        let second = folder(&wanted, false).unwrap();
        assert_eq!((&*first, &*second), (wanted.as_path(), here.path().join("run-2").as_path()));
        for error in [folder(&wanted, true).err(), folder_to_resume(&wanted).err()] {
            assert!(error.unwrap().to_string().contains("in use by another zsim"));
        }
        drop(first);
        assert_eq!(&*folder(&wanted, true).unwrap(), wanted.as_path());
        assert_eq!(std::fs::read_dir(&wanted).unwrap().count(), 0, "a lock leaves no file");
    }

    #[test]
    fn an_input_is_not_replaced_under_another_name() {
        let here = tempfile::tempdir().unwrap();
        let input = here.path().join("a.tum");
        std::fs::write(&input, "").unwrap();
        let other_name = here.path().join(".").join("a.tum");
        assert!(check_not_inputs(std::slice::from_ref(&input), &[here.path().join("b.tum"), other_name]).is_err());
        assert!(check_not_inputs(std::slice::from_ref(&input), &[here.path().join("b.tum")]).is_ok());
        assert!(
            check_not_inputs(&[here.path().to_owned()], std::slice::from_ref(&input)).is_err(),
            "in a folder that is read"
        );
        let (folder, linked) = (here.path().join("bag"), here.path().join("linked.tum"));
        std::fs::create_dir(&folder).unwrap();
        std::fs::hard_link(&input, folder.join("bag_0.tum")).unwrap();
        std::fs::hard_link(&input, &linked).unwrap();
        if cfg!(unix) {
            assert!(check_not_inputs(&[input], std::slice::from_ref(&linked)).is_err(), "a hard link");
            assert!(check_not_inputs(&[folder], &[linked]).is_err(), "a hard link of a file in a folder that is read");
        }
    }

    #[test]
    fn an_existing_file_is_replaced_with_force_only() {
        let here = tempfile::tempdir().unwrap();
        let wanted = here.path().join("a.b.mcap");
        assert!(check_file(&wanted, false).is_ok());
        std::fs::write(&wanted, "").unwrap();
        let error = check_file(&wanted, false).unwrap_err().to_string();
        assert!(error.contains("a.b.mcap exists: pass --force"), "{error}");
        assert!(check_file(&wanted, true).is_ok());
        assert!(check_file(here.path(), true).is_err());
    }
}
