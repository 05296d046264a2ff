//! What is wanted of a spring, as it is written: `specs/studies/NAME.ron`.

use super::super::{DesignFigures, Shake};
use crate::elasticity::{Material, SpringSpec};
use crate::spec::checked;
use serde::{Deserialize, Serialize};

/// What is wanted of a spring, and where to look for it.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct DesignSpec {
    /// The head that it carries: a name or a file. The spring there is replaced; its mounting, damping and stops stay.
    pub head: String,
    /// The lidar on it: a name or a file.
    pub lidar: String,
    /// The hand under which field of view, rate and stress are judged.
    pub shake: Shake,
    /// Where to look.
    pub space: SpaceSpec,
    /// What is wanted.
    pub goals: Vec<GoalSpec>,
    /// What must hold. That the head stands goes without saying.
    #[serde(default)]
    pub limits: Vec<LimitSpec>,
    /// How many designs are tried; a catalogue is tried through in any case.
    pub evaluations: usize,
    /// How many of the Pareto set are verified and told.
    pub candidates: usize,
    /// From which all chance is drawn.
    pub seed: u64,
}

/// Where to look for a spring.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum SpaceSpec {
    /// Any coil between bounds.
    Coil {
        /// Mean diameter of the coil, from and to, mm.
        #[serde(with = "checked::PositiveArray::<2>")]
        coil_diameter_mm: [f64; 2],
        /// Diameter of the wire, from and to, mm.
        #[serde(with = "checked::PositiveArray::<2>")]
        wire_diameter_mm: [f64; 2],
        /// Coils that are free to move, from and to.
        #[serde(with = "checked::PositiveArray::<2>")]
        active_coils: [f64; 2],
        /// Length without load, from and to, mm.
        #[serde(with = "checked::PositiveArray::<2>")]
        free_length_mm: [f64; 2],
        /// What the wire is made of.
        material: Material,
    },
    /// The springs of a catalogue: a CSV file, or `"stock"` for the one built in.
    Catalogue(String),
}

/// A figure of a design.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FigureName {
    /// Frequency of the slowest mode, Hz.
    RockingHz,
    /// Greatest gain of the pitch rate.
    PeakGain,
    /// Field of view under the shake, degrees.
    FieldOfViewDeg,
    /// Greatest rate of rotation under the shake, degrees/s.
    RateDegPerS,
    /// How far the spring shortens under the head, mm.
    SagMm,
    /// Mass of the active wire, g.
    SpringMassG,
    /// Greatest stress in the wire under the shake, over its yield.
    StressShare,
}

impl FigureName {
    /// The figure's value; infinite where the design has none.
    pub fn of(self, figures: &DesignFigures) -> f64 {
        match self {
            FigureName::RockingHz => figures.rocking_hz,
            FigureName::PeakGain => figures.peak_gain,
            FigureName::FieldOfViewDeg => figures.field_of_view_deg,
            FigureName::RateDegPerS => figures.rate_deg_per_s,
            FigureName::SagMm => figures.sag_mm,
            FigureName::SpringMassG => figures.spring_mass_g.unwrap_or(f64::INFINITY),
            FigureName::StressShare => figures.stress_share.unwrap_or(f64::INFINITY),
        }
    }

    /// What it is called on an axis of a plot.
    pub fn label(self) -> &'static str {
        match self {
            FigureName::RockingHz => "Rocking frequency (Hz)",
            FigureName::PeakGain => "Peak gain of the pitch rate",
            FigureName::FieldOfViewDeg => "Field of view (degrees)",
            FigureName::RateDegPerS => "Greatest rate (degrees/s)",
            FigureName::SagMm => "Sag (mm)",
            FigureName::SpringMassG => "Mass of the spring (g)",
            FigureName::StressShare => "Stress over yield",
        }
    }
}

/// What is wanted of a figure.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Aim {
    /// This value.
    Target(#[serde(with = "checked::Positive")] f64),
    /// As little as can be.
    Least,
    /// As much as can be.
    Most,
}

/// A goal.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct GoalSpec {
    /// Of what.
    pub figure: FigureName,
    /// What is wanted of it.
    pub aim: Aim,
}

impl GoalSpec {
    /// How far a value is from the aim: less is better.
    pub fn cost(&self, value: f64) -> f64 {
        match self.aim {
            Aim::Target(target) => (value / target - 1.0).abs(),
            Aim::Least => value,
            Aim::Most => -value,
        }
    }
}

/// A limit.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LimitSpec {
    /// Of what.
    pub figure: FigureName,
    /// No less than this.
    #[serde(default)]
    pub least: Option<f64>,
    /// No more than this.
    #[serde(default)]
    pub most: Option<f64>,
}

impl LimitSpec {
    /// By what share of the limit a value is beyond it; 0 within.
    pub fn excess(&self, value: f64) -> f64 {
        let below = self.least.map_or(0.0, |least| (least - value) / least.abs().max(1e-9));
        let above = self.most.map_or(0.0, |most| (value - most) / most.abs().max(1e-9));
        below.max(above).max(0.0)
    }
}

/// A coil to try.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
pub struct CoilDesign {
    /// Its name in the catalogue; empty for one that is in none.
    pub name: String,
    /// Mean diameter of the coil, mm.
    pub coil_diameter_mm: f64,
    /// Diameter of the wire, mm.
    pub wire_diameter_mm: f64,
    /// Coils that are free to move.
    pub active_coils: f64,
    /// Length without load, mm.
    pub free_length_mm: f64,
    /// What the wire is made of.
    pub material: Material,
}

impl CoilDesign {
    /// As a spring's spec.
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
