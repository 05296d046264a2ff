//! Springs as they are written.

use super::{Coil, ElasticityError, Matrix6, Moduli, Spring};
use crate::spec::{Kind, SpecError, checked};
use serde::{Deserialize, Serialize};

/// A spring, as a spec has it: `specs/springs/NAME.ron`, or within a head.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
#[expect(clippy::large_enum_variant, reason = "there is one a head")]
pub enum SpringSpec {
    /// A spring of the library, or a file: `named("25x3")`.
    Named(String),
    /// A helical spring of round wire.
    Coil {
        /// Mean diameter of the coil, mm.
        #[serde(with = "checked::Positive")]
        coil_diameter_mm: f64,
        /// Diameter of the wire, mm.
        #[serde(with = "checked::Positive")]
        wire_diameter_mm: f64,
        /// Coils that are free to move.
        #[serde(with = "checked::Positive")]
        active_coils: f64,
        /// Length without load, mm.
        #[serde(with = "checked::Positive")]
        free_length_mm: f64,
        /// What the wire is made of.
        material: Material,
    },
    /// A spring known by the stiffness of its top, its base clamped, under the head's weight: the weight's softening of
    /// the spring in it, its moment about the base not.
    Stiffness {
        /// Length under the head's weight, mm.
        #[serde(with = "checked::Positive")]
        length_mm: f64,
        /// Force and torque of the top by its displacement: order x, y, z, rx, ry, rz; N, m, rad.
        rows: [StiffnessRow; 6],
    },
}

/// One row of a stiffness: force in N, or torque in N m, for each of x, y, z in m and rx, ry, rz in rad.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(transparent)]
pub struct StiffnessRow(#[serde(with = "checked::FiniteArray::<6>")] pub [f64; 6]);

/// What a wire is made of.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Material {
    /// Patented or music wire: E = 206 GPa, G = 79.3 GPa.
    SpringSteel,
    /// Stainless 302: E = 193 GPa, G = 69 GPa.
    Stainless,
    /// Any other.
    Moduli {
        /// Young's modulus, GPa.
        #[serde(with = "checked::Positive")]
        youngs_gpa: f64,
        /// Shear modulus, GPa.
        #[serde(with = "checked::Positive")]
        shear_gpa: f64,
        /// Density, kg/m^3; needed for the spring's own mass alone.
        #[serde(default)]
        density_kg_per_m3: Option<Density>,
    },
}

/// A density above zero, kg/m^3.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(transparent)]
pub struct Density(#[serde(with = "checked::Positive")] pub f64);

impl Material {
    /// Its moduli.
    pub fn moduli(&self) -> Moduli {
        let (youngs_gpa, shear_gpa) = match self {
            Material::SpringSteel => (206.0, 79.3),
            Material::Stainless => (193.0, 69.0),
            Material::Moduli { youngs_gpa, shear_gpa, .. } => (*youngs_gpa, *shear_gpa),
        };
        Moduli { youngs_pa: youngs_gpa * 1e9, shear_pa: shear_gpa * 1e9 }
    }

    /// Its density, kg/m^3, where it is known: 7850 for carbon steel, 7900 for stainless 302 (usual values).
    pub fn density_kg_per_m3(&self) -> Option<f64> {
        match self {
            Material::SpringSteel => Some(7850.0),
            Material::Stainless => Some(7900.0),
            Material::Moduli { density_kg_per_m3, .. } => density_kg_per_m3.map(|density| density.0),
        }
    }
}

/// A spring as it is made, before any load: what a [`SpringSpec`] says, looked up and checked.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "there is one a head")]
pub enum SpringDesign {
    /// A helical spring.
    Coil(Coil),
    /// A spring known by its stiffness.
    Stiffness {
        /// Length under the head's weight, m.
        length_m: f64,
        /// Stiffness of the top under it.
        at_top: Matrix6,
    },
}

impl SpringSpec {
    /// This spring, or the one it names, as it is described.
    ///
    /// # Errors
    /// When there is none of that name, its file is wrong or only names another.
    pub fn described(&self) -> Result<SpringSpec, SpecError> {
        let SpringSpec::Named(name) = self else { return Ok(self.clone()) };
        match crate::spec::load(Kind::Spring, name)? {
            SpringSpec::Named(other) => {
                let message = format!("only names another spring, \"{other}\"; it must describe one");
                Err(SpecError::plain(name, message))
            }
            spring => Ok(spring),
        }
    }

    /// Mass of the active wire, kg; `None` for a spring known by its stiffness, or of a material without density.
    ///
    /// # Errors
    /// As [`SpringSpec::design`].
    pub fn wire_mass_kg(&self) -> Result<Option<f64>, ElasticityError> {
        let described = self.described()?;
        let SpringSpec::Coil { material, .. } = &described else { return Ok(None) };
        let SpringDesign::Coil(coil) = described.design()? else { return Ok(None) };
        Ok(material.density_kg_per_m3().map(|density| density * coil.wire_volume_m3()))
    }

    /// The spring this describes or names.
    ///
    /// # Errors
    /// When there is none of that name, its file is wrong or only names another, or its numbers are no spring's.
    pub fn design(&self) -> Result<SpringDesign, ElasticityError> {
        match self {
            SpringSpec::Named(_) => self.described()?.design(),
            SpringSpec::Coil { coil_diameter_mm, wire_diameter_mm, active_coils, free_length_mm, material } => {
                let (diameter_m, wire_m) = (coil_diameter_mm * 1e-3, wire_diameter_mm * 1e-3);
                let coil = Coil::new(diameter_m, wire_m, *active_coils, free_length_mm * 1e-3, material.moduli())?;
                Ok(SpringDesign::Coil(coil))
            }
            SpringSpec::Stiffness { length_mm, rows } => {
                let at_top = Matrix6::from_fn(|row, column| rows[row].0[column]);
                // The load bends no stiffness given: what is wrong with it is wrong without one.
                Spring::from_stiffness(length_mm * 1e-3, 0.0, &at_top)?;
                Ok(SpringDesign::Stiffness { length_m: length_mm * 1e-3, at_top })
            }
        }
    }
}

impl SpringDesign {
    /// The force law of the spring when it is at rest under `load_n` along its axis (compression positive), cut into
    /// `segments`.
    ///
    /// # Errors
    /// When it cannot bear the load, or cannot be cut so.
    pub fn law(&self, load_n: f64, segments: usize) -> Result<Spring, ElasticityError> {
        match self {
            SpringDesign::Coil(coil) => Spring::of_column(&coil.under(load_n)?, segments),
            SpringDesign::Stiffness { length_m, at_top } => match segments {
                1 => Spring::from_stiffness(*length_m, load_n, at_top),
                _ => Err(ElasticityError::CannotBeCut { segments }),
            },
        }
    }
}
