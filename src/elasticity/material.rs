//! Materials of wires: moduli, density and strength.

use super::Moduli;
use serde::{Deserialize, Serialize};
use zsim_base::spec::checked;

/// Material of a wire.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Material {
    /// Patented or music wire: E = 206 GPa, G = 79.3 GPa.
    #[default]
    SpringSteel,
    /// Stainless 302: E = 193 GPa, G = 69 GPa.
    Stainless,
    /// A material with given moduli.
    Moduli {
        /// Young's modulus, GPa.
        #[serde(with = "checked::Positive")]
        youngs_gpa: f64,
        /// Shear modulus, GPa.
        #[serde(with = "checked::Positive")]
        shear_gpa: f64,
        /// Density, kg/m^3; needed only for the mass of the wire.
        #[serde(default)]
        density_kg_per_m3: Option<Density>,
        /// Tensile strength of the wire, MPa; needed only for fatigue limits.
        #[serde(default)]
        tensile_strength_mpa: Option<Stress>,
        /// Tensile yield stress of the wire, MPa; needed only for yield limits.
        #[serde(default)]
        yield_mpa: Option<Stress>,
        /// Amplitude of a fully reversed tensile stress that the wire endures for a million cycles and more, MPa; needed
        /// only for fatigue limits.
        #[serde(default)]
        endurance_mpa: Option<Stress>,
    },
}

/// A positive density, kg/m^3.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(transparent)]
pub struct Density(#[serde(with = "checked::Positive")] pub f64);

/// A positive stress, MPa.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(transparent)]
pub struct Stress(#[serde(with = "checked::Positive")] pub f64);

/// Amplitude and mean torsional stress that unpeened spring wire endures without limit, MPa (Zimmerli 1957, for wires
/// below 10 mm of any tensile strength; Shigley's Mechanical Engineering Design, 9th edition, equation 10-28).
const ZIMMERLI_MPA: (f64, f64) = (241.0, 379.0);

/// Torsional strength over tensile strength of spring wire (Shigley, equation 10-30).
const TORSIONAL_STRENGTH: f64 = 0.67;

impl Material {
    /// Name as in specs and catalogues.
    pub fn key(&self) -> &'static str {
        match self {
            Material::SpringSteel => "spring_steel",
            Material::Stainless => "stainless",
            Material::Moduli { .. } => "moduli",
        }
    }

    /// Name in words.
    pub fn name(&self) -> &'static str {
        match self {
            Material::SpringSteel => "spring steel (patented or music wire)",
            Material::Stainless => "stainless steel 302 (1.4310)",
            Material::Moduli { .. } => "given by its moduli",
        }
    }

    /// The elastic moduli.
    pub fn moduli(&self) -> Moduli {
        let (youngs_gpa, shear_gpa) = match self {
            Material::SpringSteel => (206.0, 79.3),
            Material::Stainless => (193.0, 69.0),
            Material::Moduli { youngs_gpa, shear_gpa, .. } => (*youngs_gpa, *shear_gpa),
        };
        Moduli { youngs_pa: youngs_gpa * 1e9, shear_pa: shear_gpa * 1e9 }
    }

    /// The density, kg/m^3, or `None` if unknown.
    ///
    /// 7850 for carbon steel, 7900 for stainless 302 (typical values).
    pub fn density_kg_per_m3(&self) -> Option<f64> {
        match self {
            Material::SpringSteel => Some(7850.0),
            Material::Stainless => Some(7900.0),
            Material::Moduli { density_kg_per_m3, .. } => density_kg_per_m3.map(|density| density.0),
        }
    }

    /// Tensile strength of a wire, Pa, or `None` if unknown.
    ///
    /// `A / d^m` for music wire and stainless 302 (Shigley, table 10-4).
    pub fn tensile_strength_pa(&self, wire_diameter_m: f64) -> Option<f64> {
        let wire_mm = wire_diameter_m * 1e3;
        let (strength_mpa, exponent) = match self {
            Material::SpringSteel => (2211.0, 0.145),
            Material::Stainless if wire_mm <= 2.5 => (1867.0, 0.146),
            Material::Stainless if wire_mm <= 5.0 => (2065.0, 0.263),
            Material::Stainless => (2911.0, 0.478),
            Material::Moduli { tensile_strength_mpa, .. } => return tensile_strength_mpa.map(|stress| stress.0 * 1e6),
        };
        Some(1e6 * strength_mpa / f64::powf(wire_mm, exponent))
    }

    /// Tensile yield stress of a wire, Pa, or `None` if unknown.
    ///
    /// The allowable torsional stress is 45 % of the tensile strength for music wire and 35 % for stainless 302
    /// (Shigley, table 10-6). The von Mises criterion gives the tensile yield stress: sqrt(3) times the torsional stress.
    pub fn yield_pa(&self, wire_diameter_m: f64) -> Option<f64> {
        let torsion_ratio = match self {
            Material::SpringSteel => 0.45,
            Material::Stainless => 0.35,
            Material::Moduli { yield_mpa, .. } => return yield_mpa.map(|stress| stress.0 * 1e6),
        };
        self.tensile_strength_pa(wire_diameter_m).map(|strength_pa| 3_f64.sqrt() * torsion_ratio * strength_pa)
    }

    /// Amplitude of a fully reversed stress (von Mises) that a wire endures for a million cycles and more, Pa.
    ///
    /// Zimmerli's point on the line of Goodman, extended to a mean stress of zero, gives the torsional limit `Ssa / (1 -
    /// Ssm / Ssu)` with `Ssu = 0.67 Sut` (Shigley, example 10-4); sqrt(3) times that is the von Mises stress. `None` if the
    /// strength is unknown.
    pub fn endurance_pa(&self, wire_diameter_m: f64) -> Option<f64> {
        if let Material::Moduli { endurance_mpa, .. } = self {
            return endurance_mpa.map(|stress| stress.0 * 1e6);
        }
        let torsional_mpa = TORSIONAL_STRENGTH * self.tensile_strength_pa(wire_diameter_m)? * 1e-6;
        let (amplitude_mpa, mean_mpa) = ZIMMERLI_MPA;
        Some(3_f64.sqrt() * 1e6 * amplitude_mpa / (1.0 - mean_mpa / torsional_mpa))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::spec::{Source, parse};

    #[test]
    fn the_endurance_of_music_wire_is_that_of_the_textbook() {
        // Shigley, example 10-4 (in ksi): music wire of 0.092 in has Sut = 201 / 0.092^0.145 = 284.1 ksi = 1959 MPa, Ssu =
        // 190.3 ksi = 1312 MPa, and with Zimmerli's unpeened data (35, 55) the limit 35 / (1 - 55 / 190.3) = 49.2 ksi.
        let wire_m = 0.092 * 0.0254;
        let strength_pa = Material::SpringSteel.tensile_strength_pa(wire_m).unwrap();
        assert_relative_eq!(strength_pa, 1959e6, max_relative = 5e-3);
        let endurance_pa = Material::SpringSteel.endurance_pa(wire_m).unwrap();
        assert_relative_eq!(endurance_pa / 3_f64.sqrt(), 49.2 * 6.895e6, max_relative = 5e-3);
    }

    #[test]
    fn a_material_has_the_strength_that_is_given() {
        let material = |text: &str| parse::<Material>(&Source::in_memory("material", text)).unwrap();
        let titanium = material(
            "moduli(youngs_gpa: 110, shear_gpa: 42, tensile_strength_mpa: 1000, yield_mpa: 900, endurance_mpa: 500)",
        );
        let strengths = [titanium.tensile_strength_pa(1.0), titanium.yield_pa(1.0), titanium.endurance_pa(1.0)];
        assert_eq!(strengths, [Some(1000e6), Some(900e6), Some(500e6)]);
        let unknown = material("moduli(youngs_gpa: 110, shear_gpa: 42)");
        assert_eq!((unknown.yield_pa(0.003), unknown.density_kg_per_m3()), (None, None));
    }
}
