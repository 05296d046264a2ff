//! The error of reading a type from a tree, before its position is known.

use super::node::Kind;
use crate::similar::did_you_mean;
use serde::de::{Error, Expected, Unexpected};
use std::borrow::Cow;
use std::fmt;

/// Why a value cannot be read.
///
/// It has no position: the [`super::reader::Reader`] knows the place that was read last.
#[derive(Debug)]
pub(super) struct Failure(Box<Reason>);

#[derive(Debug)]
enum Reason {
    Message(Cow<'static, str>),
    UnknownField { found: String, expected: &'static [&'static str] },
    UnknownVariant { found: String, expected: &'static [&'static str] },
    MissingField(&'static str),
    DuplicateField(&'static str),
}

impl Failure {
    /// A failure with this message.
    #[cold]
    pub fn new(message: impl Into<Cow<'static, str>>) -> Self {
        Self(Box::new(Reason::Message(message.into())))
    }

    /// The key that the type does not have, if this is the failure.
    pub fn unknown_key(&self) -> Option<&str> {
        match &*self.0 {
            Reason::UnknownField { found, .. } => Some(found),
            _ => None,
        }
    }

    /// The key that the text does not have, the first of several, if this is the failure.
    pub fn missing_key(&self) -> Option<&'static str> {
        match &*self.0 {
            Reason::MissingField(field) => Some(field),
            _ => None,
        }
    }

    /// The message; `owner` is the struct and `enumeration` the enum that was read, or empty.
    pub fn message(&self, owner: &str, enumeration: &str) -> String {
        let inside = if owner.is_empty() { String::new() } else { format!(" in {}", quoted(owner)) };
        match &*self.0 {
            Reason::Message(message) => message.clone().into_owned(),
            Reason::UnknownField { found, expected } => {
                let similar = similar(found, expected);
                format!("Unexpected field named {}{inside}{similar}, {}", quoted(found), one_of(expected, "fields"))
            }
            Reason::UnknownVariant { found, expected } => {
                let (kind, inside) = match enumeration {
                    "" => ("enum variant", String::new()),
                    name => ("variant", format!(" in enum {}", quoted(name))),
                };
                let similar = similar(found, expected);
                format!("Unexpected {kind} named {}{inside}{similar}, {}", quoted(found), one_of(expected, "variants"))
            }
            Reason::MissingField(field) => needs(owner, &[field]),
            Reason::DuplicateField(field) => format!("Unexpected duplicate field named {}{inside}", quoted(field)),
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message("", ""))
    }
}

impl std::error::Error for Failure {}

impl Error for Failure {
    #[cold]
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self::new(message.to_string())
    }

    #[cold]
    fn invalid_type(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::invalid_value(found, expected)
    }

    #[cold]
    fn invalid_value(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::new(format!("Expected {expected} but found {} instead", noun(found)))
    }

    #[cold]
    fn invalid_length(found: usize, expected: &dyn Expected) -> Self {
        let elements = match found {
            0 => "zero elements".to_owned(),
            1 => "one element".to_owned(),
            count => format!("{count} elements"),
        };
        Self::new(format!("Expected {expected} but found {elements} instead"))
    }

    #[cold]
    fn unknown_variant(found: &str, expected: &'static [&'static str]) -> Self {
        Self(Box::new(Reason::UnknownVariant { found: found.to_owned(), expected }))
    }

    #[cold]
    fn unknown_field(found: &str, expected: &'static [&'static str]) -> Self {
        Self(Box::new(Reason::UnknownField { found: found.to_owned(), expected }))
    }

    #[cold]
    fn missing_field(field: &'static str) -> Self {
        Self(Box::new(Reason::MissingField(field)))
    }

    #[cold]
    fn duplicate_field(field: &'static str) -> Self {
        Self(Box::new(Reason::DuplicateField(field)))
    }
}

/// The expected name that `found` probably means, in brackets; empty if there is none.
fn similar(found: &str, expected: &[&str]) -> String {
    did_you_mean(found, expected.iter().copied()).map_or_else(String::new, |question| format!(" ({question})"))
}

/// The message that the struct or variant `owner` lacks these keys.
pub fn needs(owner: &str, keys: &[&str]) -> String {
    let subject = if owner.is_empty() { "the spec".to_owned() } else { quoted(owner) };
    let names: Vec<String> = keys.iter().map(|key| quoted(key)).collect();
    match names.split_last() {
        Some((last, first)) if !first.is_empty() => format!("{subject} needs {} and {last}", first.join(", ")),
        _ => format!("{subject} needs {}", names.concat()),
    }
}

/// A found value in words.
fn noun(found: Unexpected<'_>) -> String {
    match found {
        Unexpected::Bool(value) => format!("the boolean `{value}`"),
        Unexpected::Unsigned(value) => format!("the unsigned integer `{value}`"),
        Unexpected::Signed(value) => format!("the signed integer `{value}`"),
        Unexpected::Float(value) => format!("the floating point number `{value}`"),
        Unexpected::Char(value) => format!("the UTF-8 character `{value}`"),
        Unexpected::Str(value) => format!("the string {value:?}"),
        Unexpected::Bytes(value) => format!("the byte string b\"{}\"", value.escape_ascii()),
        Unexpected::Unit => "a unit value".to_owned(),
        Unexpected::Option => "an optional value".to_owned(),
        Unexpected::Seq => "a sequence".to_owned(),
        Unexpected::Map => "a map".to_owned(),
        Unexpected::Enum => "an enum".to_owned(),
        other => format!("a {other}"),
    }
}

/// The message that a value of this kind is no variant of `enumeration`, which has the variants `known`.
#[cold]
pub(super) fn not_a_variant(kind: &Kind, enumeration: &str, known: &[&str]) -> String {
    match kind {
        Kind::String(text) if known.contains(&&**text) => {
            format!("{} is a variant of {}: write it without quotes", quoted(text), quoted(enumeration))
        }
        _ => format!("No variant of enum {}, {}", quoted(enumeration), one_of(known, "variants")),
    }
}

/// The accepted names in words.
fn one_of(names: &[&str], plural: &str) -> String {
    match names {
        [] => format!("there are no {plural}"),
        [only] => format!("expected {} instead", quoted(only)),
        [a, b] => format!("expected either {} or {} instead", quoted(a), quoted(b)),
        [first @ .., last] => {
            let first: Vec<String> = first.iter().map(|name| quoted(name)).collect();
            format!("expected one of {}, or {} instead", first.join(", "), quoted(last))
        }
    }
}

/// A name as it is written in RON.
pub(super) fn quoted(name: &str) -> String {
    use super::lexer::{is_plain, is_raw};
    let is_initial = |c: char| is_plain(c) && !c.is_numeric();
    if name.is_empty() || !name.chars().all(is_raw) {
        format!("{name:?}_[invalid identifier]")
    } else if name.starts_with(is_initial) && name.chars().all(is_plain) {
        format!("`{name}`")
    } else {
        format!("`r#{name}`")
    }
}
