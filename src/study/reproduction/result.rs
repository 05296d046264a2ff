//! Results of experiments in comparison with the paper.

use super::Comparison;
use serde::{Deserialize, Serialize};

/// A number of the paper and the corresponding result of zsim.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ComparedNumber {
    /// Number of the figure in the paper.
    pub figure: String,
    /// Name of the quantity.
    pub what: String,
    /// Number in the paper, as accurate as it can be read.
    pub paper: String,
    /// Result of zsim.
    pub ours: String,
    /// The result as a number with a verdict; `None` where the paper shows no number and no other statement.
    #[serde(default)]
    pub comparison: Option<Comparison>,
}

/// Result of an experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExperimentResult {
    /// Compared numbers.
    pub rows: Vec<ComparedNumber>,
    /// Notes: assumptions and discrepancies.
    pub notes: Vec<String>,
}
