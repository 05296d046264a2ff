//! Manifest of a run: version and inputs.

use super::RunError;
use serde::{Deserialize, Serialize};
use std::path::Path;
use zsim_base::files::replace_text;
use zsim_base::spec::{self, Source, SpecError};
use zsim_estimation::EstimatorSpec;
use zsim_recording::Reader;
use zsim_sensors::{ImuSpec, LidarSpec};
use zsim_simulation::{Run, Simulation};
use zsim_world::{World, WorldError};

/// Inputs of a run: with these and the same version of zsim, the run can be repeated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Version of zsim.
    pub version: String,
    /// Inputs of the simulation; `None` if the recording was not made by zsim.
    #[serde(default)]
    pub run: Option<Run>,
    /// Settings of the estimator; `None` in the manifest of a recording, which does not depend on them.
    #[serde(default)]
    pub estimator: Option<EstimatorSpec>,
}

impl Manifest {
    /// The manifest of a simulation.
    pub fn of(simulation: &Simulation) -> Self {
        Self { run: Some(simulation.inputs().clone().without_folders()), ..Self::without_simulation() }
    }

    /// The manifest of a run without a simulation.
    pub fn without_simulation() -> Self {
        Self { version: env!("CARGO_PKG_VERSION").to_owned(), run: None, estimator: None }
    }

    /// The manifest in a recording; `None` if there is none.
    ///
    /// # Errors
    /// When it cannot be parsed, for example because another version of zsim wrote it.
    pub fn in_recording(reader: &Reader) -> Result<Option<Self>, SpecError> {
        let text = reader.manifest().map(Self::source);
        let help = "if another version of zsim wrote the recording, use that version";
        text.map(|source| spec::parse(&source).map_err(|error: SpecError| error.with_help(help))).transpose()
    }

    /// The manifest of a recording as the source of specs, for errors.
    pub(super) fn source(text: &str) -> Source {
        Source::in_memory("the recording's manifest", text)
    }

    /// Builds the scene of the simulation; `None` without simulation.
    ///
    /// # Errors
    /// When a mesh file of the scene is missing.
    pub fn world(&self) -> Option<Result<World, WorldError>> {
        let scene = &self.run.as_ref()?.scene.spec;
        Some(World::build(scene, &Source::in_memory("the recording's scene", "")))
    }

    /// The sensors of the simulation; none are known without simulation.
    pub(super) fn sensors(&self) -> RecordedSensors {
        self.run.as_ref().map(RecordedSensors::of).unwrap_or_default()
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

    pub(super) fn write(&self, path: &Path) -> Result<(), RunError> {
        Ok(replace_text(path, &self.to_ron()?)?)
    }
}

/// Sensors of the simulation in a recording's manifest; `None` for those that are not known.
#[derive(Debug, Clone, Default)]
pub(super) struct RecordedSensors {
    pub imu: Option<ImuSpec>,
    pub lidar: Option<LidarSpec>,
}

impl RecordedSensors {
    /// The sensors of `run`.
    pub fn of(run: &Run) -> Self {
        Self { imu: Some(run.imu.spec.clone()), lidar: Some(run.lidar.spec.clone()) }
    }
}
