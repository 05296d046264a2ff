//! Results of experiments in comparison with the paper.

use crate::sweep::ComparedNumber;
use serde::{Deserialize, Serialize};

/// Result of an experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExperimentResult {
    /// Compared numbers.
    pub rows: Vec<ComparedNumber>,
    /// Notes: assumptions and discrepancies.
    pub notes: Vec<String>,
}
