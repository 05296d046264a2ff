use std::fmt;

/// A position in the text: line and column, from 1.
pub(super) type Position = (usize, usize);

/// An error of a YAML document, with its line and column if they are known.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct YamlError {
    message: String,
    position: Option<Position>,
}

impl YamlError {
    pub(super) fn new(message: impl Into<String>, position: Position) -> Self {
        Self { message: message.into(), position: Some(position) }
    }

    /// The error, at `position` unless it has a position already.
    pub(super) fn at(self, position: Position) -> Self {
        Self { position: self.position.or(Some(position)), ..self }
    }
}

impl fmt::Display for YamlError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)?;
        self.position.map_or(Ok(()), |(line, column)| write!(f, " at line {line}, column {column}"))
    }
}

impl std::error::Error for YamlError {}

impl serde::de::Error for YamlError {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self { message: message.to_string(), position: None }
    }
}
