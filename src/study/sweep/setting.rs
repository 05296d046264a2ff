//! Value of a setting of a run.

use serde::{Deserialize, Serialize};

/// Value of a setting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(untagged)]
pub enum Setting {
    /// `true` or `false`.
    Switch(bool),
    /// A non-negative integer.
    Count(u64),
    /// A real number.
    Number(f64),
    /// A name of a spec, or of an option of the setting.
    Text(String),
}

impl std::fmt::Display for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Switch(on) => write!(f, "{on}"),
            Self::Count(count) => write!(f, "{count}"),
            Self::Number(number) => write!(f, "{number}"),
            Self::Text(word) => f.write_str(word),
        }
    }
}

impl Setting {
    /// The value as a number; `None` for switches and text.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Count(count) => Some(*count as f64),
            Self::Number(number) => Some(*number),
            Self::Switch(_) | Self::Text(_) => None,
        }
    }

    /// The value for labels and tables: a real number has at most six significant digits.
    pub(super) fn label(&self) -> String {
        match self {
            // 3.0999999999999996 becomes 3.1.
            Self::Number(number) => {
                format!("{number:.5e}").parse().map_or_else(|_| self.to_string(), |x: f64| x.to_string())
            }
            _ => self.to_string(),
        }
    }

    /// The value as JSON.
    pub(super) fn value(&self) -> serde_json::Value {
        match self {
            Self::Switch(on) => (*on).into(),
            Self::Count(count) => (*count).into(),
            Self::Number(number) => (*number).into(),
            Self::Text(word) => word.as_str().into(),
        }
    }
}
