//! Reading lists, tuples, structs, maps and enums from nodes.

use super::failure::{Failure, not_a_variant, quoted};
use super::node::{Entry, Kind, Node};
use super::reader::{Read, Reader, Struct, Value, opening};
use serde::de::{DeserializeSeed, EnumAccess, MapAccess, SeqAccess, VariantAccess, Visitor};
use std::slice::Iter;

/// The items of a list or tuple.
pub(super) struct Items<'r, 'de> {
    reader: &'r Reader<'de>,
    items: Iter<'de, Node>,
    /// Offset of the closing bracket.
    closing: u32,
}

/// The entries of a struct or map.
pub(super) struct Entries<'r, 'de> {
    reader: &'r Reader<'de>,
    entries: Iter<'de, Entry>,
    /// Name of the struct or variant, for errors.
    owner: &'de str,
    /// All keys, for errors.
    keys: Struct<'de>,
    /// Offset of the closing bracket.
    closing: u32,
    value: Option<Value<'r, 'de>>,
    /// Whether the only entry is a variant and its fields.
    is_variant: bool,
}

/// A variant of an enum.
pub(super) struct Variant<'r, 'de> {
    reader: &'r Reader<'de>,
    name: &'de Node,
    /// The fields in brackets; from JSON any value.
    content: Option<&'de Node>,
}

impl<'r, 'de> Value<'r, 'de> {
    fn items_of(&self, node: &'de Node, items: &'de [Node]) -> Items<'r, 'de> {
        Items { reader: self.reader, items: items.iter(), closing: node.closing() }
    }

    fn entries_of(&self, node: &'de Node, entries: &'de [Entry], owner: &'de str) -> Entries<'r, 'de> {
        let keys = Struct { known: &[], entries };
        let entries = entries.iter();
        Entries { reader: self.reader, entries, owner, keys, closing: node.closing(), value: None, is_variant: false }
    }

    pub fn list(&self) -> Read<Items<'r, 'de>> {
        let node = self.scalar()?;
        match &node.kind {
            Kind::List(items) => Ok(self.items_of(node, items)),
            _ => Err(Failure::new("Expected opening `[`")),
        }
    }

    /// A tuple of `length` values, if it is known, or the fields without names of the struct `name`.
    pub fn tuple(&self, name: Option<&'static str>, length: usize) -> Read<Items<'r, 'de>> {
        let node = match name {
            Some(name) => self.without_name(name)?,
            None => self.node,
        };
        self.reader.visit(node.start);
        let items = match &node.kind {
            Kind::Tuple(items) => items,
            Kind::List(items) if node.is_json() => items,
            Kind::Struct(_) => return Err(Failure::new("Expected values without names")),
            _ => return Err(Failure::new(opening(name.unwrap_or_default()))),
        };
        match items.get(length) {
            Some(excess) if !node.is_json() => self.reader.fail(excess.start, "Expected closing `)`"),
            Some(_) => Err(Failure::new(format!("Expected {length} elements but found {} instead", items.len()))),
            None => Ok(self.items_of(node, items)),
        }
    }

    pub fn map(&self) -> Read<Entries<'r, 'de>> {
        let node = self.scalar()?;
        match &node.kind {
            Kind::Map(entries) => Ok(self.entries_of(node, entries, "")),
            Kind::Struct(entries) if node.is_json() => Ok(self.entries_of(node, entries, "")),
            _ => Err(Failure::new("Expected opening `{`")),
        }
    }

    /// The fields of the struct `name`, which can be left out.
    pub fn fields(&self, name: &'static str, known: &'static [&'static str]) -> Read<Entries<'r, 'de>> {
        let node = self.without_name(name)?;
        Ok(self.fields_of(node, name, opening)?.of_known(known))
    }

    /// The fields in `group`; `expected` is the message if there are none.
    fn fields_of(&self, group: &'de Node, owner: &'de str, expected: fn(&str) -> String) -> Read<Entries<'r, 'de>> {
        self.reader.visit(group.start);
        match &group.kind {
            Kind::Struct(entries) => Ok(self.entries_of(group, entries, owner)),
            Kind::Tuple(items) => match items.first() {
                None => Ok(self.entries_of(group, &[], owner)),
                Some(first) => self.reader.fail(first.start, "Expected identifier"),
            },
            _ => Err(Failure::new(expected(owner))),
        }
    }

    /// A variant of the enum `name`: a bare name, or a name with fields; from JSON also a map with one key.
    pub fn variant(&self, name: &'static str, known: &'static [&'static str]) -> Read<Variant<'r, 'de>> {
        let node = self.scalar()?;
        let (variant, content) = match &node.kind {
            Kind::Name(_) => (node, None),
            Kind::Named(named) => (&named.0, Some(&named.1)),
            Kind::String(_) if node.is_json() => (node, None),
            Kind::Struct(entries) if node.is_json() => match &**entries {
                [only] => (&only.0, Some(&only.1)),
                _ => return Err(Failure::new("Expected a map with a single key, the name of a variant")),
            },
            kind => return Err(Failure::new(not_a_variant(kind, name, known))),
        };
        self.reader.visit_variant(name, variant.start);
        Ok(Variant { reader: self.reader, name: variant, content })
    }

    /// The entries of a named group as a map from its name to its content, as JSON encodes a variant.
    pub fn variant_as_map(&self, named: &'de Entry) -> Entries<'r, 'de> {
        let entries = std::slice::from_ref(named);
        Entries { is_variant: true, ..self.entries_of(&named.1, entries, "") }
    }

    /// The items or entries of any node with brackets.
    pub fn any_items(&self, items: &'de [Node]) -> Items<'r, 'de> {
        self.items_of(self.node, items)
    }

    /// As [`Value::any_items`], of keys and values.
    pub fn any_entries(&self, entries: &'de [Entry]) -> Entries<'r, 'de> {
        self.entries_of(self.node, entries, "")
    }
}

impl<'r, 'de> Items<'r, 'de> {
    fn next(&mut self) -> Option<Value<'r, 'de>> {
        let next = self.items.next();
        if next.is_none() {
            self.reader.visit(self.closing);
        }
        next.map(|node| Value::new(self.reader, node))
    }
}

impl<'de> SeqAccess<'de> for Items<'_, 'de> {
    type Error = Failure;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Failure> {
        match self.next() {
            Some(value) => seed.deserialize(value).map(Some),
            None => Ok(None),
        }
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.items.len())
    }
}

impl<'r, 'de> Entries<'r, 'de> {
    /// The same entries, of a type that knows these keys.
    fn of_known(mut self, known: &'static [&'static str]) -> Self {
        self.keys.known = known;
        self
    }

    fn next_key(&mut self) -> Option<Value<'r, 'de>> {
        let Some((key, value)) = self.entries.next() else {
            self.reader.visit_end(self.owner, self.closing, self.keys);
            return None;
        };
        self.reader.visit_field(self.owner, key.start);
        let only = match &value.kind {
            Kind::Tuple(items) if self.is_variant && items.len() == 1 => &items[0],
            _ => value,
        };
        self.value = Some(Value::new(self.reader, only));
        Some(Value::new(self.reader, key))
    }

    fn next_value(&mut self) -> Read<Value<'r, 'de>> {
        self.value.take().ok_or_else(|| Failure::new("a value was read before its key"))
    }
}

impl<'de> MapAccess<'de> for Entries<'_, 'de> {
    type Error = Failure;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Failure> {
        match self.next_key() {
            Some(key) => seed.deserialize(key).map(Some),
            None => Ok(None),
        }
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Failure> {
        seed.deserialize(self.next_value()?)
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.entries.len())
    }
}

impl<'r, 'de> Variant<'r, 'de> {
    /// The content, in brackets if it is from RON.
    fn content(&self) -> Read<Value<'r, 'de>> {
        match self.content {
            Some(content) => Ok(Value::new(self.reader, content)),
            None => self.reader.fail(if self.name.is_json() { self.name.start } else { self.name.end }, opening("")),
        }
    }

    fn no_content(&self) -> Read<()> {
        match self.content {
            None => Ok(()),
            Some(content) if content.is_json() => Value::new(self.reader, content).unit(""),
            Some(content) if matches!(&content.kind, Kind::Tuple(items) if items.is_empty()) => Ok(()),
            Some(content) => {
                let name = quoted(self.name.text().unwrap_or_default());
                self.reader.fail(content.start, format!("{name} has no keys: write {name}"))
            }
        }
    }

    fn newtype(&self) -> Read<Value<'r, 'de>> {
        let content = self.content()?;
        match content.node.kind {
            // A struct in a variant needs no second pair of brackets.
            Kind::Struct(_) if !content.node.is_json() => Ok(content.unwrapped()),
            _ => content.content(content.node),
        }
    }

    fn fields(&self, known: &'static [&'static str]) -> Read<Entries<'r, 'de>> {
        let content = self.content()?;
        let entries = content.fields_of(content.node, self.name.text().unwrap_or_default(), |_| opening(""))?;
        Ok(entries.of_known(known))
    }
}

impl<'de> EnumAccess<'de> for Variant<'_, 'de> {
    type Error = Failure;
    type Variant = Self;

    fn variant_seed<V: DeserializeSeed<'de>>(self, seed: V) -> Result<(V::Value, Self), Failure> {
        let name = seed.deserialize(Value::new(self.reader, self.name))?;
        Ok((name, self))
    }
}

impl<'de> VariantAccess<'de> for Variant<'_, 'de> {
    type Error = Failure;

    fn unit_variant(self) -> Result<(), Failure> {
        self.no_content()
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, Failure> {
        seed.deserialize(self.newtype()?)
    }

    fn tuple_variant<V: Visitor<'de>>(self, length: usize, visitor: V) -> Result<V::Value, Failure> {
        visitor.visit_seq(self.content()?.tuple(None, length)?)
    }

    fn struct_variant<V: Visitor<'de>>(self, known: &'static [&'static str], visitor: V) -> Result<V::Value, Failure> {
        visitor.visit_map(self.fields(known)?)
    }
}
