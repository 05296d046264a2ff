//! Files that are there whole or not at all.

use super::StudyError;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// How the names begin of files that are not whole yet: what a kill leaves of them is nobody's work.
pub(super) const PARTIAL: &str = ".partial-";

/// A file that is written beside its place, and moved there when it is whole.
pub(super) struct Beside {
    file: NamedTempFile,
    place: PathBuf,
}

impl Beside {
    /// A file for `place`, until it is whole in `folder` of the same file system.
    pub fn new(folder: &Path, place: &Path) -> Result<Self, StudyError> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(PARTIAL);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(std::fs::Permissions::from_mode(0o644));
        }
        let file = builder.tempfile_in(folder).map_err(StudyError::file(folder))?;
        Ok(Self { file, place: place.to_owned() })
    }

    pub fn file(&mut self) -> &mut File {
        self.file.as_file_mut()
    }

    /// Its place.
    pub fn place(&self) -> &Path {
        &self.place
    }

    /// Moves the file to its place, where it replaces what is there.
    pub fn finish(self) -> Result<(), StudyError> {
        self.file.as_file().sync_all().map_err(StudyError::file(&self.place))?;
        self.file.persist(&self.place).map(drop).map_err(|error| StudyError::file(&self.place)(error.error))
    }
}

impl Write for Beside {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}

/// Writes a text whole or not at all.
pub(super) fn write_text(folder: &Path, place: &Path, text: &str) -> Result<(), StudyError> {
    let mut beside = Beside::new(folder, place)?;
    beside.write_all(text.as_bytes()).map_err(StudyError::file(place))?;
    beside.finish()
}
