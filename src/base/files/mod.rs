//! Files that are read, and files and folders of results: nothing is written or removed through a link inside a folder of
//! results.
//!
//! The folder that the user names may itself be a link. A link inside it was not made by zsim, and what it points to does
//! not belong to the results.

mod atomic;

pub use atomic::{AtomicFile, FileError, PARTIAL_PREFIX, replace_bytes, replace_text, write_bytes, write_text};
use std::fs::{File, FileType};
use std::io::{Error, ErrorKind, Result};
use std::path::{Component, Path, PathBuf};

/// Creates a file at `path`; an existing file is emptied, a symbolic or hard link is replaced.
///
/// # Errors
/// When the file cannot be created.
pub fn create(path: &Path) -> Result<File> {
    if std::fs::symlink_metadata(path).is_ok_and(|found| found.is_symlink() || is_linked_file(&found)) {
        std::fs::remove_file(path)?;
    }
    File::create(path)
}

/// Opens the file at `path` for reading, if it is a regular file or a link to one.
///
/// Opening a FIFO waits for a writer, and devices have no end.
///
/// # Errors
/// When there is no regular file at `path`, or it cannot be opened.
pub fn open(path: &Path) -> Result<File> {
    let kind = std::fs::metadata(path)?.file_type();
    if kind.is_file() {
        return File::open(path);
    }
    let found = kind_name(kind);
    Err(Error::new(ErrorKind::InvalidInput, format!("is {found}, not a regular file; specify a file on disk")))
}

/// Name of a kind of file, with its article.
fn kind_name(kind: FileType) -> &'static str {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if kind.is_fifo() {
            return "a FIFO (pipe)";
        }
        if kind.is_socket() {
            return "a socket";
        }
        if kind.is_block_device() || kind.is_char_device() {
            return "a device";
        }
    }
    if kind.is_dir() { "a folder" } else { "a special file" }
}

/// Whether a file has further names: hard links.
#[cfg(unix)]
fn is_linked_file(found: &std::fs::Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    found.is_file() && found.nlink() > 1
}

#[cfg(not(unix))]
fn is_linked_file(_: &std::fs::Metadata) -> bool {
    false
}

/// Creates the subfolder `name` of a folder of results, and the folders between them.
///
/// # Errors
/// When it cannot be created, or one of these folders is a link.
pub fn subfolder(folder: &Path, name: impl AsRef<Path>) -> Result<PathBuf> {
    let path = check_subfolder(folder, name.as_ref())?;
    match std::fs::create_dir_all(&path) {
        Ok(()) => Ok(path),
        Err(error) => Err(Error::new(error.kind(), format!("{} cannot be created: {error}", path.display()))),
    }
}

/// Returns the path of the file `name` in a folder of results, with or without folders between them.
///
/// # Errors
/// When a folder between them is a link.
pub fn inside(folder: &Path, name: impl AsRef<Path>) -> Result<PathBuf> {
    let name = name.as_ref();
    check_subfolder(folder, name.parent().unwrap_or(Path::new("")))?;
    Ok(folder.join(name))
}

/// Returns the path of the subfolder `name`, which need not exist.
///
/// # Errors
/// When it or a folder between them is a link, or is not in `folder`.
pub fn check_subfolder(folder: &Path, name: &Path) -> Result<PathBuf> {
    let mut path = folder.to_owned();
    for part in name.components() {
        path.push(match part {
            Component::Normal(part) => part,
            _ => return Err(Error::new(ErrorKind::InvalidInput, format!("{} leaves the folder", name.display()))),
        });
        if std::fs::symlink_metadata(&path).is_ok_and(|found| found.is_symlink()) {
            let link = path.display();
            let message = format!(
                "{link} is a link, and nothing is written through links in a folder of results: remove it, or use \
                 another folder"
            );
            return Err(Error::other(message));
        }
    }
    Ok(path)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::io::Write;
    use std::os::unix::fs::symlink;

    #[test]
    fn a_link_in_place_of_a_file_is_replaced_and_its_target_stays() {
        let here = tempfile::tempdir().unwrap();
        let (target, symbolic, hard) =
            (here.path().join("target"), here.path().join("symbolic"), here.path().join("hard"));
        std::fs::write(&target, "precious").unwrap();
        symlink(&target, &symbolic).unwrap();
        std::fs::hard_link(&target, &hard).unwrap();
        for path in [&symbolic, &hard] {
            create(path).unwrap().write_all(b"new").unwrap();
            assert_eq!(std::fs::read_to_string(path).unwrap(), "new");
            assert_eq!(std::fs::read_to_string(&target).unwrap(), "precious");
        }
        create(&hard).unwrap();
        assert_eq!(std::fs::read_to_string(&hard).unwrap(), "", "an own file is emptied");
    }

    #[test]
    fn folders_devices_and_pipes_are_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let fifo = folder.path().join("fifo");
        assert!(std::process::Command::new("mkfifo").arg(&fifo).status().unwrap().success());
        for (path, found) in
            [(folder.path(), "a folder"), (Path::new("/dev/zero"), "a device"), (&fifo, "a FIFO (pipe)")]
        {
            let error = open(path).unwrap_err();
            assert_eq!(error.to_string(), format!("is {found}, not a regular file; specify a file on disk"));
        }
        assert_eq!(open(&folder.path().join("missing")).unwrap_err().kind(), ErrorKind::NotFound);
    }

    #[test]
    fn a_link_to_a_file_is_opened() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        std::fs::write(&file, "content").unwrap();
        symlink(&file, &link).unwrap();
        assert_eq!(std::io::read_to_string(open(&link).unwrap()).unwrap(), "content");
    }

    #[test]
    fn no_path_leads_through_a_link() {
        let here = tempfile::tempdir().unwrap();
        let (results, other) = (here.path().join("results"), here.path().join("other"));
        std::fs::create_dir(&other).unwrap();
        assert_eq!(subfolder(&results, "runs/7").unwrap(), results.join("runs/7"));
        assert!(results.join("runs/7").is_dir());
        symlink(&other, results.join("plots")).unwrap();
        symlink(&other, results.join("runs/8")).unwrap();
        let text = |result: Result<PathBuf>| result.unwrap_err().to_string();
        assert!(text(subfolder(&results, "plots")).contains("plots is a link"));
        assert!(text(subfolder(&results, "runs/8")).contains("runs/8 is a link"));
        assert!(text(inside(&results, "plots/a.svg")).contains("plots is a link"));
        assert!(text(inside(&results, "../other/a.svg")).contains("leaves the folder"));
        assert_eq!(inside(&results, "new/a.svg").unwrap(), results.join("new/a.svg"));
        // The folder of results itself is the user's choice.
        let linked = here.path().join("linked");
        symlink(&results, &linked).unwrap();
        assert_eq!(subfolder(&linked, "tables").unwrap(), linked.join("tables"));
    }
}
