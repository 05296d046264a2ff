//! Inputs of a reference system.

use super::ReferenceSpec;
use crate::StudyError;
use serde::{Deserialize, Serialize};
use zsim_base::spec::{Named, Source, name_from};
use zsim_dynamics::HeadSpec;
use zsim_motion::MotionSpec;
use zsim_sensors::LidarSpec;

/// Specs of a reference system.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct ReferenceInputs {
    pub(super) head: Named<HeadSpec>,
    pub(super) motion: Named<MotionSpec>,
    pub(super) lidar: Named<LidarSpec>,
}

impl ReferenceInputs {
    /// Loads the specs that `spec`, read from `source`, names.
    ///
    /// # Errors
    /// If a spec is missing or invalid.
    pub(super) fn load(spec: &ReferenceSpec, source: &Source) -> Result<Self, StudyError> {
        Ok(Self {
            head: Named::load(&name_from(source, &spec.head))?,
            motion: Named::load(&name_from(source, &spec.motion))?,
            lidar: Named::load(&name_from(source, &spec.lidar))?,
        })
    }
}
