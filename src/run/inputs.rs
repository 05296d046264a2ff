//! Inputs of a run.

use super::timing::TimingSpec;
use serde::{Deserialize, Serialize};
use zsim_base::spec::Named;
use zsim_dynamics::HeadSpec;
use zsim_estimation::EstimatorSpec;
use zsim_motion::MotionSpec;
use zsim_sensors::LidarSpec;
use zsim_simulation::Run;

/// Inputs of a run: the simulation, the estimator, timing errors between them, and a second system.
///
/// A study varies them by their paths in the serialised form.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunInputs {
    /// Inputs of the simulation.
    #[serde(flatten)]
    pub simulation: Run,
    /// Settings of the estimator.
    pub estimator: Named<EstimatorSpec>,
    /// Timing errors between the recording and the estimator.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timing: Option<TimingSpec>,
    /// A second system, with whose map that of the run is compared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<ReferenceInputs>,
    /// Whether the estimator ignores the sensor models in the recording, as for a recording of unknown sensors.
    #[serde(default)]
    pub ignore_manifest: bool,
}

impl RunInputs {
    /// A simulation with an estimator, without timing errors.
    pub fn new(simulation: Run, estimator: Named<EstimatorSpec>) -> Self {
        Self { simulation, estimator, timing: None, reference: None, ignore_manifest: false }
    }
}

/// Specs of a reference system; the others are those of the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReferenceInputs {
    /// Head and its mount.
    pub head: Named<HeadSpec>,
    /// Motion of the base.
    pub motion: Named<MotionSpec>,
    /// Lidar.
    pub lidar: Named<LidarSpec>,
}
