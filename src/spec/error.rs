use super::Source;
use std::fmt;

/// What is wrong with a spec, and where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SpecError {
    file: String,
    place: Option<Place>,
    message: String,
    help: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
struct Place {
    line: usize,
    column: usize,
    text: String,
}

impl SpecError {
    /// An error about a whole file.
    pub fn plain(file: impl Into<String>, message: impl Into<String>) -> Self {
        Self { file: file.into(), place: None, message: message.into(), help: None }
    }

    /// An error at a position of a spec's text.
    pub fn at(source: &Source, position: ron::error::Position, message: impl Into<String>) -> Self {
        let text = source.text.lines().nth(position.line.saturating_sub(1)).unwrap_or_default().to_owned();
        let place = Place { line: position.line, column: position.col, text };
        Self { file: source.name.clone(), place: Some(place), message: message.into(), help: None }
    }

    /// An error about the first place in a spec's text that says `key`, for what is wrong between several fields.
    pub fn about(source: &Source, key: &str, message: impl Into<String>) -> Self {
        let found = source.text.lines().enumerate().find_map(|(index, line)| Some((index, word_in(line, key)?)));
        match found {
            Some((line, col)) => Self::at(source, ron::error::Position { line: line + 1, col: col + 1 }, message),
            None => Self::plain(source.name.clone(), message),
        }
    }

    /// An error about the first place in a spec's text that says `words` after it says `anchor`; about `anchor` where
    /// it does not. For what stands in one of several alike parts.
    pub fn about_after(source: &Source, anchor: &str, words: &str, message: impl Into<String>) -> Self {
        let Some(start) = source.text.find(anchor) else { return Self::plain(source.name.clone(), message) };
        let place = source.text[start..].find(words).map_or(start, |after| start + after);
        let before = &source.text[..place];
        let col = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
        Self::at(source, ron::error::Position { line: before.matches('\n').count() + 1, col }, message)
    }

    /// The same error, with what to do about it.
    #[must_use]
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Line and column, from 1, where they are known.
    pub fn line_and_column(&self) -> Option<(usize, usize)> {
        self.place.as_ref().map(|place| (place.line, place.column))
    }

    /// What is wrong, without the place.
    pub fn message(&self) -> &str {
        &self.message
    }
}

/// Where `key` stands in `line` as a word of its own.
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
            Some(Place { line, column, text }) => {
                let margin = line.to_string();
                // A long line (a mesh of numbers in one row) is shown around the place alone.
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
