//! Parts of the carrier that the laser can hit: an operator, a handle, a cart.

use serde::{Deserialize, Serialize};
use zsim_base::geometry::Vector;
use zsim_base::spec::checked::{FiniteArray, Fraction, Positive};
use zsim_base::spec::{Source, SpecError};

/// A part of the carrier: an upright cylinder, closed at both ends, fixed to the base.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct CarrierSpec {
    /// Name of the part, for messages.
    pub name: String,
    /// Lower end of the axis, which is parallel to the base's z, in the base frame, m.
    #[serde(with = "FiniteArray::<3>")]
    pub foot_in_base_m: [f64; 3],
    /// Radius of the cylinder, m.
    #[serde(with = "Positive")]
    pub radius_m: f64,
    /// Height of the cylinder, m.
    #[serde(with = "Positive")]
    pub height_m: f64,
    /// Diffuse reflectance at normal incidence, 0 to 1.
    #[serde(with = "Fraction")]
    pub reflectance: f64,
}

impl CarrierSpec {
    fn encloses(&self, point_in_base: &Vector) -> bool {
        let from_foot = point_in_base - Vector::from(self.foot_in_base_m);
        from_foot.xy().norm() <= self.radius_m && (0.0..=self.height_m).contains(&from_foot.z)
    }
}

/// Checks that the laser is outside all parts of the carrier.
///
/// `laser_in_base` is the laser's position with the head in equilibrium, m.
pub(super) fn check(carrier: &[CarrierSpec], laser_in_base: &Vector, source: &Source) -> Result<(), SpecError> {
    let Some(around) = carrier.iter().find(|part| part.encloses(laser_in_base)) else { return Ok(()) };
    let [x, y, z]: [f64; 3] = (*laser_in_base).into();
    let message = format!(
        "the laser, with the head in equilibrium at ({x:.3}, {y:.3}, {z:.3}) m in the base frame, is inside the carrier's \
         `{}`: move one of them",
        around.name
    );
    Err(SpecError::about(source, &around.name, message))
}
