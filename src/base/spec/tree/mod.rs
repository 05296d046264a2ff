//! The text of a spec as a tree of values with their positions, and the types that are read from it.
//!
//! The parser is compiled once, for all specs. The code for each type is that of serde and calls of functions that know
//! no types: `ron`, which parses and reads in one, was a third of the code of this program.

mod collections;
mod deserializer;
mod failure;
mod header;
mod json;
mod lexer;
mod node;
mod number;
mod parser;
mod quoted;
mod reader;
mod scalars;

use super::{Position, Source, SpecError};
pub(super) use failure::needs;
use header::Extensions;
use node::Node;
use parser::Parser;
use reader::{Reader, Value};
use serde::Deserialize;

/// A RON text, or a value of JSON, as a tree of values.
#[derive(Debug, Clone)]
pub struct Tree {
    source: Source,
    extensions: Extensions,
    root: Node,
}

/// A value in a [`Tree`], with all that it contains.
#[derive(Debug, Clone, Copy)]
pub struct Subtree<'t> {
    tree: &'t Tree,
    node: &'t Node,
}

impl Tree {
    /// Reads the text of a spec.
    ///
    /// # Errors
    /// A [`SpecError`] with line and column if the text is not RON.
    pub fn read(source: &Source) -> Result<Self, SpecError> {
        let text = &source.text;
        if u32::try_from(text.len()).is_err() {
            return Err(SpecError::plain(&source.name, format!("has {} bytes; at most 4 GiB are read", text.len())));
        }
        let mut parser = Parser::new(text);
        let parsed = parser.lexer.attributes().and_then(|extensions| Ok((extensions, parser.document()?)));
        let (extensions, root) =
            parsed.map_err(|fault| SpecError::at(source, Position::of_offset(text, fault.at), fault.message))?;
        Ok(Self { source: source.clone(), extensions, root })
    }

    /// Converts JSON; `name` is for errors, which have no line.
    ///
    /// A variant is encoded as serde does: its name, or an object with its name as the only key.
    pub fn from_json(name: impl Into<String>, value: &serde_json::Value) -> Self {
        Self { source: Source::in_memory(name, ""), extensions: Extensions::default(), root: value.into() }
    }

    /// The same tree with the keys of `other` that it does not have, in the structs inside too.
    ///
    /// `other` must be right: an error about one of its values has a place in this text.
    #[must_use]
    pub fn completed_from(mut self, other: &Tree) -> Self {
        self.root.complete_from(&other.root);
        self
    }

    /// Reads the tree as `T`.
    ///
    /// # Errors
    /// A [`SpecError`] with line and column for unknown or missing keys, and for values of another type or out of
    /// range.
    pub fn to<'t, T: Deserialize<'t>>(&'t self) -> Result<T, SpecError> {
        self.all().to()
    }

    /// The value at `path`: keys of structs and maps, indices of lists, names of variants. `None` if there is none.
    ///
    /// `Some(..)`, the names of structs and of variants, and brackets around a single value can be left out of the
    /// path.
    pub fn get(&self, path: &[&str]) -> Option<Subtree<'_>> {
        self.all().get(path)
    }

    /// Returns the keys of the outermost struct or map, or the name of the outermost variant.
    pub fn keys(&self) -> Vec<String> {
        self.root.keys().map(str::to_owned).collect()
    }

    fn all(&self) -> Subtree<'_> {
        Subtree { tree: self, node: &self.root }
    }
}

impl<'t> Subtree<'t> {
    /// Reads the value as `T`.
    ///
    /// # Errors
    /// As [`Tree::to`]; the position is that in the whole text.
    pub fn to<T: Deserialize<'t>>(&self) -> Result<T, SpecError> {
        let reader = Reader::new(&self.tree.source, self.tree.extensions);
        T::deserialize(Value::new(&reader, self.node)).map_err(|failure| reader.error(&failure))
    }

    /// The value at `path` below this one, as [`Tree::get`].
    pub fn get(&self, path: &[&str]) -> Option<Self> {
        let node = path.iter().try_fold(self.node, |node, key| node.child(key))?;
        Some(Self { tree: self.tree, node })
    }
}

#[cfg(test)]
mod tests;
