//! The keys that a text lacks.

use serde_json::Value;

/// A struct or variant without a key that it needs.
///
/// Reading ends at the first such key. The schema of the type knows the others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Missing {
    /// Name of the struct or variant.
    pub owner: String,
    /// The first key that is missing.
    pub key: &'static str,
    /// Keys that the type knows.
    pub known: &'static [&'static str],
    /// Keys of the text.
    pub present: Vec<String>,
}

impl Missing {
    /// All keys that are missing; `schema` is that of the whole spec.
    pub fn keys<'s>(&'s self, schema: &'s Value) -> Vec<&'s str> {
        let required = self.required(schema).unwrap_or_default();
        let is_missing = |key: &&str| *key == self.key || !self.present.iter().any(|present| present == *key);
        let mut keys: Vec<&str> =
            self.known.iter().copied().filter(|key| required.contains(key)).filter(is_missing).collect();
        if keys.is_empty() {
            keys.push(self.key);
        }
        keys
    }

    /// The required keys of the struct in `schema` that has exactly the known keys.
    fn required<'s>(&self, schema: &'s Value) -> Option<Vec<&'s str>> {
        self.required_here(schema).or_else(|| match schema {
            Value::Object(parts) => parts.values().find_map(|part| self.required(part)),
            Value::Array(parts) => parts.iter().find_map(|part| self.required(part)),
            _ => None,
        })
    }

    fn required_here<'s>(&self, schema: &'s Value) -> Option<Vec<&'s str>> {
        let properties = schema.get("properties")?.as_object()?;
        let is_same =
            properties.len() == self.known.len() && self.known.iter().all(|key| properties.contains_key(*key));
        let required: Vec<&str> = schema.get("required")?.as_array()?.iter().filter_map(Value::as_str).collect();
        (is_same && required.contains(&self.key)).then_some(required)
    }
}
