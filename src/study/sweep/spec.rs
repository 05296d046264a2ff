//! A sweep as it is written: `specs/studies/NAME.ron`.

use super::Measure;
use crate::spec::checked;
use crate::study::spring::Shake;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What is varied about a run, and what is told of each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SweepSpec {
    /// The run that is varied.
    pub base: BaseSpec,
    /// What is varied. In a grid the first level of an axis is what its others are compared with.
    pub axes: Vec<AxisSpec>,
    /// Which combinations of the axes are run.
    pub sampling: Sampling,
    /// Seeds: each combination is run with each. Closed forms have no chance in them, and none.
    #[serde(default)]
    pub seeds: Vec<u64>,
    /// What is told of a run, the most important first.
    pub measures: Vec<Measure>,
    /// The name of an axis for whose levels all is told separately too.
    #[serde(default)]
    pub by: Option<String>,
    /// What is wanted, for the set that nothing beats; two goals or more.
    #[serde(default)]
    pub front: Vec<GoalSpec>,
}

/// A run, by names: each a path, or a name in the library.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum BaseSpec {
    /// A head on its spring in a hand that nods, by closed form: no simulation, a fraction of a millisecond.
    Spring {
        /// The head and its spring.
        head: String,
        /// The hand's nod.
        shake: Shake,
    },
    /// Simulated, recorded, estimated in open loop, judged.
    Journey {
        /// The world.
        scene: String,
        /// The head and what carries it.
        head: String,
        /// How the base moves.
        motion: String,
        /// The lidar.
        lidar: String,
        /// The inertial measurement unit.
        imu: String,
        /// The sensors' clocks.
        clock: String,
        /// Faults of the sensors and of their delivery; none unless told. An axis over faults needs them here:
        /// `"none"` is a list without faults.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        faults: Option<String>,
        /// The estimator's settings.
        estimator: String,
        /// The scene's way to walk; its default one unless told.
        #[serde(default)]
        route: Option<String>,
        /// How long a run lasts, s.
        #[serde(with = "checked::Positive")]
        duration_s: f64,
        /// What a run may take.
        limit: LimitSpec,
    },
}

/// What a run may take before it counts as failed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LimitSpec {
    /// Time for a simulation, and for each estimate from it, s.
    #[serde(with = "checked::Positive")]
    pub time_s: f64,
    /// Memory of the process that does it, MiB; enforced on Linux.
    pub memory_mib: u64,
}

/// What is varied.
///
/// A path leads through a spec's keys as they are nested there: `head.linkage.spring.spring.coil.wire_diameter_mm`.
/// Keys that are not needed to tell it may be left out: `head.wire_diameter_mm`. The name of a spec itself, `imu`,
/// takes names of specs. A number in it counts from 0 in a list: `head.parts.0.mass_kg`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum AxisSpec {
    /// These values of one setting.
    Values {
        /// The setting.
        path: String,
        /// Its values.
        values: Vec<Setting>,
        /// Share of the runs that have the first value, between 0 and 1, where runs are sampled; as many as the others
        /// have by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        first_share: Option<f64>,
        /// The column's name; the last key of the path unless told.
        #[serde(default)]
        name: Option<String>,
    },
    /// Values of one setting evenly between two ends.
    Linear {
        /// The setting.
        path: String,
        /// The first value.
        #[serde(with = "checked::Finite")]
        from: f64,
        /// The last value.
        #[serde(with = "checked::Finite")]
        to: f64,
        /// How many, in a grid.
        #[serde(default)]
        steps: Option<usize>,
        /// The column's name; the last key of the path unless told.
        #[serde(default)]
        name: Option<String>,
    },
    /// The same in even ratios.
    Log {
        /// The setting.
        path: String,
        /// The first value, above 0.
        #[serde(with = "checked::Positive")]
        from: f64,
        /// The last value, above 0.
        #[serde(with = "checked::Positive")]
        to: f64,
        /// How many, in a grid.
        #[serde(default)]
        steps: Option<usize>,
        /// The column's name; the last key of the path unless told.
        #[serde(default)]
        name: Option<String>,
    },
    /// Sets of settings, each with a name.
    Levels {
        /// The column's name.
        name: String,
        /// The sets.
        levels: Vec<LevelSpec>,
    },
}

/// Settings with a name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LevelSpec {
    /// What it is called in tables.
    pub name: String,
    /// Settings by their path: `"estimator.solve.match_weight": 0.5`.
    #[serde(default)]
    pub set: BTreeMap<String, Setting>,
}

/// A setting's value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(untagged)]
pub enum Setting {
    /// On or off.
    Switch(bool),
    /// A whole number.
    Count(u64),
    /// Any number.
    Number(f64),
    /// A name, or a word that the setting knows.
    Word(String),
}

/// Which combinations of the axes are run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Sampling {
    /// All of them; the last axis changes fastest.
    Grid,
    /// So many that each axis, cut into as many parts, has one in each (McKay, Beckman and Conover 1979).
    LatinHypercube {
        /// How many.
        count: usize,
        /// From which their chance follows.
        seed: u64,
    },
    /// The first points of Sobol's sequence (directions of Joe and Kuo 2008); a power of two fills the space best.
    Sobol {
        /// How many.
        count: usize,
    },
}

/// What is wanted of a measure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GoalSpec {
    /// The measure.
    pub measure: Measure,
    /// Whether little of it is wanted, or much.
    pub aim: Aim,
}

/// How much of a measure is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Aim {
    /// As little as can be.
    Least,
    /// As much as can be.
    Most,
}

impl AxisSpec {
    /// The column's name.
    pub fn name(&self) -> &str {
        let (path, name) = match self {
            Self::Levels { name, .. } => return name,
            Self::Values { path, name, .. } | Self::Linear { path, name, .. } | Self::Log { path, name, .. } => {
                (path, name)
            }
        };
        name.as_deref().unwrap_or_else(|| path.rsplit('.').next().unwrap_or(path))
    }

    /// Words of the spec's text that tell this axis from others.
    pub(super) fn anchor(&self) -> String {
        match self {
            Self::Levels { name, .. } => format!("\"{name}\""),
            Self::Values { path, .. } | Self::Linear { path, .. } | Self::Log { path, .. } => format!("\"{path}\""),
        }
    }
}

impl std::fmt::Display for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Switch(on) => write!(f, "{on}"),
            Self::Count(count) => write!(f, "{count}"),
            Self::Number(number) => write!(f, "{number}"),
            Self::Word(word) => f.write_str(word),
        }
    }
}

impl Setting {
    /// As a number, where it is one.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Count(count) => Some(*count as f64),
            Self::Number(number) => Some(*number),
            Self::Switch(_) | Self::Word(_) => None,
        }
    }

    pub(super) fn value(&self) -> serde_json::Value {
        match self {
            Self::Switch(on) => (*on).into(),
            Self::Count(count) => (*count).into(),
            Self::Number(number) => (*number).into(),
            Self::Word(word) => word.as_str().into(),
        }
    }
}
