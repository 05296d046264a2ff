//! Storage of an experiment's finished parts, so that it can be resumed.

use crate::spec::{self, Source};
use crate::study::StudyError;
use crate::study::atomic_file::{PARTIAL_PREFIX, write_text};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// File with the inputs of the experiment; compared before it is resumed.
const INPUTS_FILE: &str = "made_from.ron";

/// Folder of an experiment, with its finished parts under `parts/`.
///
/// Files are written atomically, so that the experiment can be stopped at any time.
#[derive(Debug)]
pub(in crate::study) struct PartStore {
    folder: PathBuf,
}

impl PartStore {
    /// Opens the folder of an experiment with these inputs, or creates it.
    ///
    /// Finished parts of the same experiment are kept. With `anew` an experiment with other inputs is deleted.
    ///
    /// # Errors
    /// If the folder contains another experiment or other files, or if it cannot be created.
    pub fn open<T: Serialize>(folder: &Path, experiment_inputs: &T, anew: bool) -> Result<Self, StudyError> {
        let store = Self { folder: folder.to_owned() };
        let text = spec::to_text(experiment_inputs)? + "\n";
        match stored_inputs(folder)? {
            Some(found) if found == text && !anew => {
                store.remove_partial_files()?;
                return Ok(store);
            }
            Some(_) if anew => std::fs::remove_dir_all(folder).map_err(StudyError::file(folder))?,
            Some(_) => return Err(StudyError::FolderMismatch { folder: folder.to_owned() }),
            None if is_occupied(folder) => return Err(StudyError::FolderMismatch { folder: folder.to_owned() }),
            None => {}
        }
        store.write(INPUTS_FILE, &text)?;
        Ok(store)
    }

    /// Removes partial files of a killed run.
    fn remove_partial_files(&self) -> Result<(), StudyError> {
        for folder in [self.folder.clone(), self.folder.join("parts")] {
            let Ok(entries) = std::fs::read_dir(&folder) else { continue };
            for entry in entries {
                let path = entry.map_err(StudyError::file(&folder))?.path();
                if is_partial(&path) {
                    std::fs::remove_file(&path).map_err(StudyError::file(&path))?;
                }
            }
        }
        Ok(())
    }

    /// Opens the folder if it contains an experiment with these inputs.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn existing<T: Serialize>(folder: &Path, experiment_inputs: &T) -> Result<Option<Self>, StudyError> {
        let text = spec::to_text(experiment_inputs)? + "\n";
        Ok((stored_inputs(folder)? == Some(text)).then(|| Self { folder: folder.to_owned() }))
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Whether the part `name` is finished.
    pub fn has(&self, name: &str) -> bool {
        self.path_of(name).is_file()
    }

    /// Returns the part `name`; computes and stores it first if it is not finished.
    ///
    /// The part is always read back from its file, so that interrupted and uninterrupted runs use identical values.
    ///
    /// # Errors
    /// If the part cannot be computed, written or parsed.
    pub fn part<T: Serialize + DeserializeOwned>(
        &self,
        name: &str,
        compute: impl FnOnce() -> Result<T, StudyError>,
    ) -> Result<T, StudyError> {
        if !self.has(name) {
            self.write(&format!("parts/{name}.ron"), &spec::to_text(&compute()?)?)?;
        }
        self.get(name)
    }

    /// Reads the finished part `name`.
    ///
    /// # Errors
    /// If its file cannot be read or parsed.
    pub fn get<T: DeserializeOwned>(&self, name: &str) -> Result<T, StudyError> {
        Ok(spec::parse(&Source::read(&self.path_of(name))?)?)
    }

    fn path_of(&self, name: &str) -> PathBuf {
        self.folder.join("parts").join(format!("{name}.ron"))
    }

    /// Writes a file in the folder atomically.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, name: &str, text: &str) -> Result<(), StudyError> {
        let path = self.folder.join(name);
        let parent = path.parent().unwrap_or(&self.folder);
        std::fs::create_dir_all(parent).map_err(StudyError::file(parent))?;
        write_text(parent, &path, text)
    }
}

/// Inputs of the experiment in a folder as text; `None` if there is none.
fn stored_inputs(folder: &Path) -> Result<Option<String>, StudyError> {
    let path = folder.join(INPUTS_FILE);
    match std::fs::read_to_string(&path) {
        Ok(found) => Ok(Some(found)),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        Err(error) => Err(StudyError::file(&path)(error)),
    }
}

/// Whether a folder contains anything but partial files.
fn is_occupied(folder: &Path) -> bool {
    let is_content = |entry: std::io::Result<std::fs::DirEntry>| entry.map_or(true, |entry| !is_partial(&entry.path()));
    std::fs::read_dir(folder).is_ok_and(|mut entries| entries.any(is_content))
}

/// Whether a file is a partial file of a killed writer.
fn is_partial(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(PARTIAL_PREFIX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finished_parts_are_reused_and_other_files_are_preserved() {
        let here = tempfile::tempdir().unwrap();
        let folder = here.path().join("work");
        let store = PartStore::open(&folder, &"one", false).unwrap();
        assert_eq!(store.part("a", || Ok(0.1 + 0.2)).unwrap(), 0.1 + 0.2);
        // A killed run leaves a partial file, which is neither a part nor a foreign file.
        std::fs::write(folder.join(format!("parts/{PARTIAL_PREFIX}b")), "half of").unwrap();
        let interrupted = here.path().join("begun");
        std::fs::create_dir(&interrupted).unwrap();
        std::fs::write(interrupted.join(format!("{PARTIAL_PREFIX}c")), "half of").unwrap();
        PartStore::open(&interrupted, &"one", false).unwrap();
        let again = PartStore::open(&folder, &"one", false).unwrap();
        assert_eq!(again.part("a", || Ok(7.0)).unwrap(), 0.1 + 0.2);
        assert_eq!(again.part("b", || Ok(7.0)).unwrap(), 7.0);

        let error = PartStore::open(&folder, &"two", false).unwrap_err();
        assert!(error.to_string().contains("--force"), "{error}");
        let anew = PartStore::open(&folder, &"two", true).unwrap();
        assert!(!anew.has("a"));
        // A folder that is not an experiment's is never deleted.
        let foreign = here.path().join("foreign");
        std::fs::create_dir(&foreign).unwrap();
        std::fs::write(foreign.join("thesis.tex"), "years").unwrap();
        assert!(PartStore::open(&foreign, &"one", true).is_err());
        assert!(foreign.join("thesis.tex").is_file());
    }
}
