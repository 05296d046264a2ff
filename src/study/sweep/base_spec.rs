//! The run that a sweep varies.

use serde::{Deserialize, Serialize};
use zsim_base::spec::checked;
use zsim_head::gains::GainsSpec;
use zsim_head::spring::Shake;
use zsim_run::timing::TimingSpec;
use zsim_simulation::Scenario;

/// The base run. Each spec is a path or a name in the library.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
#[expect(clippy::large_enum_variant, reason = "a sweep has only one base run")]
pub enum BaseSpec {
    /// A head on its spring, shaken by a hand, in closed form without simulation; takes below 1 ms.
    Spring {
        /// Head with its spring.
        #[serde(default = "usual::head")]
        head: String,
        /// Shake of the hand.
        #[serde(default)]
        shake: Shake,
    },
    /// The gains of a head, by a simulation on a base that is shaken along or about one axis.
    Gains {
        /// Head with its linkage.
        #[serde(default = "usual::head")]
        head: String,
        /// Axis and settings of the measurement.
        gains: GainsSpec,
    },
    /// A journey: simulation, recording, open-loop estimation, evaluation.
    Journey(JourneySpec),
}

/// A journey: simulation, recording, open-loop estimation, evaluation. Each spec is a path or a name in the library.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JourneySpec {
    /// Scene.
    pub scene: String,
    /// Head and its mount.
    #[serde(default = "usual::head")]
    pub head: String,
    /// Motion of the base.
    #[serde(default = "usual::motion")]
    pub motion: String,
    /// Lidar.
    #[serde(default = "usual::lidar")]
    pub lidar: String,
    /// Inertial measurement unit.
    #[serde(default = "usual::imu")]
    pub imu: String,
    /// Clocks of the sensors.
    #[serde(default = "usual::clock")]
    pub clock: String,
    /// Faults of the sensors and of data delivery; none by default. An axis over faults requires this key; `"none"`
    /// is a list without faults.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub faults: Option<String>,
    /// A second IMU on the base; none by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_imu: Option<String>,
    /// Settings of the estimator.
    #[serde(default = "usual::estimator")]
    pub estimator: String,
    /// Timing errors that replace the true offset of the clocks, and the evaluation of the map with them; none by
    /// default. An axis over timing requires this key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timing: Option<TimingSpec>,
    /// A second system in the same scene; the map of each run is compared with its map. None by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<ReferenceSpec>,
    /// Whether the estimator ignores the sensor models in the recording's manifest, as for a recording of unknown
    /// sensors.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub ignore_manifest: bool,
    /// Route in the scene; the scene's default route if omitted.
    #[serde(default)]
    pub route: Option<String>,
    /// Duration of a run, s.
    #[serde(default = "usual::duration_s", with = "checked::Positive")]
    pub duration_s: f64,
    /// Limits of computing time and memory; 600 s and 4 GiB by default.
    #[serde(default)]
    pub limit: LimitSpec,
}

impl BaseSpec {
    /// Runs per batch: of fast runs, the work that a kill loses at most on each thread.
    pub(super) fn runs_per_batch(&self) -> u64 {
        if matches!(self, Self::Spring { .. }) { 250 } else { 1 }
    }
}

impl JourneySpec {
    /// The usual journey in a scene.
    pub(crate) fn in_scene(scene: &str) -> Self {
        Self {
            scene: scene.to_owned(),
            head: usual::head(),
            motion: usual::motion(),
            lidar: usual::lidar(),
            imu: usual::imu(),
            clock: usual::clock(),
            faults: None,
            base_imu: None,
            estimator: usual::estimator(),
            timing: None,
            reference: None,
            ignore_manifest: false,
            route: None,
            duration_s: usual::duration_s(),
            limit: LimitSpec::default(),
        }
    }

    /// The journey with another scenario and estimator.
    #[must_use]
    pub fn in_scenario(self, new: Scenario, estimator: &str) -> Self {
        let Scenario { scene, head, motion, lidar, imu, clock, base_imu, faults, route, duration_s, seed: _ } = new;
        let estimator = estimator.to_owned();
        Self { scene, head, motion, lidar, imu, clock, base_imu, faults, route, duration_s, estimator, ..self }
    }
}

/// A reference system: another head, lidar and motion in the scene of a run, with its IMU, clocks, estimator, duration and seed.
///
/// It has its own simulation: neither system is in the other's view.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReferenceSpec {
    /// Head and its mount.
    pub head: String,
    /// Motion of the base.
    #[serde(default = "usual::motion")]
    pub motion: String,
    /// Lidar.
    #[serde(default = "usual::lidar")]
    pub lidar: String,
}

/// Limits of computing time and memory; a run that exceeds them counts as failed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LimitSpec {
    /// Time limit of a simulation, and of each estimate from it, s.
    #[serde(with = "checked::Positive")]
    pub time_s: f64,
    /// Memory limit of the worker process, MiB; enforced only on Linux.
    pub memory_mib: u64,
}

impl Default for LimitSpec {
    fn default() -> Self {
        Self { time_s: 600.0, memory_mib: 4096 }
    }
}

/// The values of keys that are omitted: those of a simulation on the command line.
pub(crate) mod usual {
    use zsim_simulation::Scenario;

    /// Random seed.
    pub const SEED: u64 = 1;

    pub fn seed() -> u64 {
        SEED
    }

    pub fn seeds() -> Vec<u64> {
        vec![SEED]
    }

    pub fn time_limit_s() -> f64 {
        super::LimitSpec::default().time_s
    }

    fn scenario() -> Scenario {
        Scenario::in_scene("")
    }

    pub fn head() -> String {
        scenario().head
    }

    pub fn motion() -> String {
        scenario().motion
    }

    pub fn lidar() -> String {
        scenario().lidar
    }

    pub fn imu() -> String {
        scenario().imu
    }

    pub fn clock() -> String {
        scenario().clock
    }

    pub fn estimator() -> String {
        "default".to_owned()
    }

    pub fn duration_s() -> f64 {
        scenario().duration_s
    }
}
