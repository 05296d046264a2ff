//! The form of any value, to compare two readers.

use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// A value of any type; numbers by their bits.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Form {
    Unit,
    None,
    Some(Box<Form>),
    Bool(bool),
    Integer(i128),
    Float(u64),
    Char(char),
    Text(String),
    Bytes(Vec<u8>),
    List(Vec<Form>),
    Map(Vec<(Form, Form)>),
}

/// A form by way of the buffer of serde, for which `ron` keeps the names of variants.
#[derive(serde::Deserialize)]
#[serde(untagged)]
pub(super) enum Buffered {
    Any(Form),
}

impl<'de> Deserialize<'de> for Form {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(FormVisitor)
    }
}

struct FormVisitor;

impl<'de> Visitor<'de> for FormVisitor {
    type Value = Form;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("any value")
    }

    fn visit_unit<E>(self) -> Result<Form, E> {
        Ok(Form::Unit)
    }

    fn visit_none<E>(self) -> Result<Form, E> {
        Ok(Form::None)
    }

    fn visit_some<D: Deserializer<'de>>(self, deserializer: D) -> Result<Form, D::Error> {
        Ok(Form::Some(Box::new(Form::deserialize(deserializer)?)))
    }

    fn visit_bool<E>(self, value: bool) -> Result<Form, E> {
        Ok(Form::Bool(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Form, E> {
        Ok(Form::Integer(value.into()))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Form, E> {
        Ok(Form::Integer(value.into()))
    }

    fn visit_f64<E>(self, value: f64) -> Result<Form, E> {
        Ok(Form::Float(value.to_bits()))
    }

    fn visit_char<E>(self, value: char) -> Result<Form, E> {
        Ok(Form::Char(value))
    }

    fn visit_str<E>(self, value: &str) -> Result<Form, E> {
        Ok(Form::Text(value.to_owned()))
    }

    fn visit_bytes<E>(self, value: &[u8]) -> Result<Form, E> {
        Ok(Form::Bytes(value.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Form, A::Error> {
        let mut list = Vec::new();
        while let Some(item) = items.next_element()? {
            list.push(item);
        }
        Ok(Form::List(list))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Form, A::Error> {
        let mut map = Vec::new();
        while let Some(entry) = entries.next_entry()? {
            map.push(entry);
        }
        Ok(Form::Map(map))
    }
}
