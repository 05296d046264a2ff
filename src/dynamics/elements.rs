//! Spec types of the elements of a linkage.

use super::placement::PlacementSpec;
use serde::{Deserialize, Serialize};
use zsim_base::spec::checked;
use zsim_elasticity::{ElasticityError, SpringSpec};

/// An element between base and head.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
#[expect(clippy::large_enum_variant, reason = "there are a few a head")]
pub enum ElementSpec {
    /// A helical spring, or one given by a stiffness matrix.
    Spring(SpringElementSpec),
    /// A rope or an elastic cable.
    Cord(CordSpec),
    /// A float on the head, in a fluid that the base carries.
    Float(FloatSpec),
    /// A universal joint with torsion springs: the model of one spring with bending only.
    UniversalJoint(UniversalJointSpec),
}

/// A spring with mounting points, one of several elements.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SpringElementSpec {
    /// The spring: a coil, a stiffness matrix, or the name of a spring spec.
    pub spring: SpringSpec,
    /// Number of segments that model large deflections, 1 to 64; 1 is fastest.
    #[serde(default = "crate::usual::segments")]
    pub segments: usize,
    /// Pose of the spring's foot in the base; z points along the spring.
    #[serde(default)]
    pub base_from_spring: PlacementSpec,
    /// Pose of the spring's top in the head.
    pub head_from_spring: PlacementSpec,
    /// Whether the mass of the wire is modelled.
    #[serde(default)]
    pub spring_mass: SpringMassSpec,
    /// A cable through the spring, parallel to it.
    #[serde(default)]
    pub cable: Option<CableSpec>,
}

/// Model of the mass of a spring's wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum SpringMassSpec {
    /// As `included` if the density of the material is known, and as `neglected` otherwise.
    #[default]
    IfKnown,
    /// The wire is massless.
    Neglected,
    /// The wire moves with the deflection of the spring's top, and half of the wire's weight acts on the top.
    Included,
}

impl SpringMassSpec {
    /// Mass of the wire of `spring` that counts, kg; `None` if it is neglected or unknown.
    ///
    /// # Errors
    /// As [`SpringSpec::design`].
    pub fn of_wire(self, spring: &SpringSpec) -> Result<Option<f64>, ElasticityError> {
        match self {
            Self::Neglected => Ok(None),
            Self::IfKnown | Self::Included => spring.wire_mass_kg(),
        }
    }
}

/// A cable through a spring, from the centre of the foot to the centre of the top.
///
/// It is a spring and a damper in parallel with the spring, and transmits tension only.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct CableSpec {
    /// Length at which the cable has the tension `tension_n`, m.
    #[serde(with = "checked::Positive")]
    pub length_m: f64,
    /// Tension at that length, N; with 0 the cable is slack below that length.
    #[serde(with = "checked::NonNegative")]
    pub tension_n: f64,
    /// Axial stiffness, N/m.
    #[serde(with = "checked::Positive")]
    pub stiffness_n_per_m: f64,
    /// Axial damping while the cable is taut, N s/m.
    #[serde(default, with = "checked::NonNegative")]
    pub damping_n_s_per_m: f64,
}

/// A massless rope or elastic cable: it transmits tension only.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct CordSpec {
    /// Attachment point on the base, in the base frame, m.
    #[serde(with = "checked::FiniteArray::<3>")]
    pub base_point_m: [f64; 3],
    /// Attachment point on the head, in the head frame, m.
    #[serde(with = "checked::FiniteArray::<3>")]
    pub head_point_m: [f64; 3],
    /// Length without tension, m.
    #[serde(with = "checked::Positive")]
    pub length_m: f64,
    /// Axial stiffness of the cord, as N/m or as E A.
    pub stiffness: CordStiffnessSpec,
    /// Axial damping while the cord is taut, N s/m.
    #[serde(default, with = "checked::NonNegative")]
    pub damping_n_s_per_m: f64,
}

/// Axial stiffness of a cord.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum CordStiffnessSpec {
    /// Stiffness: tension per metre of stretch, N/m.
    NPerM(#[serde(with = "checked::Positive")] f64),
    /// Young's modulus times cross-section E A, N; the stiffness is E A over the length without tension.
    EaN(#[serde(with = "checked::Positive")] f64),
}

/// A cylinder on the head that floats in a fluid; the vessel moves with the base.
///
/// The fluid surface is a plane perpendicular to the apparent gravity in the vessel, through `base_surface_m`; sloshing
/// is not modelled. The mass of the cylinder is one of the parts of the head.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct FloatSpec {
    /// Centre of the fluid surface in the base frame, m.
    #[serde(with = "checked::FiniteArray::<3>")]
    pub base_surface_m: [f64; 3],
    /// Centre of the cylinder's bottom in the head frame, m; the axis is parallel to the head's z.
    #[serde(with = "checked::FiniteArray::<3>")]
    pub head_bottom_m: [f64; 3],
    /// Radius of the cylinder, m.
    #[serde(with = "checked::Positive")]
    pub radius_m: f64,
    /// Height of the cylinder, m.
    #[serde(with = "checked::Positive")]
    pub height_m: f64,
    /// Density of the fluid, kg/m^3.
    #[serde(with = "checked::Positive")]
    pub density_kg_per_m3: f64,
    /// Linear drag coefficient at the cylinder's centre, N s/m.
    #[serde(default, with = "checked::NonNegative")]
    pub drag_n_s_per_m: f64,
    /// Quadratic drag coefficient at the cylinder's centre, N s^2/m^2.
    #[serde(default, with = "checked::NonNegative")]
    pub drag_n_s2_per_m2: f64,
    /// Linear rotational drag coefficient, N m s/rad.
    #[serde(default, with = "checked::NonNegative")]
    pub drag_nm_s_per_rad: f64,
    /// Added mass: fluid that moves with the cylinder, acting at the cylinder's centre, kg.
    #[serde(default, with = "checked::NonNegative")]
    pub added_mass_kg: f64,
}

/// A universal joint: the head rotates about one axis of the base and one of the head.
///
/// The two axes intersect at a right angle. All other motions are constrained.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct UniversalJointSpec {
    /// Pose of the joint in the base; x is the rotation axis fixed to the base.
    pub base_from_joint: PlacementSpec,
    /// Pose of the joint in the head; y is the rotation axis fixed to the head.
    pub head_from_joint: PlacementSpec,
    /// Torsional stiffness about the base's axis and about the head's axis, N m/rad; 0 for a free axis.
    #[serde(with = "checked::NonNegativeArray::<2>")]
    pub stiffness_nm_per_rad: [f64; 2],
}
