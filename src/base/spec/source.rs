//! The text of a spec.

use std::path::{Path, PathBuf};

/// The text of a spec, and the name for errors.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// Name for errors: the path as the user would type it.
    pub name: String,
    /// Folder from which relative paths in the spec are resolved; `None` for a built-in spec.
    pub folder: Option<PathBuf>,
    /// The text.
    pub text: String,
}

impl Source {
    /// A spec in memory, with `name` for errors.
    pub fn in_memory(name: impl Into<String>, text: impl Into<String>) -> Self {
        Self { name: name.into(), folder: None, text: text.into() }
    }

    /// Name of the file without the folder and the ending: `office` for `scenes/office.ron`.
    pub fn stem(&self) -> String {
        Path::new(&self.name).file_stem().unwrap_or_default().to_string_lossy().into_owned()
    }
}
