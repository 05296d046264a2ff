//! Spec of a spring search: `specs/studies/NAME.ron`.

use super::limits::BuildLimitsSpec;
use crate::sweep::{GoalSpec, MeasureLimitSpec, usual};
use serde::{Deserialize, Serialize};
use zsim_base::spec::checked;
use zsim_elasticity::{EndsSpec, HandSpec, Material, SpringSpec};
use zsim_head::spring::Shake;

/// A search for a spring: design space, goals and limits.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct DesignSpec {
    /// Name of the default folder for results; that of the file by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The head: a name or a file. The search replaces its spring; mounting, damping and stops remain.
    #[serde(default = "usual::head")]
    pub head: String,
    /// The lidar on the head: a name or a file.
    #[serde(default = "usual::lidar")]
    pub lidar: String,
    /// Motion of the base for field of view, rate and stress.
    #[serde(default)]
    pub shake: Shake,
    /// A journey that measures without a closed form are taken from, such as coverage in a second or the accuracy of the map.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub journey: Option<DesignJourneySpec>,
    /// Design space.
    pub space: SpaceSpec,
    /// Goals; the search returns the Pareto set of them.
    pub goals: Vec<GoalSpec>,
    /// Limits of feasible designs; a design without a stable rest pose of the head is always infeasible.
    #[serde(default)]
    pub limits: Vec<MeasureLimitSpec>,
    /// Limits of a spring that can be ordered and lasts; each has a default.
    #[serde(default)]
    pub build: BuildLimitsSpec,
    /// Number of designs to evaluate; a catalogue is always evaluated completely.
    #[serde(default = "evaluations")]
    pub evaluations: usize,
    /// Number of designs of the Pareto set that are verified by simulation and reported.
    #[serde(default = "candidates")]
    pub candidates: usize,
    /// Random seed.
    #[serde(default = "usual::seed")]
    pub seed: u64,
}

/// Number of designs to evaluate where a spec has none.
fn evaluations() -> usize {
    10_000
}

/// Number of designs to verify where a spec has none.
fn candidates() -> usize {
    12
}

/// Number of designs with journeys where a spec has none.
fn journey_designs() -> usize {
    60
}

/// A journey with the head and the lidar of a spring search. Each spec is a path or a name in the library.
///
/// The figures of a design are means over the seeds. A design whose coils touch in a journey, or whose estimate is lost, is
/// rejected.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct DesignJourneySpec {
    /// Scene.
    pub scene: String,
    /// Motion of the base.
    #[serde(default = "usual::motion")]
    pub motion: String,
    /// Inertial measurement unit.
    #[serde(default = "usual::imu")]
    pub imu: String,
    /// Clocks of the sensors.
    #[serde(default = "usual::clock")]
    pub clock: String,
    /// Settings of the estimator.
    #[serde(default = "usual::estimator")]
    pub estimator: String,
    /// Route in the scene; the scene's default route if omitted.
    #[serde(default)]
    pub route: Option<String>,
    /// Duration, s.
    #[serde(default = "usual::duration_s", with = "checked::Positive")]
    pub duration_s: f64,
    /// Random seeds; each is a journey.
    #[serde(default = "usual::seeds")]
    pub seeds: Vec<u64>,
    /// Number of designs whose journeys are simulated: evenly distributed feasible designs.
    #[serde(default = "journey_designs")]
    pub designs: usize,
    /// Time limit of a simulation and of an estimate, s.
    #[serde(default = "usual::time_limit_s", with = "checked::Positive")]
    pub time_limit_s: f64,
}

/// Design space of a spring search.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum SpaceSpec {
    /// Coils with a geometry within bounds.
    Coil {
        /// Mean diameter of the coil, minimum and maximum, mm.
        #[serde(with = "checked::PositiveArray::<2>")]
        coil_diameter_mm: [f64; 2],
        /// Diameter of the wire, minimum and maximum, mm.
        #[serde(with = "checked::PositiveArray::<2>")]
        wire_diameter_mm: [f64; 2],
        /// Number of active coils, minimum and maximum.
        #[serde(with = "checked::PositiveArray::<2>")]
        active_coils: [f64; 2],
        /// Free length, minimum and maximum, mm.
        #[serde(with = "checked::PositiveArray::<2>")]
        free_length_mm: [f64; 2],
        /// Ends of the springs, a part of the free length.
        #[serde(default)]
        ends: EndsSpec,
        /// Material of the wire.
        #[serde(default)]
        material: Material,
    },
    /// The springs of a catalogue: a CSV file, or `"stock"` for the built-in one.
    Catalogue(String),
}

/// A coil of the design space.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
pub struct CoilDesign {
    /// Name in the catalogue; empty for a coil that is not from a catalogue.
    pub name: String,
    /// Mean diameter of the coil, mm.
    pub coil_diameter_mm: f64,
    /// Diameter of the wire, mm.
    pub wire_diameter_mm: f64,
    /// Number of active coils.
    pub active_coils: f64,
    /// Free length, mm.
    pub free_length_mm: f64,
    /// Ends of the spring.
    pub ends: EndsSpec,
    /// Material of the wire.
    pub material: Material,
}

impl CoilDesign {
    /// The name in the catalogue, or mean diameter x wire diameter x active coils x free length, mm.
    pub fn label(&self) -> String {
        if self.name.is_empty() {
            let Self { coil_diameter_mm, wire_diameter_mm, active_coils, free_length_mm, .. } = self;
            format!("{coil_diameter_mm:.1}x{wire_diameter_mm:.2}x{active_coils:.1}x{free_length_mm:.1}")
        } else {
            self.name.clone()
        }
    }

    /// The spec of the spring.
    pub fn spring(&self) -> SpringSpec {
        SpringSpec::Coil {
            coil_diameter_mm: self.coil_diameter_mm,
            wire_diameter_mm: self.wire_diameter_mm,
            active_coils: self.active_coils,
            free_length_mm: self.free_length_mm,
            ends: self.ends,
            hand: HandSpec::default(),
            start_deg: 0.0,
            material: self.material,
            coil_restitution: 1.0,
        }
    }
}
