//! Where results go: folders that are not overwritten, and stdout.

use super::arguments::Global;
use anyhow::{Context, bail};
use serde_json::Value;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Most numbered siblings that are tried.
const SIBLINGS: u32 = 10_000;

/// A folder for results, made: `wanted`, or if that exists with something in it, `wanted-2`, `wanted-3`, ...
pub(super) fn folder(wanted: &Path, force: bool) -> anyhow::Result<PathBuf> {
    if let Some(parent) = wanted.parent() {
        std::fs::create_dir_all(parent).with_context(|| format!("{} cannot be made", parent.display()))?;
    }
    for candidate in candidates(wanted) {
        match std::fs::create_dir(&candidate) {
            Ok(()) => return Ok(candidate),
            Err(error) if error.kind() != ErrorKind::AlreadyExists => {
                return Err(error).with_context(|| format!("{} cannot be made", candidate.display()));
            }
            Err(_) => {}
        }
        if candidate.is_dir() && (force || is_empty(&candidate)?) {
            return Ok(candidate);
        }
        if force {
            bail!("{} is there and no folder", candidate.display());
        }
    }
    bail!("{} and thousands of numbered ones are there already", wanted.display());
}

/// A file for results, not there yet: `wanted`, or `wanted` with a number before its ending.
pub(super) fn file(wanted: &Path, force: bool) -> anyhow::Result<PathBuf> {
    if let Some(parent) = wanted.parent() {
        std::fs::create_dir_all(parent).with_context(|| format!("{} cannot be made", parent.display()))?;
    }
    let mut candidates = candidates(wanted);
    match candidates.find(|candidate| force || !candidate.exists()) {
        Some(path) if path.is_dir() => bail!("{} is a folder; the recording needs a file's name", path.display()),
        Some(path) => Ok(path),
        None => bail!("{} and thousands of numbered ones are there already", wanted.display()),
    }
}

/// `a/b.c`, `a/b-2.c`, `a/b-3.c`, ...
fn candidates(wanted: &Path) -> impl Iterator<Item = PathBuf> + '_ {
    let ending = wanted.extension().map(|ending| format!(".{}", ending.to_string_lossy())).unwrap_or_default();
    let stem = wanted.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let numbered = move |number: u32| wanted.with_file_name(format!("{stem}-{number}{ending}"));
    std::iter::once(wanted.to_path_buf()).chain((2..SIBLINGS).map(numbered))
}

fn is_empty(folder: &Path) -> anyhow::Result<bool> {
    let mut entries = std::fs::read_dir(folder).with_context(|| format!("{} cannot be read", folder.display()))?;
    Ok(entries.next().is_none())
}

/// Prints a command's result: words, or with `--json` the figures; where it wrote is the last line, or the key `out`.
pub(super) fn tell(global: &Global, words: &str, mut figures: Value, out: Option<&Path>) -> anyhow::Result<()> {
    let out = out.map(|path| path.display().to_string());
    if global.json {
        if let (Some(out), Some(object)) = (out, figures.as_object_mut()) {
            object.insert("out".to_owned(), Value::String(out));
        }
        return print(&(serde_json::to_string_pretty(&figures)? + "\n"));
    }
    let words = if words.is_empty() { String::new() } else { format!("{}\n", words.trim_end()) };
    print(&(words + &out.map(|out| out + "\n").unwrap_or_default()))
}

/// Prints to stdout; a reader that went away is no error.
pub(super) fn print(text: &str) -> anyhow::Result<()> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error).context("stdout cannot be written"),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_with_something_in_it_is_left_alone() {
        let here = tempfile::tempdir().unwrap();
        let wanted = here.path().join("deep/run");
        assert_eq!(folder(&wanted, false).unwrap(), wanted);
        assert_eq!(folder(&wanted, false).unwrap(), wanted, "an empty one is as good as none");
        std::fs::write(wanted.join("x"), "").unwrap();
        assert_eq!(folder(&wanted, false).unwrap(), here.path().join("deep/run-2"));
        assert_eq!(folder(&wanted, true).unwrap(), wanted);
    }

    #[test]
    fn a_file_that_is_there_gets_a_numbered_sibling() {
        let here = tempfile::tempdir().unwrap();
        let wanted = here.path().join("a.b.mcap");
        assert_eq!(file(&wanted, false).unwrap(), wanted);
        std::fs::write(&wanted, "").unwrap();
        assert_eq!(file(&wanted, false).unwrap(), here.path().join("a.b-2.mcap"));
        assert_eq!(file(&wanted, true).unwrap(), wanted);
        assert!(file(here.path(), true).is_err());
    }
}
