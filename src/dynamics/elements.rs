//! What a linkage is made of, as it is written.

use super::spec::PlacementSpec;
use crate::elasticity::SpringSpec;
use crate::spec::checked;
use serde::{Deserialize, Serialize};

/// Something between base and head that gives, or leaves some motions free.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
#[expect(clippy::large_enum_variant, reason = "there are a few a head")]
pub enum ElementSpec {
    /// A spring.
    Spring(SpringElementSpec),
    /// A rope or an elastic cable.
    Cord(CordSpec),
    /// A float in a fluid that the base carries.
    Float(FloatSpec),
    /// A universal joint with torsion springs: of one spring, what is left when its bending is all that counts.
    UniversalJoint(UniversalJointSpec),
}

/// A spring with its mounting points, one of several elements.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SpringElementSpec {
    /// The spring.
    pub spring: SpringSpec,
    /// Pieces the spring is cut into for large swings; 1 is fastest.
    pub segments: usize,
    /// Pose of the spring's foot in the base; z points along the spring.
    pub base_from_spring: PlacementSpec,
    /// Pose of the spring's top in the head.
    pub head_from_spring: PlacementSpec,
    /// What becomes of the spring's own mass.
    #[serde(default)]
    pub spring_mass: SpringMassSpec,
    /// A cable through the spring.
    #[serde(default)]
    pub cable: Option<CableSpec>,
}

/// What becomes of a spring's own mass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum SpringMassSpec {
    /// It has none: the head alone moves.
    #[default]
    Neglected,
    /// The wire's mass moves as the spring's top makes it, and half of its weight hangs on the top.
    Included,
}

/// A cable through a spring, from the middle of its foot to that of its top: a spring and a damper beside the spring.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct CableSpec {
    /// Length at which it has its tension, m.
    #[serde(with = "checked::Positive")]
    pub length_m: f64,
    /// Tension at that length, N; at nought it hangs slack below it.
    #[serde(with = "checked::NonNegative")]
    pub tension_n: f64,
    /// Stiffness, N/m.
    #[serde(with = "checked::Positive")]
    pub stiffness_n_per_m: f64,
    /// Damping while it is taut, N s/m.
    #[serde(with = "checked::NonNegative")]
    pub damping_n_s_per_m: f64,
}

/// A rope or an elastic cable without mass: it pulls, and never pushes.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct CordSpec {
    /// Where it is tied to the base, m.
    #[serde(with = "checked::FiniteArray::<3>")]
    pub base_point_m: [f64; 3],
    /// Where it is tied to the head, m.
    #[serde(with = "checked::FiniteArray::<3>")]
    pub head_point_m: [f64; 3],
    /// Length without tension, m.
    #[serde(with = "checked::Positive")]
    pub length_m: f64,
    /// How it stretches.
    pub stiffness: CordStiffnessSpec,
    /// Damping along it while it is taut, N s/m.
    #[serde(with = "checked::NonNegative")]
    pub damping_n_s_per_m: f64,
}

/// How a cord stretches.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum CordStiffnessSpec {
    /// Tension for each metre, N/m.
    NPerM(#[serde(with = "checked::Positive")] f64),
    /// Young's modulus times cross-section, N; over the length without tension it is the stiffness.
    EaN(#[serde(with = "checked::Positive")] f64),
}

/// An upright cylinder fastened to the head that floats in a fluid; the vessel moves with the base.
///
/// The fluid's surface is level, across the apparent gravity in the vessel, and goes through one point of it: fluid
/// that sloshes is not modelled. The cylinder's own mass is one of the head's parts.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct FloatSpec {
    /// Middle of the fluid's surface in the base, m.
    #[serde(with = "checked::FiniteArray::<3>")]
    pub base_surface_m: [f64; 3],
    /// Middle of the cylinder's bottom in the head, m; its axis is the head's z.
    #[serde(with = "checked::FiniteArray::<3>")]
    pub head_bottom_m: [f64; 3],
    /// The cylinder's radius, m.
    #[serde(with = "checked::Positive")]
    pub radius_m: f64,
    /// The cylinder's height, m.
    #[serde(with = "checked::Positive")]
    pub height_m: f64,
    /// The fluid's density, kg/m^3.
    #[serde(with = "checked::Positive")]
    pub density_kg_per_m3: f64,
    /// Drag of the cylinder's middle through the fluid, N s/m.
    #[serde(with = "checked::NonNegative")]
    pub drag_n_s_per_m: f64,
    /// Drag that grows with the square of the speed, N s^2/m^2.
    #[serde(with = "checked::NonNegative")]
    pub drag_n_s2_per_m2: f64,
    /// Drag against turning, N m s/rad.
    #[serde(with = "checked::NonNegative")]
    pub drag_nm_s_per_rad: f64,
    /// Mass of the fluid that moves along with the cylinder, as if in its middle (added mass), kg.
    #[serde(with = "checked::NonNegative")]
    pub added_mass_kg: f64,
}

/// A universal joint: the head turns about an axis of the base and one of its own, which cross at right angles, and has
/// no other motion.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct UniversalJointSpec {
    /// Pose of the joint in the base; x is the axis that stays with the base.
    pub base_from_joint: PlacementSpec,
    /// Pose of the joint in the head; y is the axis that stays with the head.
    pub head_from_joint: PlacementSpec,
    /// Torque for each radian about the base's axis and about the head's, N m/rad; none at nought.
    #[serde(with = "checked::NonNegativeArray::<2>")]
    pub stiffness_nm_per_rad: [f64; 2],
}
