//! Reading the text of a spec by character: white space, comments, names, and numbers.

use super::node::{Kind, Node};
use super::number::Number;
use crate::unit::split_unit;
use std::borrow::Cow;

/// An error in the syntax.
#[derive(Debug)]
pub(super) struct Fault {
    /// Byte offset in the text.
    pub at: usize,
    /// The message.
    pub message: Cow<'static, str>,
}

/// The result of reading part of the text.
pub(super) type Parsed<T> = Result<T, Fault>;

/// A text, and how much of it has been read.
pub(super) struct Lexer<'a> {
    pub text: &'a str,
    /// Byte offset of the next character.
    pub at: usize,
}

impl<'a> Lexer<'a> {
    /// The text that has not been read.
    pub fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    /// The next character, which is not read.
    pub fn peek(&self) -> Option<char> {
        self.rest().chars().next()
    }

    /// Reads a character.
    pub fn next(&mut self) -> Parsed<char> {
        let c = self.peek().ok_or_else(|| self.end_of_text())?;
        self.at += c.len_utf8();
        Ok(c)
    }

    /// Reads `token`, if it is next.
    pub fn take(&mut self, token: &str) -> bool {
        let is_next = self.rest().starts_with(token);
        self.at += if is_next { token.len() } else { 0 };
        is_next
    }

    /// Reads characters while `condition` is true.
    pub fn take_while(&mut self, condition: fn(char) -> bool) -> &'a str {
        let rest = self.rest();
        let taken = &rest[..rest.find(|c| !condition(c)).unwrap_or(rest.len())];
        self.at += taken.len();
        taken
    }

    /// An error at the next character.
    #[cold]
    pub fn fault(&self, message: impl Into<Cow<'static, str>>) -> Fault {
        Fault { at: self.at, message: message.into() }
    }

    /// The error that the text ends too early, after its last character.
    #[cold]
    pub fn end_of_text(&self) -> Fault {
        Fault { at: self.text.trim_end().len(), message: "Unexpected end of RON".into() }
    }

    /// A node from `start` to the next character.
    pub fn node(&self, start: usize, kind: Kind) -> Node {
        // `Tree::read` refuses texts with larger offsets.
        let (start, end) = (start as u32, self.at as u32);
        Node { start, end, kind }
    }

    /// Skips white space and comments.
    pub fn skip_space(&mut self) -> Parsed<()> {
        loop {
            self.take_while(is_space);
            let start = self.at;
            if self.take("//") {
                self.take_while(|c| c != '\n');
            } else if self.take("/*") {
                self.skip_block_comment(start)?;
            } else if self.take("/") {
                let c = self.next()?;
                return Err(Fault { at: start, message: format!("Unexpected char {c:?}").into() });
            } else {
                return Ok(());
            }
        }
    }

    /// Skips the rest of a comment that may contain others.
    fn skip_block_comment(&mut self, start: usize) -> Parsed<()> {
        let mut level = 1;
        while level > 0 {
            self.take_while(|c| !matches!(c, '/' | '*'));
            if self.take("/*") {
                level += 1;
            } else if self.take("*/") {
                level -= 1;
            } else if self.next().is_err() {
                return Err(Fault { at: start, message: "Unclosed block comment".into() });
            }
        }
        Ok(())
    }

    /// Reads a name, plain or as `r#name`, without the `r#`; `None` if something else is next.
    pub fn identifier(&mut self) -> Parsed<Option<&'a str>> {
        let rest = self.rest();
        if ["\"", "'", "r#", "r\""].iter().any(|quote| rest.strip_prefix('b').is_some_and(|b| b.starts_with(quote)))
            || ["r\"", "r#\"", "r##"].iter().any(|quote| rest.starts_with(quote))
        {
            return Ok(None);
        }
        if rest.strip_prefix("r#").is_some_and(|raw| raw.starts_with(is_raw)) {
            self.at += 2;
            return Ok(Some(self.take_while(is_raw)));
        }
        if !rest.starts_with(|c: char| c == '_' || c.is_alphabetic()) {
            return Ok(None);
        }
        let name = &rest[..rest.find(|c| !is_plain(c)).unwrap_or(rest.len())];
        let raw = &rest[..rest.find(|c| !is_raw(c)).unwrap_or(rest.len())];
        if raw.len() > name.len() {
            return Err(
                self.fault(format!("Found invalid std identifier {raw:?}, try the raw identifier `r#{raw}` instead"))
            );
        }
        self.at += name.len();
        Ok(Some(name))
    }

    /// Reads a number.
    pub fn number(&mut self) -> Parsed<Kind> {
        let start = self.at;
        let text = self.take_while(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '+' | '-'));
        Number::parse(text).map(Kind::Number).map_err(|fault| {
            let message = without_unit(text).map(|number| format!("The unit is in the key: write {number}").into());
            Fault { at: start, message: message.unwrap_or(fault) }
        })
    }
}

/// The number in a text such as `5ms`; `None` if the text is not a number with a unit.
fn without_unit(text: &str) -> Option<&str> {
    let mut units = text.char_indices().filter(|(_, c)| c.is_ascii_alphabetic()).map(|(at, _)| text.split_at(at));
    let has_unit = |unit: &str| matches!(split_unit(&unit.to_lowercase()), ("", Some(_)));
    units.find(|(number, unit)| has_unit(unit) && Number::parse(number).is_ok()).map(|(number, _)| number)
}

/// White space of RON.
fn is_space(c: char) -> bool {
    matches!(c, '\t'..='\r' | ' ' | '\u{85}' | '\u{200E}' | '\u{200F}' | '\u{2028}' | '\u{2029}')
}

/// A character of a plain name, after the first.
pub(super) fn is_plain(c: char) -> bool {
    c == '_' || c.is_alphanumeric()
}

/// A character of a name after `r#`.
pub(super) fn is_raw(c: char) -> bool {
    is_plain(c) || matches!(c, '.' | '+' | '-')
}
