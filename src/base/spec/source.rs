//! The text of a spec.

use std::path::PathBuf;

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
}
