//! Spec of a spring search: `specs/studies/NAME.ron`.

use super::super::{DesignMetrics, Shake};
use crate::elasticity::{Material, SpringSpec};
use crate::spec::checked;
use serde::{Deserialize, Serialize};

/// A search for a spring: design space, goals and limits.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct DesignSpec {
    /// The head: a name or a file. The search replaces its spring; mounting, damping and stops remain.
    pub head: String,
    /// The lidar on the head: a name or a file.
    pub lidar: String,
    /// Motion of the base for field of view, rate and stress.
    pub shake: Shake,
    /// Design space.
    pub space: SpaceSpec,
    /// Goals; the search returns the Pareto set of them.
    pub goals: Vec<GoalSpec>,
    /// Limits of feasible designs; a design without a stable rest pose of the head is always infeasible.
    #[serde(default)]
    pub limits: Vec<LimitSpec>,
    /// Number of designs to evaluate; a catalogue is always evaluated completely.
    pub evaluations: usize,
    /// Number of designs of the Pareto set that are verified by simulation and reported.
    pub candidates: usize,
    /// Random seed.
    pub seed: u64,
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
        /// Material of the wire.
        material: Material,
    },
    /// The springs of a catalogue: a CSV file, or `"stock"` for the built-in one.
    Catalogue(String),
}

/// A metric of a design.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DesignMetric {
    /// Frequency of the slowest mode, Hz.
    RockingHz,
    /// Peak gain of the pitch rate.
    PeakGain,
    /// Field of view under the shake, degrees.
    FieldOfViewDeg,
    /// Maximum angular velocity under the shake, degrees/s.
    RateDegPerS,
    /// Static compression of the spring under the head, mm.
    SagMm,
    /// Mass of the active wire, g.
    SpringMassG,
    /// Maximum stress in the wire under the shake, divided by the yield stress.
    StressShare,
}

impl DesignMetric {
    /// The value of the metric; infinite if it is not known.
    pub fn of(self, metrics: &DesignMetrics) -> f64 {
        match self {
            DesignMetric::RockingHz => metrics.rocking_hz,
            DesignMetric::PeakGain => metrics.peak_gain,
            DesignMetric::FieldOfViewDeg => metrics.field_of_view_deg,
            DesignMetric::RateDegPerS => metrics.rate_deg_per_s,
            DesignMetric::SagMm => metrics.sag_mm,
            DesignMetric::SpringMassG => metrics.spring_mass_g.unwrap_or(f64::INFINITY),
            DesignMetric::StressShare => metrics.stress_share.unwrap_or(f64::INFINITY),
        }
    }

    /// Axis label with unit.
    pub fn label(self) -> &'static str {
        match self {
            DesignMetric::RockingHz => "Rocking frequency (Hz)",
            DesignMetric::PeakGain => "Peak gain of the pitch rate",
            DesignMetric::FieldOfViewDeg => "Field of view (degrees)",
            DesignMetric::RateDegPerS => "Maximum rate (degrees/s)",
            DesignMetric::SagMm => "Sag (mm)",
            DesignMetric::SpringMassG => "Spring mass (g)",
            DesignMetric::StressShare => "Stress / yield stress",
        }
    }
}

/// Aim of a goal.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Aim {
    /// Reach this value.
    Target(#[serde(with = "checked::Positive")] f64),
    /// Minimise the metric.
    Least,
    /// Maximise the metric.
    Most,
}

/// A goal of the search.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct GoalSpec {
    /// The metric.
    pub figure: DesignMetric,
    /// Aim: a target value, minimum or maximum.
    pub aim: Aim,
}

impl GoalSpec {
    /// Cost of a value; lower is better. For a target, the relative deviation.
    pub fn cost(&self, value: f64) -> f64 {
        match self.aim {
            Aim::Target(target) => (value / target - 1.0).abs(),
            Aim::Least => value,
            Aim::Most => -value,
        }
    }
}

/// A limit of feasible designs.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LimitSpec {
    /// The metric.
    pub figure: DesignMetric,
    /// Minimum value.
    #[serde(default)]
    pub least: Option<f64>,
    /// Maximum value.
    #[serde(default)]
    pub most: Option<f64>,
}

impl LimitSpec {
    /// Relative violation of the limit; 0 if the value is within.
    pub fn excess(&self, value: f64) -> f64 {
        let below = self.least.map_or(0.0, |least| (least - value) / least.abs().max(1e-9));
        let above = self.most.map_or(0.0, |most| (value - most) / most.abs().max(1e-9));
        below.max(above).max(0.0)
    }
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
    /// Material of the wire.
    pub material: Material,
}

impl CoilDesign {
    /// The spec of the spring.
    pub fn spring(&self) -> SpringSpec {
        SpringSpec::Coil {
            coil_diameter_mm: self.coil_diameter_mm,
            wire_diameter_mm: self.wire_diameter_mm,
            active_coils: self.active_coils,
            free_length_mm: self.free_length_mm,
            material: self.material,
        }
    }
}
