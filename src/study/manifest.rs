use super::StudyError;
use crate::estimation::EstimatorSpec;
use crate::recording::Reader;
use crate::simulation::{Scenario, Simulation, Specs};
use crate::spec::{self, Source, SpecError};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A run as it was: with it and this version of zsim it can be repeated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Version of zsim.
    pub version: String,
    /// What was asked for, the seed with it; of a recording by others nothing.
    #[serde(default)]
    pub scenario: Option<Scenario>,
    /// The specs of the simulation, whole.
    #[serde(default)]
    pub specs: Option<Specs>,
    /// The estimator's settings; in a recording itself nothing, as it does not depend on them.
    #[serde(default)]
    pub estimator: Option<EstimatorSpec>,
}

impl Manifest {
    /// The manifest of a simulation.
    pub fn of(simulation: &Simulation) -> Self {
        Self {
            scenario: Some(simulation.scenario().clone()),
            specs: Some(simulation.specs().clone()),
            ..Self::of_recording_by_others()
        }
    }

    /// The manifest of a run without a simulation.
    pub fn of_recording_by_others() -> Self {
        Self { version: env!("CARGO_PKG_VERSION").to_owned(), scenario: None, specs: None, estimator: None }
    }

    /// The manifest within a recording; `None` in one by others, or by a version of zsim that wrote it otherwise.
    pub fn within(reader: &Reader) -> Option<Self> {
        spec::parse(&Source::in_memory("the recording's manifest", reader.manifest()?)).ok()
    }

    /// The same with the estimator's settings.
    #[must_use]
    pub fn with_estimator(mut self, estimator: &EstimatorSpec) -> Self {
        self.estimator = Some(estimator.clone());
        self
    }

    /// As RON.
    ///
    /// # Errors
    /// When it has a form that RON cannot write.
    pub fn text(&self) -> Result<String, SpecError> {
        Ok(spec::to_text(self)? + "\n")
    }

    pub(super) fn write(&self, path: &Path) -> Result<(), StudyError> {
        std::fs::write(path, self.text()?).map_err(StudyError::file(path))
    }
}
