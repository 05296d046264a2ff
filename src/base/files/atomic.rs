//! Files that appear under the final name only when they are complete.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// A file or folder could not be read, created or written.
#[derive(Debug, thiserror::Error)]
#[error("{}: {source}", path.display())]
pub struct FileError {
    /// Path of the file or folder.
    pub path: PathBuf,
    /// Error of the operating system.
    pub source: std::io::Error,
}

impl FileError {
    /// Returns the conversion of an error of the operating system at `path`.
    pub fn at(path: &Path) -> impl FnOnce(std::io::Error) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self { path, source }
    }
}

/// Name prefix of incomplete files; a killed process can leave them in the folder, and the next run removes them.
pub const PARTIAL_PREFIX: &str = ".partial-";

/// A temporary file that replaces the target file when it is complete.
pub struct AtomicFile {
    file: NamedTempFile,
    target: PathBuf,
}

impl AtomicFile {
    /// Creates a temporary file for `target` in `folder`, which must be on the same file system.
    ///
    /// # Errors
    /// When it cannot be created.
    pub fn new(folder: &Path, target: &Path) -> Result<Self, FileError> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(PARTIAL_PREFIX);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(std::fs::Permissions::from_mode(0o644));
        }
        let file = builder.tempfile_in(folder).map_err(FileError::at(folder))?;
        Ok(Self { file, target: target.to_owned() })
    }

    /// Returns the temporary file.
    pub fn file(&mut self) -> &mut File {
        self.file.as_file_mut()
    }

    /// Path of the complete file.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Flushes the file to disk and renames it to the target; an existing target is replaced.
    ///
    /// # Errors
    /// When it cannot be written or renamed.
    pub fn finish(self) -> Result<(), FileError> {
        self.file.as_file().sync_all().map_err(FileError::at(&self.target))?;
        self.file.persist(&self.target).map(drop).map_err(|error| FileError::at(&self.target)(error.error))
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}

/// Writes a text file atomically, with the temporary file next to it.
///
/// # Errors
/// When the folder or the file cannot be written.
pub fn replace_text(target: &Path, text: &str) -> Result<(), FileError> {
    replace_bytes(target, text.as_bytes())
}

/// Writes a file atomically, with the temporary file next to it.
///
/// # Errors
/// When the folder or the file cannot be written.
pub fn replace_bytes(target: &Path, bytes: &[u8]) -> Result<(), FileError> {
    let folder = target.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    write_bytes(folder, target, bytes)
}

/// Writes a text file atomically, with the temporary file in `folder`.
///
/// # Errors
/// When the file cannot be written.
pub fn write_text(folder: &Path, target: &Path, text: &str) -> Result<(), FileError> {
    write_bytes(folder, target, text.as_bytes())
}

/// Writes a file atomically, with the temporary file in `folder`.
///
/// # Errors
/// When the file cannot be written.
pub fn write_bytes(folder: &Path, target: &Path, bytes: &[u8]) -> Result<(), FileError> {
    let mut partial = AtomicFile::new(folder, target)?;
    partial.write_all(bytes).map_err(FileError::at(target))?;
    partial.finish()
}
