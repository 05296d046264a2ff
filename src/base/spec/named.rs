//! Specs that a run refers to by name.

use super::{Kind, Source, SpecError, find};
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// A spec that a run refers to by name.
pub trait NamedSpec: Serialize + DeserializeOwned + JsonSchema {
    /// Kind of the spec; it determines the folder in the library.
    const KIND: Kind;

    /// Why a spec, or a file that it includes, is invalid.
    type Error: From<SpecError>;

    /// Parses the text of a spec: [`parse_named`](super::parse_named), compiled in the room of the spec, once for all that read it.
    ///
    /// # Errors
    /// As [`parse`](super::parse).
    fn parse(source: &Source) -> Result<Self, SpecError>;

    /// Builds the model that the spec, read from `source`, describes, as a run does; returns warnings.
    ///
    /// # Errors
    /// If values contradict each other, or if a file is missing or invalid.
    fn check_model(&self, source: &Source) -> Result<Vec<String>, SpecError>;

    /// The spec with the content of the files that it includes.
    ///
    /// # Errors
    /// If a file is missing or invalid.
    fn resolved(self, _source: &Source) -> Result<Self, Self::Error> {
        Ok(self)
    }
}

/// A self-contained spec, with its name and the folder that its file paths are relative to.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Named<T> {
    /// Name as given: a path, or a name in the library.
    pub name: String,
    /// Folder of meshes and recorded motions; `None` for a built-in spec.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub folder: Option<PathBuf>,
    /// The spec.
    pub spec: T,
    /// Text of the spec, for positions in errors; `None` if the spec was modified or stored.
    #[serde(skip)]
    source: Option<Source>,
}

impl<T: PartialEq> PartialEq for Named<T> {
    fn eq(&self, other: &Self) -> bool {
        (&self.name, &self.folder, &self.spec) == (&other.name, &other.folder, &other.spec)
    }
}

impl<T: NamedSpec> Named<T> {
    /// Finds and parses the spec `name`.
    ///
    /// # Errors
    /// If the spec, or a file that it includes, is missing or invalid.
    pub fn load(name: &str) -> Result<Self, T::Error> {
        Ok(Self { name: name.to_owned(), ..Self::parse(find(T::KIND, name)?)? })
    }

    /// Parses `source`; the name is that of the source.
    ///
    /// # Errors
    /// As [`Named::load`].
    pub fn parse(source: Source) -> Result<Self, T::Error> {
        let spec = T::parse(&source)?.resolved(&source)?;
        let folder = source.folder.as_ref().map(|folder| folder.canonicalize().unwrap_or_else(|_| folder.clone()));
        Ok(Self { name: source.name.clone(), folder, spec, source: Some(source) })
    }
}

impl<T> Named<T> {
    /// A spec that is not from a file.
    pub fn in_memory(name: impl Into<String>, spec: T) -> Self {
        Self { name: name.into(), folder: None, spec, source: None }
    }

    /// Source for error messages and relative paths.
    pub fn source(&self) -> Source {
        let stored = || Source { name: self.name.clone(), folder: self.folder.clone(), text: String::new() };
        self.source.clone().unwrap_or_else(stored)
    }
}
