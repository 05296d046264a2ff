//! Manifest of a run: version, scenario and specs.

use super::StudyError;
use crate::estimation::EstimatorSpec;
use crate::recording::Reader;
use crate::simulation::{Scenario, Simulation, Specs};
use crate::spec::{self, Source, SpecError};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Inputs of a run: with these and the same version of zsim, the run can be repeated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Version of zsim.
    pub version: String,
    /// Scenario with the random seed; `None` if the recording was not made by zsim.
    #[serde(default)]
    pub scenario: Option<Scenario>,
    /// All specs of the simulation; `None` if the recording was not made by zsim.
    #[serde(default)]
    pub specs: Option<Specs>,
    /// Settings of the estimator; `None` in the manifest of a recording, which does not depend on them.
    #[serde(default)]
    pub estimator: Option<EstimatorSpec>,
}

impl Manifest {
    /// The manifest of a simulation.
    pub fn of(simulation: &Simulation) -> Self {
        Self {
            scenario: Some(simulation.scenario().clone()),
            specs: Some(simulation.specs().clone()),
            ..Self::without_simulation()
        }
    }

    /// The manifest of a run without a simulation.
    pub fn without_simulation() -> Self {
        Self { version: env!("CARGO_PKG_VERSION").to_owned(), scenario: None, specs: None, estimator: None }
    }

    /// The manifest in a recording; `None` if there is none.
    ///
    /// # Errors
    /// When it cannot be parsed, for example because another version of zsim wrote it.
    pub fn in_recording(reader: &Reader) -> Result<Option<Self>, SpecError> {
        reader.manifest().map(|text| spec::parse(&Source::in_memory("the recording's manifest", text))).transpose()
    }

    /// Adds the settings of the estimator.
    #[must_use]
    pub fn with_estimator(mut self, estimator: &EstimatorSpec) -> Self {
        self.estimator = Some(estimator.clone());
        self
    }

    /// Returns the manifest as RON.
    ///
    /// # Errors
    /// When a value cannot be represented in RON.
    pub fn to_ron(&self) -> Result<String, SpecError> {
        Ok(spec::to_text(self)? + "\n")
    }

    pub(super) fn write(&self, path: &Path) -> Result<(), StudyError> {
        std::fs::write(path, self.to_ron()?).map_err(StudyError::file(path))
    }
}
