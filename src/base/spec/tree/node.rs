//! Nodes of a tree: the syntax of RON, without types.

use super::number::Number;

/// A value in a tree, with its place in the text.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Node {
    /// Byte offset of the first character; [`FROM_JSON`] for a value without text.
    pub start: u32,
    /// Byte offset after the last character.
    pub end: u32,
    /// The value.
    pub kind: Kind,
}

/// Offset of a node that was converted from JSON.
///
/// JSON has no tuples, names and structs. Its lists, strings and maps are read as these types, those of RON are not.
pub(super) const FROM_JSON: u32 = u32::MAX;

/// The syntax of a value.
///
/// The type that is read determines the meaning: `None` is an option or a variant, `()` a unit or an empty struct.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Kind {
    /// `true`, `None`, `inf`, or a variant without fields; `null` in JSON.
    Name(Box<str>),
    /// A number.
    Number(Number),
    /// `b'x'`.
    Byte(u8),
    /// `'x'`.
    Char(char),
    /// `"text"`; also a key of a struct and the name in [`Kind::Named`].
    String(Box<str>),
    /// `b"text"`.
    Bytes(Box<[u8]>),
    /// `[a, b]`.
    List(Box<[Node]>),
    /// `(a, b)` or `()`.
    Tuple(Box<[Node]>),
    /// `(key: a)`, or an object of JSON.
    Struct(Box<[Entry]>),
    /// `{a: b}`.
    Map(Box<[Entry]>),
    /// `Name(a)` or `Name(key: a)`: the name, and the tuple or struct.
    Named(Box<Entry>),
}

/// A key and its value.
pub(super) type Entry = (Node, Node);

impl Node {
    /// Whether the node was converted from JSON.
    pub fn is_json(&self) -> bool {
        self.start == FROM_JSON
    }

    /// Offset of the closing bracket.
    pub fn closing(&self) -> u32 {
        if self.is_json() { FROM_JSON } else { self.end.saturating_sub(1) }
    }

    /// The text of a name or string.
    pub fn text(&self) -> Option<&str> {
        match &self.kind {
            Kind::Name(text) | Kind::String(text) => Some(text),
            _ => None,
        }
    }

    /// The keys of a struct or map, or the name of a variant.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        let (entries, named): (&[Entry], _) = match &self.kind {
            Kind::Struct(entries) | Kind::Map(entries) => (entries, None),
            Kind::Named(named) => (&[], named.0.text()),
            _ => (&[], self.name()),
        };
        entries.iter().filter_map(|(key, _)| key.text()).chain(named)
    }

    /// The name, if the node is a bare name.
    pub fn name(&self) -> Option<&str> {
        match &self.kind {
            Kind::Name(name) => Some(name),
            _ => None,
        }
    }

    /// The node below this one at `key`: a key of a struct or map, an index, or the name of a variant.
    ///
    /// `Some(..)`, names of structs and variants, and brackets around a single value can be left out of a path.
    pub fn child(&self, key: &str) -> Option<&Node> {
        match &self.kind {
            Kind::Struct(entries) | Kind::Map(entries) => {
                entries.iter().find(|(name, _)| name.text() == Some(key)).map(|(_, value)| value)
            }
            Kind::Named(named) if named.0.text() == Some(key) => Some(&named.1),
            Kind::Named(named) => named.1.child(key),
            Kind::List(items) | Kind::Tuple(items) => match (key.parse::<usize>(), &**items) {
                (Ok(index), _) => items.get(index),
                (Err(_), [only]) if matches!(self.kind, Kind::Tuple(_)) => only.child(key),
                _ => None,
            },
            _ => None,
        }
    }

    /// Adds the fields of `other` that this struct does not have, and of the structs in it.
    pub fn complete_from(&mut self, other: &Node) {
        let Some(others) = other.fields() else { return };
        if matches!(&self.kind, Kind::Tuple(items) if items.is_empty()) {
            self.kind = Kind::Struct(Box::default());
        }
        match &mut self.kind {
            Kind::Struct(entries) => complete(entries, others),
            Kind::Named(named) => named.1.complete_from(other),
            _ => {}
        }
    }

    /// The fields of a struct, with or without its name.
    fn fields(&self) -> Option<&[Entry]> {
        match &self.kind {
            Kind::Struct(entries) => Some(entries),
            Kind::Named(named) => named.1.fields(),
            _ => None,
        }
    }
}

fn complete(entries: &mut Box<[Entry]>, others: &[Entry]) {
    let mut all = std::mem::take(entries).into_vec();
    for (key, value) in others {
        match all.iter_mut().find(|(own, _)| own.text() == key.text()) {
            Some((_, own)) => own.complete_from(value),
            None => all.push((key.clone(), value.clone())),
        }
    }
    *entries = all.into_boxed_slice();
}
