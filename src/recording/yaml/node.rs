//! A node of a document, and what serde reads from it.

use super::error::{Position, YamlError};
use serde::de::value::SeqDeserializer;
use serde::de::{DeserializeSeed, Deserializer, Error, IntoDeserializer, MapAccess, Unexpected, Visitor};
use serde::forward_to_deserialize_any;

/// A node and where it starts.
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub position: Position,
    pub value: Value,
}

/// The value of a node.
#[derive(Debug, Clone)]
pub(super) enum Value {
    /// A text, and whether it is without quotes, so that it can be null, a truth value or a number.
    Scalar {
        text: String,
        is_plain: bool,
    },
    Sequence(Vec<Node>),
    /// Keys and values; keys are scalars.
    Mapping(Vec<(Node, Node)>),
}

impl Node {
    pub(super) fn null() -> Self {
        Self { position: (1, 1), value: Value::Scalar { text: String::new(), is_plain: true } }
    }

    fn is_null(&self) -> bool {
        matches!(&self.value, Value::Scalar { text, is_plain: true } if matches!(text.as_str(), "" | "~" | "null" | "Null" | "NULL"))
    }
}

/// The number that a text is, as in YAML.
fn number(text: &str) -> Option<f64> {
    let (sign, magnitude) = match text.as_bytes().first()? {
        b'-' => (-1.0, &text[1..]),
        b'+' => (1.0, &text[1..]),
        _ => (1.0, text),
    };
    match magnitude {
        ".inf" | ".Inf" | ".INF" => Some(sign * f64::INFINITY),
        ".nan" | ".NaN" | ".NAN" => Some(f64::NAN),
        // Rust also reads `inf` and `nan`, which are texts in YAML, and a second sign.
        _ => magnitude.starts_with(|c: char| c.is_ascii_digit() || c == '.').then(|| text.parse().ok())?,
    }
}

impl<'de> Deserializer<'de> for Node {
    type Error = YamlError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, YamlError> {
        let position = self.position;
        let is_null = self.is_null();
        let visited = match self.value {
            _ if is_null => visitor.visit_unit(),
            Value::Scalar { text, is_plain: true } => match (text.as_str(), number(&text)) {
                ("true" | "True" | "TRUE", _) => visitor.visit_bool(true),
                ("false" | "False" | "FALSE", _) => visitor.visit_bool(false),
                (_, Some(number)) => visitor.visit_f64(number),
                (_, None) => visitor.visit_string(text),
            },
            Value::Scalar { text, .. } => visitor.visit_string(text),
            Value::Sequence(nodes) => visitor.visit_seq(SeqDeserializer::new(nodes.into_iter())),
            Value::Mapping(entries) => visitor.visit_map(Entries { entries: entries.into_iter(), value: None }),
        };
        visited.map_err(|error: YamlError| error.at(position))
    }

    /// A number; with quotes too.
    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, YamlError> {
        let Value::Scalar { text, .. } = &self.value else { return self.deserialize_any(visitor) };
        let invalid = || YamlError::invalid_type(Unexpected::Str(text), &visitor).at(self.position);
        let number = number(text).ok_or_else(invalid)?;
        visitor.visit_f64(number)
    }

    fn deserialize_str<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, YamlError> {
        match self.value {
            Value::Scalar { text, .. } => {
                visitor.visit_string(text).map_err(|error: YamlError| error.at(self.position))
            }
            _ => self.deserialize_any(visitor),
        }
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, YamlError> {
        self.deserialize_str(visitor)
    }

    fn deserialize_identifier<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, YamlError> {
        self.deserialize_str(visitor)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, YamlError> {
        if self.is_null() { visitor.visit_none() } else { visitor.visit_some(self) }
    }

    /// A mapping; null is an empty one.
    fn deserialize_struct<V: Visitor<'de>>(
        mut self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, YamlError> {
        if self.is_null() {
            self.value = Value::Mapping(Vec::new());
        }
        if let Value::Sequence(_) = self.value {
            return Err(YamlError::invalid_type(Unexpected::Seq, &visitor).at(self.position));
        }
        self.deserialize_any(visitor)
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, YamlError> {
        visitor.visit_unit()
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 char bytes byte_buf unit unit_struct newtype_struct seq tuple
        tuple_struct map enum
    }
}

impl IntoDeserializer<'_, YamlError> for Node {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

/// The entries of a mapping that serde has not read yet.
struct Entries {
    entries: std::vec::IntoIter<(Node, Node)>,
    value: Option<Node>,
}

impl<'de> MapAccess<'de> for Entries {
    type Error = YamlError;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, YamlError> {
        let Some((key, value)) = self.entries.next() else { return Ok(None) };
        self.value = Some(value);
        seed.deserialize(key).map(Some)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, YamlError> {
        seed.deserialize(self.value.take().unwrap_or_else(Node::null))
    }
}
