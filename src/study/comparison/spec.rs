//! A comparison as it is written: `specs/studies/NAME.ron`.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The name of the variant that changes nothing.
pub const BASE: &str = "base";

/// What is compared, and on which runs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ComparisonSpec {
    /// What all runs have in common.
    pub base: BaseSpec,
    /// Where and how the head is carried.
    pub places: Vec<PlaceSpec>,
    /// Seeds: each place is simulated once with each.
    pub seeds: Vec<u64>,
    /// What is told of the runs, the most important first; `runs.csv` has all.
    pub measures: Vec<super::Measure>,
    /// What is changed.
    pub variants: Vec<VariantSpec>,
}

/// What all runs have in common, by name: each a path, or a name in the library.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BaseSpec {
    /// The head and its spring.
    pub head: String,
    /// The lidar.
    pub lidar: String,
    /// The inertial measurement unit.
    pub imu: String,
    /// The sensors' clocks.
    pub clock: String,
    /// The estimator's settings.
    pub estimator: String,
    /// How long a run lasts, s.
    #[serde(deserialize_with = "crate::spec::checked::positive")]
    pub duration_s: f64,
}

/// A scene, and how the head is carried through it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaceSpec {
    /// The world.
    pub scene: String,
    /// How the base moves.
    pub motion: String,
}

/// Settings that differ from the base's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VariantSpec {
    /// What it is called in tables.
    pub name: String,
    /// Settings of the estimator by their path, `"solve.match_weight": 0.5`.
    pub set: BTreeMap<String, Setting>,
}

/// A setting's value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Setting {
    /// On or off.
    Switch(bool),
    /// A whole number.
    Count(u64),
    /// Any number.
    Number(f64),
}
