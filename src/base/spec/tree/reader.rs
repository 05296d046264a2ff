//! The state of reading a tree, and reading options, names and brackets.

use super::failure::{Failure, quoted};
use super::header::Extensions;
use super::node::{Entry, FROM_JSON, Kind, Node};
use crate::spec::{Missing, Position, Source, SpecError};
use std::cell::Cell;

/// A result of reading part of a tree.
pub(super) type Read<T> = Result<T, Failure>;

/// Maximum number of implicit `Some` and structs without brackets around one value, for types that contain themselves.
const MAX_WRAPPERS: u8 = 32;

/// The state of reading a type from a tree.
///
/// A failure is about the place that was read last, so that the code of each type needs not add it.
pub(super) struct Reader<'de> {
    pub source: &'de Source,
    pub extensions: Extensions,
    /// Byte offset of the last place.
    at: Cell<u32>,
    /// Name of the struct or variant whose fields are read.
    owner: Cell<&'de str>,
    /// Name of the enum, if the last place is the name of a variant.
    enumeration: Cell<&'static str>,
    /// The last struct or variant of which all keys have been read.
    complete: Cell<Struct<'de>>,
}

/// The keys of a struct or variant.
#[derive(Clone, Copy, Default)]
pub(super) struct Struct<'de> {
    /// Keys that the type knows.
    pub known: &'static [&'static str],
    /// Keys and values of the text.
    pub entries: &'de [Entry],
}

impl<'de> Reader<'de> {
    /// A reader of a tree from `source`.
    pub fn new(source: &'de Source, extensions: Extensions) -> Self {
        let (at, owner, enumeration) = (Cell::new(FROM_JSON), Cell::new(""), Cell::new(""));
        Self { source, extensions, at, owner, enumeration, complete: Cell::default() }
    }

    /// Records that the place at the offset `at` is read.
    pub fn visit(&self, at: u32) {
        self.at.set(at);
        self.enumeration.set("");
    }

    /// As [`Reader::visit`], for a place between the fields of `owner`.
    pub fn visit_field(&self, owner: &'de str, at: u32) {
        self.visit(at);
        self.owner.set(owner);
    }

    /// As [`Reader::visit_field`], for the end of the fields of `owner`.
    pub fn visit_end(&self, owner: &'de str, at: u32, complete: Struct<'de>) {
        self.visit_field(owner, at);
        self.complete.set(complete);
    }

    /// As [`Reader::visit`], for the name of a variant of `enumeration`.
    pub fn visit_variant(&self, enumeration: &'static str, at: u32) {
        self.visit(at);
        self.enumeration.set(enumeration);
    }

    /// A failure at the offset `at`.
    #[cold]
    pub fn fail<T>(&self, at: u32, message: impl Into<std::borrow::Cow<'static, str>>) -> Read<T> {
        self.visit(at);
        Err(Failure::new(message))
    }

    /// The failure with its position.
    #[cold]
    pub fn error(&self, failure: &Failure) -> SpecError {
        let message = failure.message(self.owner.get(), self.enumeration.get());
        let source = self.source;
        let error = match self.at.get() {
            FROM_JSON => SpecError::plain(&source.name, message),
            at => SpecError::at(source, Position::of_offset(&source.text, at as usize), message),
        };
        let missing = failure.missing_key().map(|key| self.missing(key));
        error.with_unknown_key(failure.unknown_key()).with_missing(missing)
    }

    /// What is known of the keys that the last struct lacks; `key` is the first.
    fn missing(&self, key: &'static str) -> Missing {
        let Struct { known, entries } = self.complete.get();
        let present = entries.iter().filter_map(|(key, _)| key.text()).map(str::to_owned).collect();
        Missing { owner: self.owner.get().to_owned(), key, known, present }
    }

    /// The value in brackets that contain no other; JSON has no such brackets.
    pub fn single(&self, group: &'de Node) -> Read<&'de Node> {
        match &group.kind {
            _ if group.is_json() => Ok(group),
            Kind::Tuple(items) => match &**items {
                [only] => Ok(only),
                [] => self.fail(group.closing(), "Expected a value"),
                [_, second, ..] => self.fail(second.start, "Expected closing `)`"),
            },
            _ => self.fail(group.start, "Expected a value without a name"),
        }
    }
}

/// A value that is read: a node, and how.
#[derive(Clone, Copy)]
pub(super) struct Value<'r, 'de> {
    pub reader: &'r Reader<'de>,
    pub node: &'de Node,
    /// Whether the brackets of the node are those of a variant, which stand for those of the value too.
    pub is_unwrapped: bool,
    /// Number of values that contain this one, without brackets of their own.
    wrappers: u8,
}

impl<'r, 'de> Value<'r, 'de> {
    /// The value of `node`.
    pub fn new(reader: &'r Reader<'de>, node: &'de Node) -> Self {
        Self { reader, node, is_unwrapped: false, wrappers: 0 }
    }

    /// The same value, for a type that has no brackets of its own.
    pub fn wrapped(self) -> Read<Self> {
        if self.wrappers == MAX_WRAPPERS {
            return self.reader.fail(self.node.start, "Exceeded recursion limit: a type contains itself");
        }
        Ok(Self { wrappers: self.wrappers + 1, ..self })
    }

    /// The node of a value that has no brackets of its own; it is recorded as read.
    pub fn scalar(&self) -> Read<&'de Node> {
        let node = if self.is_unwrapped { self.reader.single(self.node)? } else { self.node };
        self.reader.visit(node.start);
        Ok(node)
    }

    /// A key of a struct, or the name of a variant.
    pub fn identifier(&self) -> Read<&'de str> {
        match self.node.text() {
            Some(text) => Ok(text),
            None => self.reader.fail(self.node.start, "Expected identifier"),
        }
    }

    /// The value that any type is read from: of a variant's brackets around one value, this value.
    pub fn simplified(self) -> Self {
        match &self.node.kind {
            Kind::Tuple(items) if self.is_unwrapped && items.len() == 1 => Self::new(self.reader, &items[0]),
            _ => self,
        }
    }

    /// The value of an option; `Some` can be left out.
    pub fn option(self) -> Read<Option<Self>> {
        let only = match &self.node.kind {
            Kind::Tuple(items) if self.is_unwrapped => items.first().filter(|_| items.len() == 1),
            _ if self.is_unwrapped => None,
            _ => Some(self.node),
        };
        let Some(node) = only else { return self.wrapped().map(Some) };
        self.reader.visit(node.start);
        match &node.kind {
            Kind::Name(name) if **name == *"None" => Ok(None),
            Kind::Name(name) if **name == *"null" && node.is_json() => Ok(None),
            Kind::Named(named) if named.0.text() == Some("Some") => self.content(&named.1).map(Some),
            _ => self.wrapped().map(Some),
        }
    }

    /// The value in the brackets of `Some` or of a variant.
    pub fn content(self, group: &'de Node) -> Read<Self> {
        if self.reader.extensions.unwrap_variant_newtypes && !group.is_json() {
            return Ok(Self::new(self.reader, group).unwrapped());
        }
        Ok(Self::new(self.reader, self.reader.single(group)?))
    }

    /// The group as the struct that it contains, without its brackets.
    pub fn unwrapped(self) -> Self {
        Self { is_unwrapped: true, ..self }
    }

    /// The value in a struct `name` with one field that has no name.
    pub fn newtype(self, name: &'static str) -> Read<Self> {
        if self.node.is_json() {
            return self.wrapped();
        }
        if self.is_unwrapped {
            let node = self.reader.single(self.node)?;
            return Ok(Self::new(self.reader, node));
        }
        if self.reader.extensions.unwrap_newtypes {
            return self.wrapped();
        }
        let group = self.without_name(name)?;
        match group.kind {
            Kind::Tuple(_) => Ok(Self::new(self.reader, self.reader.single(group)?)),
            Kind::Struct(_) => self.reader.fail(group.start + 1, "Expected opening `(`"),
            _ => self.reader.fail(group.start, opening(name)),
        }
    }

    /// Checks that the value is `()`, or `name` if it is not empty.
    pub fn unit(&self, name: &'static str) -> Read<()> {
        self.reader.visit(self.node.start);
        let is_unit = match &self.node.kind {
            Kind::Name(word) if self.node.is_json() => **word == *"null",
            Kind::Name(word) => !name.is_empty() && **word == *name,
            Kind::Tuple(items) => items.is_empty(),
            _ => false,
        };
        if is_unit { Ok(()) } else { Err(Failure::new("Expected unit")) }
    }

    /// The node without the name of a struct, which can be left out; the place of the node is recorded as read.
    pub fn without_name(&self, name: &'static str) -> Read<&'de Node> {
        self.reader.visit(self.node.start);
        let (found, content) = match &self.node.kind {
            _ if self.is_unwrapped || self.node.is_json() => return Ok(self.node),
            Kind::Named(named) => (named.0.text(), &named.1),
            Kind::Name(_) => (self.node.text(), self.node),
            _ if self.reader.extensions.explicit_struct_names => {
                let message = format!("Expected the explicit struct name {}, but none was found", quoted(name));
                return Err(Failure::new(message));
            }
            _ => return Ok(self.node),
        };
        match found {
            _ if name.is_empty() => Err(Failure::new("Expected only opening `(`, no name, for un-nameable struct")),
            Some(found) if found == name => Ok(content),
            found => {
                let found = quoted(found.unwrap_or_default());
                Err(Failure::new(format!("Expected struct {} but found {found}", quoted(name))))
            }
        }
    }
}

/// The message that the fields of the struct `name` are missing.
#[cold]
pub(super) fn opening(name: &str) -> String {
    if name.is_empty() {
        "Expected opening `(`".to_owned()
    } else {
        format!("Expected opening `(` for struct {}", quoted(name))
    }
}
