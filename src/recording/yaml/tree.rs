//! Builds the tree of a document from the events of the parser.

use super::error::{Position, YamlError};
use super::node::{Node, Value};
use granit_parser::{Event, Marker, Parser, ScalarStyle};
use std::collections::{BTreeMap, BTreeSet};

/// Maximum number of sequences and mappings in each other.
const MAX_DEPTH: usize = 64;
/// Maximum size of all nodes, also those that aliases repeat and copies of anchors, bytes.
const MAX_SIZE: usize = 64 << 20;
/// Size of a node in addition to its text, bytes: an upper limit, which allows for 262,144 nodes.
const NODE_SIZE: usize = 256;

/// Reads the document in `text`; an empty one is null.
pub(super) fn read(text: &str) -> Result<Node, YamlError> {
    let mut tree = Tree::default();
    for next in Parser::new_from_str(text) {
        let (event, span) = next.map_err(|error| YamlError::new(error.info(), position(error.marker())))?;
        tree.take(event, position(&span.start))?;
    }
    Ok(tree.root.unwrap_or_else(Node::null))
}

fn position(marker: &Marker) -> Position {
    (marker.line(), marker.col() + 1)
}

/// The part of the tree that is complete, and the nodes around it.
#[derive(Default)]
struct Tree {
    open: Vec<Open>,
    anchors: BTreeMap<usize, Node>,
    size: usize,
    root: Option<Node>,
}

/// A sequence or mapping that is not complete.
struct Open {
    node: Node,
    anchor: usize,
    /// Key of a mapping whose value is next.
    key: Option<Node>,
    keys: BTreeSet<String>,
}

impl Tree {
    fn take(&mut self, event: Event<'_>, position: Position) -> Result<(), YamlError> {
        let node = |value| Node { position, value };
        match event {
            Event::DocumentStart(..) if self.root.is_some() => {
                Err(YamlError::new("a second document starts; only one is supported", position))
            }
            Event::Scalar(text, style, anchor, _) => {
                self.reserve(text.len(), position)?;
                let is_plain = style == ScalarStyle::Plain;
                self.complete(node(Value::Scalar { text: text.into_owned(), is_plain }), anchor)
            }
            Event::SequenceStart(_, anchor, _) => self.open(node(Value::Sequence(Vec::new())), anchor),
            Event::MappingStart(_, anchor, _) => self.open(node(Value::Mapping(Vec::new())), anchor),
            Event::SequenceEnd | Event::MappingEnd => match self.open.pop() {
                Some(open) => self.complete(open.node, open.anchor),
                None => Ok(()),
            },
            Event::Alias(anchor) => {
                let copy = self.copy_of_anchor(anchor, position)?;
                self.complete(copy, 0)
            }
            _ => Ok(()),
        }
    }

    fn open(&mut self, node: Node, anchor: usize) -> Result<(), YamlError> {
        self.reserve(0, node.position)?;
        if self.open.len() == MAX_DEPTH {
            return Err(YamlError::new(format!("nested deeper than {MAX_DEPTH} levels"), node.position));
        }
        self.open.push(Open { node, anchor, key: None, keys: BTreeSet::new() });
        Ok(())
    }

    /// Adds a complete node to the one around it.
    fn complete(&mut self, node: Node, anchor: usize) -> Result<(), YamlError> {
        if anchor != 0 {
            self.reserve_copy(&node, node.position)?;
            self.anchors.insert(anchor, node.clone());
        }
        let Some(open) = self.open.last_mut() else {
            self.root = Some(node);
            return Ok(());
        };
        match &mut open.node.value {
            Value::Mapping(entries) => match open.key.take() {
                Some(key) => entries.push((key, node)),
                None => {
                    let Value::Scalar { text, .. } = &node.value else {
                        return Err(YamlError::new("a key must be a scalar", node.position));
                    };
                    if !open.keys.insert(text.clone()) {
                        return Err(YamlError::new(format!("the key `{text}` is repeated"), node.position));
                    }
                    open.key = Some(node);
                }
            },
            Value::Sequence(nodes) => nodes.push(node),
            Value::Scalar { .. } => {}
        }
        Ok(())
    }

    fn copy_of_anchor(&mut self, anchor: usize, position: Position) -> Result<Node, YamlError> {
        let Some(node) = self.anchors.remove(&anchor) else {
            return Err(YamlError::new("an alias refers to a node that contains it", position));
        };
        self.reserve_copy(&node, position)?;
        let copy = node.clone();
        self.anchors.insert(anchor, node);
        Ok(copy)
    }

    fn reserve_copy(&mut self, node: &Node, position: Position) -> Result<(), YamlError> {
        match &node.value {
            Value::Scalar { text, .. } => self.reserve(text.len(), position),
            Value::Sequence(nodes) => {
                self.reserve(0, position)?;
                nodes.iter().try_for_each(|node| self.reserve_copy(node, position))
            }
            Value::Mapping(entries) => {
                self.reserve(0, position)?;
                entries.iter().try_for_each(|(key, value)| {
                    self.reserve_copy(key, position)?;
                    self.reserve_copy(value, position)
                })
            }
        }
    }

    /// Counts a node with a text of this length.
    fn reserve(&mut self, text_length: usize, position: Position) -> Result<(), YamlError> {
        self.size = self.size.saturating_add(text_length).saturating_add(NODE_SIZE);
        if self.size > MAX_SIZE {
            return Err(YamlError::new("the document is too large: over 64 MiB with its aliases expanded", position));
        }
        Ok(())
    }
}
