//! What carries the head, as the head's laser may see it.

use super::spec::HeadSpec;
use crate::geometry::Vector;
use crate::spec::checked::{FiniteArray, Fraction, Positive};
use crate::spec::{Source, SpecError};
use serde::{Deserialize, Serialize};

/// A part of what carries the head: an upright cylinder, closed at both ends, fixed to the base.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct CarrierSpec {
    /// What it is.
    pub name: String,
    /// Where its axis, along the base's z, ends below, in the base, m.
    #[serde(with = "FiniteArray::<3>")]
    pub foot_in_base_m: [f64; 3],
    /// Its radius, m.
    #[serde(with = "Positive")]
    pub radius_m: f64,
    /// Its height, m.
    #[serde(with = "Positive")]
    pub height_m: f64,
    /// Share of the light that comes back diffusely at normal incidence, 0 to 1.
    #[serde(with = "Fraction")]
    pub reflectance: f64,
}

impl CarrierSpec {
    fn encloses(&self, point_in_base: &Vector) -> bool {
        let from_foot = point_in_base - Vector::from(self.foot_in_base_m);
        from_foot.xy().norm() <= self.radius_m && (0.0..=self.height_m).contains(&from_foot.z)
    }
}

/// Checks that a laser at `laser_in_base`, m, while the head rests, is in nothing that carries it.
pub(super) fn check(spec: &HeadSpec, laser_in_base: &Vector, source: &Source) -> Result<(), SpecError> {
    let Some(around) = spec.carrier.iter().find(|part| part.encloses(laser_in_base)) else { return Ok(()) };
    let [x, y, z]: [f64; 3] = (*laser_in_base).into();
    let message = format!(
        "the laser, at rest at ({x:.3}, {y:.3}, {z:.3}) m in the base, is inside the carrier's `{}`: move one of them",
        around.name
    );
    Err(SpecError::about(source, &around.name, message))
}
