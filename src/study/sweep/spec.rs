//! Spec of a sweep: `specs/studies/NAME.ron`.

use super::base_spec::usual;
use super::{BaseSpec, ClaimSpec, GoalSpec, Measure, MeasureLimitSpec, Setting};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use zsim_base::spec::checked;

/// A sweep: a base run, the parameters to vary, and the measures to report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SweepSpec {
    /// Name in titles and of the default folder for results; that of the file by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The base run.
    pub base: BaseSpec,
    /// Axes: the parameters to vary. In a grid the other levels of an axis are compared with its first level.
    pub axes: Vec<AxisSpec>,
    /// Selection of the combinations of axis values to run.
    #[serde(default)]
    pub sampling: Sampling,
    /// Random seeds; each combination is run with each seed. By default 1 for journeys. Must be empty for closed forms, which
    /// are deterministic.
    #[serde(default)]
    pub seeds: Vec<u64>,
    /// Measures to report for each run, the most important first. By default `position_rmse_m` for journeys and `peak_gain` for
    /// gains.
    #[serde(default)]
    pub measures: Vec<Measure>,
    /// Name of an axis: the summary is repeated separately for each of its levels.
    #[serde(default)]
    pub by: Option<String>,
    /// Goals of the Pareto front, at least two; no front if empty.
    #[serde(default)]
    pub front: Vec<GoalSpec>,
    /// Limits of the runs in the Pareto front.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub limits: Vec<MeasureLimitSpec>,
    /// Statements about the result. They are judged when all runs are finished; `zsim study` fails if one is missed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub claims: Vec<ClaimSpec>,
}

/// An axis: a parameter to vary.
///
/// A path lists the nested keys of a setting: `head.linkage.spring.spring.coil.wire_diameter_mm`. Keys may be omitted if
/// the path stays unambiguous: `head.wire_diameter_mm`. A number is an index into a list, from 0:
/// `head.parts.0.mass_kg`. The path of a spec itself, such as `imu`, takes names of specs as values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum AxisSpec {
    /// Listed values of one setting.
    Values {
        /// Path of the setting.
        path: String,
        /// Values of the setting.
        values: Vec<Setting>,
        /// Fraction of the runs with the first value, between 0 and 1; only for sampled designs. By default all values
        /// have the same fraction.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        first_share: Option<f64>,
        /// Name of the column; the last key of the path by default.
        #[serde(default)]
        name: Option<String>,
    },
    /// Linearly spaced values of one setting, or a continuous range if sampled.
    Linear {
        /// Path of the setting.
        path: String,
        /// First value.
        #[serde(with = "checked::Finite")]
        from: f64,
        /// Last value.
        #[serde(with = "checked::Finite")]
        to: f64,
        /// Number of values, at least 2; required in a grid, invalid otherwise.
        #[serde(default)]
        steps: Option<usize>,
        /// Name of the column; the last key of the path by default.
        #[serde(default)]
        name: Option<String>,
    },
    /// Logarithmically spaced values of one setting, or a continuous logarithmic range if sampled.
    Log {
        /// Path of the setting.
        path: String,
        /// First value, above 0.
        #[serde(with = "checked::Positive")]
        from: f64,
        /// Last value, above 0.
        #[serde(with = "checked::Positive")]
        to: f64,
        /// Number of values, at least 2; required in a grid, invalid otherwise.
        #[serde(default)]
        steps: Option<usize>,
        /// Name of the column; the last key of the path by default.
        #[serde(default)]
        name: Option<String>,
    },
    /// Named levels; each sets any number of settings.
    Levels {
        /// Name of the column.
        name: String,
        /// The levels.
        levels: Vec<LevelSpec>,
    },
}

/// A named level: settings and their values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LevelSpec {
    /// Name of the level in tables.
    pub name: String,
    /// Values by path of the setting: `"estimator.solve.match_weight": 0.5`.
    #[serde(default)]
    pub set: BTreeMap<String, Setting>,
}

/// Selection of the combinations of axis values to run.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Sampling {
    /// Full factorial: all combinations; the last axis varies fastest.
    #[default]
    Grid,
    /// Latin hypercube: one sample in each of `count` equal bins of each axis (McKay, Beckman and Conover 1979).
    LatinHypercube {
        /// Number of samples.
        count: usize,
        /// Random seed of the samples.
        #[serde(default = "usual::seed")]
        seed: u64,
    },
    /// First points of the Sobol sequence (directions of Joe and Kuo 2008); powers of two fill the space most evenly.
    Sobol {
        /// Number of samples.
        count: usize,
    },
}

impl SweepSpec {
    /// A grid over no axis of a base run, without seeds and measures.
    pub(crate) fn of(base: BaseSpec) -> Self {
        Self {
            name: None,
            base,
            axes: Vec::new(),
            sampling: Sampling::Grid,
            seeds: Vec::new(),
            measures: Vec::new(),
            by: None,
            front: Vec::new(),
            limits: Vec::new(),
            claims: Vec::new(),
        }
    }

    /// The sweep with the seeds and measures that its base run has by default, where the spec has none.
    pub(super) fn with_usual_values(mut self) -> Self {
        let (seeds, measures): (&[u64], &[Measure]) = match self.base {
            BaseSpec::Journey(_) => (&[usual::SEED], &[Measure::POSITION_RMSE_M]),
            BaseSpec::Gains { .. } => (&[], &[Measure::PEAK_GAIN]),
            BaseSpec::Spring { .. } => (&[], &[]),
        };
        if self.seeds.is_empty() {
            self.seeds = seeds.to_vec();
        }
        if self.measures.is_empty() {
            self.measures = measures.to_vec();
        }
        self
    }
}

impl AxisSpec {
    /// An axis with these values of the setting `path`.
    pub(crate) fn values(path: &str, values: Vec<Setting>) -> Self {
        Self::Values { path: path.to_owned(), values, first_share: None, name: None }
    }

    /// Name of the column.
    pub fn name(&self) -> &str {
        let (path, name) = match self {
            Self::Levels { name, .. } => return name,
            Self::Values { path, name, .. } | Self::Linear { path, name, .. } | Self::Log { path, name, .. } => {
                (path, name)
            }
        };
        name.as_deref().unwrap_or_else(|| path.rsplit('.').next().unwrap_or(path))
    }

    /// Text of the spec that locates this axis in error messages.
    pub(super) fn anchor(&self) -> String {
        match self {
            Self::Levels { name, .. } => format!("\"{name}\""),
            Self::Values { path, .. } | Self::Linear { path, .. } | Self::Log { path, .. } => format!("\"{path}\""),
        }
    }
}
