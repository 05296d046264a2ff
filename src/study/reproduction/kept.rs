//! What is finished of an experiment, on disk.

use crate::spec::{self, Source};
use crate::study::StudyError;
use crate::study::atomic_file::{PARTIAL_PREFIX, write_text};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// What the work was made from: whoever goes on with it compares.
const MADE_FROM: &str = "made_from.ron";

/// An experiment's folder, in which finished parts are kept under `parts/`.
///
/// A file appears there whole or not at all, so that the work may be stopped at any instant.
#[derive(Debug)]
pub(in crate::study) struct Kept {
    folder: PathBuf,
}

impl Kept {
    /// The folder for work made from `from`: new, or with what is finished of the same work. Work made from something
    /// else is thrown away if `anew` is set.
    ///
    /// # Errors
    /// When other work, or anything else, is there, or the folder cannot be made.
    pub fn open<T: Serialize>(folder: &Path, from: &T, anew: bool) -> Result<Self, StudyError> {
        let kept = Self { folder: folder.to_owned() };
        let text = spec::to_text(from)? + "\n";
        match made_from(folder)? {
            Some(found) if found == text && !anew => {
                kept.clear_of_unfinished()?;
                return Ok(kept);
            }
            Some(_) if anew => std::fs::remove_dir_all(folder).map_err(StudyError::file(folder))?,
            Some(_) => return Err(StudyError::FolderMismatch { folder: folder.to_owned() }),
            None if is_occupied(folder) => return Err(StudyError::FolderMismatch { folder: folder.to_owned() }),
            None => {}
        }
        kept.write(MADE_FROM, &text)?;
        Ok(kept)
    }

    /// Removes what a killed run left of files that were not whole.
    fn clear_of_unfinished(&self) -> Result<(), StudyError> {
        for folder in [self.folder.clone(), self.folder.join("parts")] {
            let Ok(entries) = std::fs::read_dir(&folder) else { continue };
            for entry in entries {
                let path = entry.map_err(StudyError::file(&folder))?.path();
                if is_unfinished(&path) {
                    std::fs::remove_file(&path).map_err(StudyError::file(&path))?;
                }
            }
        }
        Ok(())
    }

    /// The folder, if it holds work made from `from`.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn existing<T: Serialize>(folder: &Path, from: &T) -> Result<Option<Self>, StudyError> {
        let text = spec::to_text(from)? + "\n";
        Ok((made_from(folder)? == Some(text)).then(|| Self { folder: folder.to_owned() }))
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Whether the part called `name` is finished.
    pub fn has(&self, name: &str) -> bool {
        self.path_of(name).is_file()
    }

    /// The part called `name`: as it was kept, or made now. It always comes from its file, so that a run that was
    /// stopped and one that was not go on with the same bits.
    ///
    /// # Errors
    /// When it cannot be made or written, or somebody has changed its file.
    pub fn part<T: Serialize + DeserializeOwned>(
        &self,
        name: &str,
        make: impl FnOnce() -> Result<T, StudyError>,
    ) -> Result<T, StudyError> {
        if !self.has(name) {
            self.write(&format!("parts/{name}.ron"), &spec::to_text(&make()?)?)?;
        }
        self.get(name)
    }

    /// The part called `name`, which is finished.
    ///
    /// # Errors
    /// When it cannot be read, or somebody has changed its file.
    pub fn get<T: DeserializeOwned>(&self, name: &str) -> Result<T, StudyError> {
        Ok(spec::parse(&Source::read(&self.path_of(name))?)?)
    }

    fn path_of(&self, name: &str) -> PathBuf {
        self.folder.join("parts").join(format!("{name}.ron"))
    }

    /// Writes a file of the folder, whole or not at all.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, name: &str, text: &str) -> Result<(), StudyError> {
        let path = self.folder.join(name);
        let parent = path.parent().unwrap_or(&self.folder);
        std::fs::create_dir_all(parent).map_err(StudyError::file(parent))?;
        write_text(parent, &path, text)
    }
}

/// What the work in a folder was made from; `None` where there is none.
fn made_from(folder: &Path) -> Result<Option<String>, StudyError> {
    let path = folder.join(MADE_FROM);
    match std::fs::read_to_string(&path) {
        Ok(found) => Ok(Some(found)),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        Err(error) => Err(StudyError::file(&path)(error)),
    }
}

fn is_occupied(folder: &Path) -> bool {
    let is_work = |entry: std::io::Result<std::fs::DirEntry>| entry.map_or(true, |entry| !is_unfinished(&entry.path()));
    std::fs::read_dir(folder).is_ok_and(|mut entries| entries.any(is_work))
}

/// Whether a file was not whole when its writer ended.
fn is_unfinished(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(PARTIAL_PREFIX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_finished_is_not_made_again_and_other_work_is_left_alone() {
        let here = tempfile::tempdir().unwrap();
        let folder = here.path().join("work");
        let kept = Kept::open(&folder, &"one", false).unwrap();
        assert_eq!(kept.part("a", || Ok(0.1 + 0.2)).unwrap(), 0.1 + 0.2);
        // A run that was killed leaves a file that is not whole; it is no part, and no other work.
        std::fs::write(folder.join(format!("parts/{PARTIAL_PREFIX}b")), "half of").unwrap();
        let begun = here.path().join("begun");
        std::fs::create_dir(&begun).unwrap();
        std::fs::write(begun.join(format!("{PARTIAL_PREFIX}c")), "half of").unwrap();
        Kept::open(&begun, &"one", false).unwrap();
        let again = Kept::open(&folder, &"one", false).unwrap();
        assert_eq!(again.part("a", || Ok(7.0)).unwrap(), 0.1 + 0.2);
        assert_eq!(again.part("b", || Ok(7.0)).unwrap(), 7.0);

        let error = Kept::open(&folder, &"two", false).unwrap_err();
        assert!(error.to_string().contains("--force"), "{error}");
        let anew = Kept::open(&folder, &"two", true).unwrap();
        assert!(!anew.has("a"));
        // A folder that is nobody's work is not thrown away even so.
        let foreign = here.path().join("foreign");
        std::fs::create_dir(&foreign).unwrap();
        std::fs::write(foreign.join("thesis.tex"), "years").unwrap();
        assert!(Kept::open(&foreign, &"one", true).is_err());
        assert!(foreign.join("thesis.tex").is_file());
    }
}
