//! Trees from JSON.

use super::node::{Entry, FROM_JSON, Kind, Node};
use super::number::{Notation, Number};

impl From<&serde_json::Value> for Node {
    fn from(value: &serde_json::Value) -> Self {
        let kind = match value {
            serde_json::Value::Null => Kind::Name("null".into()),
            serde_json::Value::Bool(true) => Kind::Name("true".into()),
            serde_json::Value::Bool(false) => Kind::Name("false".into()),
            serde_json::Value::Number(number) => Kind::Number(number.into()),
            serde_json::Value::String(text) => Kind::String(text.as_str().into()),
            serde_json::Value::Array(items) => Kind::List(items.iter().map(Self::from).collect()),
            serde_json::Value::Object(object) => Kind::Struct(object.iter().map(entry).collect()),
        };
        Self { start: FROM_JSON, end: FROM_JSON, kind }
    }
}

fn entry((key, value): (&String, &serde_json::Value)) -> Entry {
    (Node { start: FROM_JSON, end: FROM_JSON, kind: Kind::String(key.as_str().into()) }, value.into())
}

impl From<&serde_json::Number> for Number {
    fn from(number: &serde_json::Number) -> Self {
        let integer = |magnitude, negative| Self::Integer { magnitude, negative, notation: Notation::Decimal };
        match (number.as_u64(), number.as_i64()) {
            (Some(magnitude), _) => integer(magnitude, false),
            (None, Some(negative)) => integer(negative.unsigned_abs(), true),
            (None, None) => Self::Real { value: number.as_f64().unwrap_or(f64::NAN), bits: 0 },
        }
    }
}
