//! Files that are read, and files and folders of results: nothing is written or removed through a link inside a folder of
//! results.
//!
//! The folder that the user names may itself be a link. A link inside it was not made by zsim, and what it points to does
//! not belong to the results.

use std::fs::File;
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

/// Opens a file for reading.
///
/// # Errors
/// When it cannot be opened, or is a folder, a device or a pipe, which could be read without end.
pub fn open(path: &Path) -> Result<File> {
    match std::fs::metadata(path)?.is_file() {
        true => File::open(path),
        false => Err(Error::new(ErrorKind::InvalidInput, "is not a regular file")),
    }
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
