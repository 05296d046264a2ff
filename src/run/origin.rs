//! Origin of a recording.

use super::Manifest;
use super::cloud::Surroundings;
use super::sensor_models::RecordedSensors;
use zsim_simulation::SimulationSummary;

/// Origin of a recording; only the evaluation uses it, not the estimator.
pub(super) struct Origin<'a> {
    /// Manifest of the recording, with the settings of the estimator.
    pub manifest: &'a Manifest,
    /// The sensors of the simulation, as far as they are known.
    pub sensors: RecordedSensors<'a>,
    /// Scene and carrier, if they are known.
    pub surroundings: Option<Surroundings<'a>>,
    /// Summary of the simulation, if it ran in this process.
    pub simulation: Option<&'a SimulationSummary>,
}
