//! Specs of springs.

use super::{Coil, ElasticityError, Material, Matrix6, Spring, Winding};
use serde::{Deserialize, Serialize};
use zsim_base::spec::{Kind, NamedSpec, Source, SpecError, checked, parse_named};

/// Spec of a spring: `specs/springs/NAME.ron`, or a value within a head.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum SpringSpec {
    /// A spring of the library or of a file, by name: `named("25x3")`.
    Named(String),
    /// A helical spring of round wire.
    Coil {
        /// Mean diameter of the coil, mm.
        #[serde(with = "checked::Positive")]
        coil_diameter_mm: f64,
        /// Diameter of the wire, mm.
        #[serde(with = "checked::Positive")]
        wire_diameter_mm: f64,
        /// Number of active coils.
        #[serde(with = "checked::Positive")]
        active_coils: f64,
        /// Free length, without load, mm.
        #[serde(with = "checked::Positive")]
        free_length_mm: f64,
        /// Ends of the spring, which are a part of its free length.
        #[serde(default)]
        ends: EndsSpec,
        /// Hand of the helix; so far it counts in the couplings of `stiffness_at_top` only.
        #[serde(default)]
        hand: HandSpec,
        /// Angle at which the wire begins at the foot, from the spring frame's +x towards +y, degrees; it counts as `hand` does.
        #[serde(default, with = "checked::Finite")]
        start_deg: f64,
        /// Material of the wire.
        #[serde(default)]
        material: Material,
        /// Coefficient of restitution of the coils: speed of a head after a clash along the spring over that before it, for a contact
        /// force well above that of the open spring; 1: elastic.
        #[serde(default = "elastic", skip_serializing_if = "is_elastic", with = "checked::Fraction")]
        #[schemars(extend("default" = 1.0))]
        coil_restitution: f64,
    },
    /// A spring given by the stiffness of the top under the head's weight, with the base clamped.
    ///
    /// The matrix includes the softening of the spring by the weight, not the moment of the weight about the base.
    Stiffness {
        /// Length under the head's weight, mm.
        #[serde(with = "checked::Positive")]
        length_mm: f64,
        /// Stiffness matrix of the top, row by row: order x, y, z, rx, ry, rz; N, m, rad.
        rows: [StiffnessRow; 6],
    },
}

/// Ends of a coil spring (Shigley's Mechanical Engineering Design, 9th edition, table 10-1).
///
/// The active coils bend, shear and stretch; the ends are rigid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum EndsSpec {
    /// The free length is that of the active coils.
    #[default]
    ActiveOnly,
    /// Open ends: the free length has one diameter of the wire in addition; no inactive coils.
    Open,
    /// Closed ends: two inactive coils, three diameters of the wire.
    Closed,
    /// Closed and ground ends: two inactive coils, two diameters of the wire.
    ClosedGround,
}

/// Hand of a helix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum HandSpec {
    /// The wire rises like the thread of an ordinary screw.
    #[default]
    Right,
    /// The wire rises like a left-handed thread.
    Left,
}

impl EndsSpec {
    /// Name as in specs and catalogues.
    pub fn key(self) -> &'static str {
        match self {
            EndsSpec::ActiveOnly => "active_only",
            EndsSpec::Open => "open",
            EndsSpec::Closed => "closed",
            EndsSpec::ClosedGround => "closed_ground",
        }
    }

    /// Name in words.
    pub fn name(self) -> &'static str {
        match self {
            EndsSpec::ActiveOnly => "without ends",
            EndsSpec::Open => "open ends",
            EndsSpec::Closed => "closed ends",
            EndsSpec::ClosedGround => "closed and ground ends",
        }
    }

    /// Number of inactive coils.
    pub fn inactive_coils(self) -> f64 {
        match self {
            EndsSpec::ActiveOnly | EndsSpec::Open => 0.0,
            EndsSpec::Closed | EndsSpec::ClosedGround => 2.0,
        }
    }

    /// Length of the two ends together, in diameters of the wire.
    fn wire_diameters(self) -> f64 {
        match self {
            EndsSpec::ActiveOnly => 0.0,
            EndsSpec::Open => 1.0,
            EndsSpec::Closed => 3.0,
            EndsSpec::ClosedGround => 2.0,
        }
    }
}

/// One row of a stiffness matrix: force (N) or torque (N m) per x, y, z (m) and rx, ry, rz (rad).
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(transparent)]
pub struct StiffnessRow(#[serde(with = "checked::FiniteArray::<6>")] pub [f64; 6]);

/// An unloaded spring: a [`SpringSpec`] with the name resolved and the values validated.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "there is one a head")]
pub enum SpringDesign {
    /// A helical spring.
    Coil(Coil),
    /// A spring given by a stiffness matrix.
    Stiffness {
        /// Length under the head's weight, m.
        length_m: f64,
        /// Stiffness of the top under the head's weight.
        at_top: Matrix6,
    },
}

/// The coefficient of restitution of an elastic clash.
fn elastic() -> f64 {
    1.0
}

fn is_elastic(restitution: &f64) -> bool {
    *restitution == 1.0
}

impl SpringSpec {
    /// The spec itself, or the one that it names.
    ///
    /// # Errors
    /// When there is no spring of that name, or the file is invalid or names another spring.
    pub fn resolved(&self) -> Result<SpringSpec, SpecError> {
        let SpringSpec::Named(name) = self else { return Ok(self.clone()) };
        match zsim_base::spec::load(name)? {
            SpringSpec::Named(other) => {
                let message = format!("the spring names another spring, \"{other}\"; it must be a coil or a stiffness");
                Err(SpecError::plain(name, message))
            }
            spring => Ok(spring),
        }
    }

    /// Length of each rigid end, m; 0 for a stiffness matrix.
    ///
    /// # Errors
    /// As [`SpringSpec::resolved`].
    pub fn end_length_m(&self) -> Result<f64, SpecError> {
        Ok(match self.resolved()? {
            SpringSpec::Coil { wire_diameter_mm, ends, .. } => 0.5e-3 * wire_diameter_mm * ends.wire_diameters(),
            SpringSpec::Named(_) | SpringSpec::Stiffness { .. } => 0.0,
        })
    }

    /// Mass of the active wire, kg.
    ///
    /// `None` for a stiffness matrix or a material without density.
    ///
    /// # Errors
    /// As [`SpringSpec::design`].
    pub fn wire_mass_kg(&self) -> Result<Option<f64>, ElasticityError> {
        let resolved = self.resolved()?;
        let SpringSpec::Coil { material, .. } = &resolved else { return Ok(None) };
        let SpringDesign::Coil(coil) = resolved.design()? else { return Ok(None) };
        Ok(material.density_kg_per_m3().map(|density| density * coil.wire_volume_m3()))
    }

    /// The validated spring; a coil without its rigid ends.
    ///
    /// # Errors
    /// When there is no spring of that name, the file is invalid or names another spring, a value is invalid, or the force law is
    /// not valid for the coil.
    pub fn design(&self) -> Result<SpringDesign, ElasticityError> {
        match self {
            SpringSpec::Named(_) => self.resolved()?.design(),
            SpringSpec::Coil {
                coil_diameter_mm,
                wire_diameter_mm,
                active_coils,
                free_length_mm,
                ends,
                hand,
                start_deg,
                material,
                coil_restitution,
            } => {
                let (diameter_m, wire_m) = (coil_diameter_mm * 1e-3, wire_diameter_mm * 1e-3);
                let active_m = free_length_mm * 1e-3 - ends.wire_diameters() * wire_m;
                let coil = Coil::new(diameter_m, wire_m, *active_coils, active_m, material.moduli())?;
                coil.check_range()?;
                let winding = Winding { left_handed: *hand == HandSpec::Left, start_rad: start_deg.to_radians() };
                Ok(SpringDesign::Coil(coil.wound(winding).with_restitution(*coil_restitution)))
            }
            SpringSpec::Stiffness { length_mm, rows } => {
                let at_top = Matrix6::from_fn(|row, column| rows[row].0[column]);
                // The load does not affect validation, so check with zero load.
                Spring::from_stiffness(length_mm * 1e-3, 0.0, &at_top)?;
                Ok(SpringDesign::Stiffness { length_m: length_mm * 1e-3, at_top })
            }
        }
    }
}

impl SpringDesign {
    /// The force law of the spring under `load_n` along the axis (compression positive).
    ///
    /// # Errors
    /// When the spring cannot carry the load, or cannot be divided into `segments`.
    pub fn loaded_spring(&self, load_n: f64, segments: usize) -> Result<Spring, ElasticityError> {
        match self {
            SpringDesign::Coil(coil) => Ok(Spring::of_coil(coil, load_n, segments)?.with_contact(coil, load_n)),
            SpringDesign::Stiffness { length_m, at_top } => match segments {
                1 => Spring::from_stiffness(*length_m, load_n, at_top),
                _ => Err(ElasticityError::CannotBeDivided { segments }),
            },
        }
    }
}

impl NamedSpec for SpringSpec {
    const KIND: Kind = Kind::Spring;
    type Error = SpecError;

    fn parse(source: &Source) -> Result<Self, SpecError> {
        parse_named(source)
    }

    fn check_model(&self, source: &Source) -> Result<Vec<String>, SpecError> {
        match self.design() {
            Ok(_) => Ok(Vec::new()),
            Err(ElasticityError::Spec(error)) => Err(error),
            Err(error) => Err(SpecError::plain(&source.name, error.to_string())),
        }
    }
}
