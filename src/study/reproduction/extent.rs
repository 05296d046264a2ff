//! How much of an experiment is repeated.

use serde::Deserialize;
use serde::Serialize;

/// Extent of an experiment: the complete one, or a smoke test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Extent {
    /// The complete experiment.
    Whole,
    /// A smoke test that takes seconds; its figures are not results.
    Quick,
}

impl Extent {
    /// Name of the folder of all experiments, and of their table without extension.
    pub fn folder(self) -> &'static str {
        match self {
            Self::Whole => "paper",
            Self::Quick => "paper-quick",
        }
    }
}
