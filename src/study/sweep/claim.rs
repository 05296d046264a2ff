//! Claims of a study: statements about its result, which are judged when all of its runs are finished.

use super::{Measure, Setting};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A statement about the result of a study. `zsim study` fails if one of them is missed.
///
/// A place, such as `at`, selects runs by the value or level of axes: `{"scene": "office", "imu": "3dm_gx2"}`. Axes that it
/// does not name take all values; without any, all runs are meant. Numbers are in the unit of the measure's key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum ClaimSpec {
    /// The median of a measure over runs is at most `most` or at least `least`, and no run is beyond `worst`.
    Median {
        /// Name of the quantity.
        what: String,
        /// Place of the runs.
        #[serde(default)]
        at: Place,
        /// The measure, one of `measures`.
        measure: Measure,
        /// Goal for the median, at most; either this or `least`.
        #[serde(default)]
        most: Option<f64>,
        /// Goal for the median, at least.
        #[serde(default)]
        least: Option<f64>,
        /// Limit of the worst run; by default twice `most`, or half of `least`.
        #[serde(default)]
        worst: Option<f64>,
        /// Figure or section of a paper in which the quantity is.
        #[serde(default)]
        figure: Option<String>,
        /// Number in the paper.
        #[serde(default)]
        paper: Option<f64>,
        /// What the paper states, if more than the number.
        #[serde(default)]
        paper_text: Option<String>,
    },
    /// The median of a measure is smaller at one place than at another.
    Smaller {
        /// The statement.
        what: String,
        /// The measure, one of `measures`.
        measure: Measure,
        /// Place with the smaller median.
        at: Place,
        /// Place with the larger median.
        than: Place,
        /// Figure or section of a paper with this statement.
        #[serde(default)]
        figure: Option<String>,
    },
    /// No run has the status "good" and an error above both 5 cm and 1 % of the path: a limit of the method that the result must
    /// state. The study measures `status`, `aligned_rmse_m` and `way_m`.
    Warned {
        /// The limit.
        what: String,
        /// Place of the runs.
        #[serde(default)]
        at: Place,
        /// Figure or section of a paper with this limit.
        #[serde(default)]
        figure: Option<String>,
    },
}

/// Value or level by axis.
pub type Place = BTreeMap<String, Setting>;

impl ClaimSpec {
    /// Measures that [`ClaimSpec::Warned`] needs.
    pub(super) const OF_WARNED: [Measure; 3] =
        [Measure::STATUS, Measure::named("aligned_rmse_m"), Measure::named("way_m")];

    /// The statement or the quantity.
    pub(super) fn what(&self) -> &str {
        match self {
            Self::Median { what, .. } | Self::Smaller { what, .. } | Self::Warned { what, .. } => what,
        }
    }

    /// Figure or section of the paper.
    pub(super) fn figure(&self) -> Option<&str> {
        match self {
            Self::Median { figure, .. } | Self::Smaller { figure, .. } | Self::Warned { figure, .. } => {
                figure.as_deref()
            }
        }
    }

    /// The measures that it needs.
    pub(super) fn measures(&self) -> &[Measure] {
        match self {
            Self::Median { measure, .. } | Self::Smaller { measure, .. } => std::slice::from_ref(measure),
            Self::Warned { .. } => &Self::OF_WARNED,
        }
    }

    /// The places that it names.
    pub(super) fn places(&self) -> Vec<&Place> {
        match self {
            Self::Median { at, .. } | Self::Warned { at, .. } => vec![at],
            Self::Smaller { at, than, .. } => vec![at, than],
        }
    }
}
