use super::{Missing, Position, Source};
use std::fmt;

/// An error in a spec: file, position, message, and remedy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SpecError {
    file: String,
    place: Option<Place>,
    message: Box<str>,
    help: Option<Box<str>>,
    /// The key at fault.
    key: Option<Box<KeyFault>>,
}

/// A key at fault, from which [`parse`](super::parse) finds a remedy.
#[derive(Debug, Clone, PartialEq, Eq)]
enum KeyFault {
    /// The type does not have this key.
    Unknown(String),
    /// The text does not have it.
    Missing(Missing),
}

/// A position, and the line of the text that contains it.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Place {
    position: Position,
    text: String,
}

impl SpecError {
    /// An error about a file as a whole.
    pub fn plain(file: impl Into<String>, message: impl Into<String>) -> Self {
        Self { file: file.into(), place: None, message: message.into().into_boxed_str(), help: None, key: None }
    }

    /// An error at a position in the text of a spec.
    pub fn at(source: &Source, position: Position, message: impl Into<String>) -> Self {
        let text = source.text.lines().nth(position.line.saturating_sub(1)).unwrap_or_default().to_owned();
        let place = Place { position, text };
        Self { place: Some(place), ..Self::plain(&source.name, message) }
    }

    /// An error at the first occurrence of `key` in the text of a spec, for inconsistencies between several fields.
    pub fn about(source: &Source, key: &str, message: impl Into<String>) -> Self {
        let found = source.text.lines().enumerate().find_map(|(index, line)| Some((index, word_in(line, key)?)));
        match found {
            Some((line, column)) => Self::at(source, Position { line: line + 1, column: column + 1 }, message),
            None => Self::plain(source.name.clone(), message),
        }
    }

    /// An error at the first occurrence of `words` after `anchor` in the text of a spec; at `anchor` if there is none.
    /// For keys that occur in several similar parts.
    pub fn about_after(source: &Source, anchor: &str, words: &str, message: impl Into<String>) -> Self {
        let Some(start) = source.text.find(anchor) else { return Self::plain(source.name.clone(), message) };
        let offset = source.text[start..].find(words).map_or(start, |after| start + after);
        Self::at(source, Position::of_offset(&source.text, offset), message)
    }

    /// Adds a remedy to the error.
    #[must_use]
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into().into_boxed_str());
        self
    }

    /// Marks the error as a key that the type does not have.
    pub(super) fn with_unknown_key(self, key: Option<&str>) -> Self {
        Self { key: key.map(|key| Box::new(KeyFault::Unknown(key.to_owned()))).or(self.key), ..self }
    }

    /// The key that the type does not have, if this is the error.
    pub fn unknown_key(&self) -> Option<&str> {
        match self.key.as_deref()? {
            KeyFault::Unknown(key) => Some(key),
            KeyFault::Missing(_) => None,
        }
    }

    /// Marks the error as keys that the text does not have.
    pub(super) fn with_missing(self, missing: Option<Missing>) -> Self {
        Self { key: missing.map(|missing| Box::new(KeyFault::Missing(missing))).or(self.key), ..self }
    }

    /// The keys that the text does not have, if this is the error.
    pub(super) fn missing(&self) -> Option<&Missing> {
        match self.key.as_deref()? {
            KeyFault::Missing(missing) => Some(missing),
            KeyFault::Unknown(_) => None,
        }
    }

    /// The same error with another message.
    pub(super) fn with_message(self, message: String) -> Self {
        Self { message: message.into_boxed_str(), ..self }
    }

    /// Line and column, from 1, if known.
    pub fn line_and_column(&self) -> Option<(usize, usize)> {
        self.place.as_ref().map(|place| (place.position.line, place.position.column))
    }

    /// The message without the position.
    pub fn message(&self) -> &str {
        &self.message
    }
}

/// Byte offset of `key` in `line` as a separate word, comments excluded.
fn word_in(line: &str, key: &str) -> Option<usize> {
    let code = line.split("//").next().unwrap_or_default();
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    code.match_indices(key).map(|(at, _)| at).find(|at| {
        let before = code[..*at].chars().next_back().is_some_and(is_word);
        let after = code[at + key.len()..].chars().next().is_some_and(is_word);
        !before && !after
    })
}

impl fmt::Display for SpecError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.place {
            None => write!(f, "{}: {}", self.file, self.message)?,
            Some(Place { position: Position { line, column }, text }) => {
                let margin = line.to_string();
                // Of a long line (a mesh in one row) only the part near the position is shown.
                let start = column.saturating_sub(60);
                let shown: String = text.chars().skip(start).take(110).collect();
                writeln!(f, "{}:{line}:{column}: {}", self.file, self.message)?;
                writeln!(f, " {margin} | {shown}")?;
                write!(f, " {:margin$} | {:indent$}^", "", "", margin = margin.len(), indent = column - 1 - start)?;
            }
        }
        if let Some(help) = &self.help {
            write!(f, "\n help: {help}")?;
        }
        Ok(())
    }
}

impl std::error::Error for SpecError {}
