//! Goals and limits of measures, which define a Pareto front.

use super::Measure;
use serde::{Deserialize, Serialize};
use zsim_base::spec::checked;

/// A goal for a measure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GoalSpec {
    /// The measure.
    #[serde(alias = "figure")]
    pub measure: Measure,
    /// Aim: a target value, minimum or maximum.
    pub aim: Aim,
}

/// Aim of a goal.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Aim {
    /// Reach this value.
    Target(#[serde(with = "checked::Positive")] f64),
    /// Minimise.
    Least,
    /// Maximise.
    Most,
}

impl GoalSpec {
    /// Cost of a value; lower is better. For a target, the relative deviation.
    pub fn cost(&self, value: f64) -> f64 {
        match self.aim {
            Aim::Target(target) => (value / target - 1.0).abs(),
            Aim::Least => value,
            Aim::Most => -value,
        }
    }
}

/// A limit of a measure: designs and runs outside it are not in the Pareto front.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeasureLimitSpec {
    /// The measure.
    #[serde(alias = "figure")]
    pub measure: Measure,
    /// Minimum value.
    #[serde(default)]
    pub least: Option<f64>,
    /// Maximum value.
    #[serde(default)]
    pub most: Option<f64>,
}

impl MeasureLimitSpec {
    /// Relative violation of the limit; 0 if the value is within.
    pub fn excess(&self, value: f64) -> f64 {
        let below = self.least.map_or(0.0, |least| (least - value) / least.abs().max(1e-9));
        let above = self.most.map_or(0.0, |most| (value - most) / most.abs().max(1e-9));
        below.max(above).max(0.0)
    }
}
