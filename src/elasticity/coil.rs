//! A helical spring as a column (Wahl, Mechanical Springs; Timoshenko & Gere, Theory of Elastic Stability, 2.19).

use super::{Column, ElasticityError};

/// Moduli of a wire's material, Pa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moduli {
    /// Young's modulus E, Pa.
    pub youngs_pa: f64,
    /// Shear modulus G, Pa.
    pub shear_pa: f64,
}

impl Moduli {
    /// Poisson's ratio `nu = E / 2G - 1`.
    pub fn poisson(&self) -> f64 {
        self.youngs_pa / (2.0 * self.shear_pa) - 1.0
    }
}

/// How the wire winds about the axis, which points from the foot to the top.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Winding {
    /// Whether the wire winds like a left-handed screw.
    pub left_handed: bool,
    /// Angle at which the wire begins at the foot, from the spring frame's +x towards +y, rad.
    pub start_rad: f64,
}

/// A helical spring of round wire.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coil {
    winding: Winding,
    coil_diameter_m: f64,
    wire_diameter_m: f64,
    active_coils: f64,
    free_length_m: f64,
    moduli: Moduli,
    restitution: f64,
}

/// Spring indices for which the force law is valid.
const INDEX: [f64; 2] = [4.0, 20.0];
/// Pitch angles without load for which the force law is valid, degrees.
const PITCH_DEG: [f64; 2] = [0.0, 15.0];
/// Maximum number of active coils: models and drawings have a number of elements for each.
const MAX_COILS: f64 = 1000.0;
/// Relative tolerance at the ends of the range: 4 mm over 1 mm is in it.
const RANGE_ROUNDING: f64 = 1e-9;

impl Coil {
    /// Creates a coil with mean diameter `coil_diameter_m` and `active_coils` turns of wire, right-handed, which begin on +x.
    ///
    /// All numbers are finite and above zero.
    ///
    /// # Errors
    /// When the spring index (coil over wire diameter) is below 2, there are more than 1000 coils, the coils touch without
    /// load, or Poisson's ratio is outside -1 to 0.5.
    pub fn new(
        coil_diameter_m: f64,
        wire_diameter_m: f64,
        active_coils: f64,
        free_length_m: f64,
        moduli: Moduli,
    ) -> Result<Self, ElasticityError> {
        let winding = Winding { left_handed: false, start_rad: 0.0 };
        let restitution = 1.0;
        let coil = Self { winding, coil_diameter_m, wire_diameter_m, active_coils, free_length_m, moduli, restitution };
        let (poisson, index) = (moduli.poisson(), coil_diameter_m / wire_diameter_m);
        if !(poisson > -1.0 && poisson <= 0.5) {
            let (youngs_gpa, shear_gpa) = (moduli.youngs_pa * 1e-9, moduli.shear_pa * 1e-9);
            return Err(ElasticityError::Moduli { youngs_gpa, shear_gpa, poisson });
        }
        if index < 2.0 {
            let (wire_mm, coil_mm) = (wire_diameter_m * 1e3, coil_diameter_m * 1e3);
            return Err(ElasticityError::IndexTooSmall { wire_mm, coil_mm, index });
        }
        if active_coils > MAX_COILS {
            return Err(ElasticityError::TooManyCoils { coils: active_coils, most: MAX_COILS });
        }
        if coil.solid_length_m() >= free_length_m {
            return Err(ElasticityError::CoilsTouch {
                coils: active_coils,
                wire_mm: wire_diameter_m * 1e3,
                solid_mm: coil.solid_length_m() * 1e3,
                free_mm: free_length_m * 1e3,
            });
        }
        Ok(coil)
    }

    /// The same coil with a coefficient of restitution of its coils, 0 to 1; that of a new coil is 1.
    pub fn with_restitution(self, restitution: f64) -> Self {
        Self { restitution, ..self }
    }

    /// Coefficient of restitution of coils that touch.
    pub fn restitution(&self) -> f64 {
        self.restitution
    }

    /// The same coil with another winding.
    pub fn wound(self, winding: Winding) -> Self {
        Self { winding, ..self }
    }

    /// How the wire winds.
    pub fn winding(&self) -> &Winding {
        &self.winding
    }

    /// Checks that the force law is valid for the coil: within the range that is compared with an exact rod in
    /// `tests/dynamics/rod.rs`.
    ///
    /// # Errors
    /// When the index or the pitch is outside.
    pub fn check_range(&self) -> Result<(), ElasticityError> {
        let index = self.coil_diameter_m / self.wire_diameter_m;
        let pitch_deg = self.free_length_m.atan2(std::f64::consts::PI * self.coil_diameter_m * self.active_coils);
        let pitch_deg = pitch_deg.to_degrees();
        let quantities = [
            ("index (mean coil diameter over wire diameter)", index, INDEX),
            ("pitch angle in degrees", pitch_deg, PITCH_DEG),
        ];
        let is_outside = |(_, value, [low, high]): &(&str, f64, [f64; 2])| {
            *value < low * (1.0 - RANGE_ROUNDING) || *value > high * (1.0 + RANGE_ROUNDING)
        };
        match quantities.into_iter().find(is_outside) {
            None => Ok(()),
            Some((quantity, value, range)) => Err(ElasticityError::OutsideRange { quantity, value, range }),
        }
    }

    /// Length of the wire of one turn, without load, m.
    pub fn wire_per_turn_m(&self) -> f64 {
        (std::f64::consts::PI * self.coil_diameter_m).hypot(self.free_length_m / self.active_coils)
    }

    /// Mean diameter of the coil, m.
    pub fn coil_diameter_m(&self) -> f64 {
        self.coil_diameter_m
    }

    /// Diameter of the wire, m.
    pub fn wire_diameter_m(&self) -> f64 {
        self.wire_diameter_m
    }

    /// Number of active coils.
    pub fn active_coils(&self) -> f64 {
        self.active_coils
    }

    /// Moduli of the wire.
    pub fn moduli(&self) -> &Moduli {
        &self.moduli
    }

    /// Free length, m.
    pub fn free_length_m(&self) -> f64 {
        self.free_length_m
    }

    /// Solid length, at which the active coils touch, m; inactive end coils are not included.
    pub fn solid_length_m(&self) -> f64 {
        self.active_coils * self.wire_diameter_m
    }

    /// Axial stiffness `G d^4 / (8 D^3 n)`, N/m.
    pub fn axial_n_per_m(&self) -> f64 {
        self.moduli.shear_pa * self.wire_diameter_m.powi(4) / (8.0 * self.coil_diameter_m.powi(3) * self.active_coils)
    }

    /// Torsional stiffness about the axis `E d^4 / (64 D n)`, N m/rad.
    pub fn torsion_nm_per_rad(&self) -> f64 {
        self.moduli.youngs_pa * self.wire_diameter_m.powi(4) / (64.0 * self.coil_diameter_m * self.active_coils)
    }

    /// Volume of the active wire `pi^2 D n d^2 / 4`, m^3.
    pub fn wire_volume_m3(&self) -> f64 {
        let pi = std::f64::consts::PI;
        0.25 * pi * pi * self.coil_diameter_m * self.active_coils * self.wire_diameter_m.powi(2)
    }

    /// The equivalent column under the axial load `load_n`, compression positive.
    ///
    /// The rigidities are those at the loaded length.
    ///
    /// # Errors
    /// When the load compresses the spring to its solid length.
    pub fn under_load(&self, load_n: f64) -> Result<Column, ElasticityError> {
        let length_m = self.free_length_m - load_n / self.axial_n_per_m();
        if length_m <= self.solid_length_m() {
            let shorter_mm = |length_m: f64| (self.free_length_m - length_m) * 1e3;
            let (by_mm, travel_mm) = (shorter_mm(length_m), shorter_mm(self.solid_length_m()));
            return Err(ElasticityError::Clash { load_n, by_mm, travel_mm });
        }
        let poisson = self.moduli.poisson();
        Ok(Column {
            length_m,
            bending_nm2: length_m * self.bending_nm_per_rad(),
            shear_n: 2.0 * (1.0 + poisson) * self.axial_n_per_m() * length_m,
            axial_n_per_m: self.axial_n_per_m(),
            torsion_nm_per_rad: self.torsion_nm_per_rad(),
            load_n,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEEL: Moduli = Moduli { youngs_pa: 206e9, shear_pa: 79.3e9 };

    #[test]
    fn a_wire_thicker_than_half_its_coil_is_refused() {
        let error = Coil::new(0.025, 0.015, 2.0, 0.12, STEEL).unwrap_err();
        assert!(error.to_string().contains("index, is 1.67"), "{error}");
    }

    #[test]
    fn the_range_of_the_force_law_ends_at_an_index_of_4_and_20_and_a_pitch_of_15_degrees() {
        let checked = |coil_m: f64, wire_m: f64, coils: f64, length_m: f64| {
            Coil::new(coil_m, wire_m, coils, length_m, STEEL).unwrap().check_range().map_err(|error| error.to_string())
        };
        assert_eq!(checked(0.012, 0.003, 4.0, 0.03), Ok(()));
        assert_eq!(checked(0.06, 0.003, 4.0, 0.03), Ok(()));
        assert!(
            checked(0.0119, 0.003, 4.0, 0.03).unwrap_err().contains("index (mean coil diameter over wire diameter)")
        );
        assert!(checked(0.0601, 0.003, 4.0, 0.03).unwrap_err().contains("valid from 4 to 20"));
        // tan(15 degrees) pi 25 mm = 21.04 mm per coil.
        assert_eq!(checked(0.025, 0.003, 5.0, 0.1052), Ok(()));
        assert!(
            checked(0.025, 0.003, 5.0, 0.1053).unwrap_err().contains("pitch angle in degrees of the spring is 15.0")
        );
    }

    #[test]
    fn coils_that_touch_are_refused_free_and_under_load() {
        let error = Coil::new(0.025, 0.003, 40.0, 0.12, STEEL).unwrap_err();
        assert!(matches!(error, ElasticityError::CoilsTouch { .. }), "{error}");
        // k = 79.3e9 * 0.003^4 / (8 * 0.025^3 * 12) = 4282.2 N/m; 400 N would leave 26.6 mm; the solid length is 36 mm.
        let coil = Coil::new(0.025, 0.003, 12.0, 0.12, STEEL).unwrap();
        let ElasticityError::Clash { by_mm, travel_mm, .. } = coil.under_load(400.0).unwrap_err() else {
            panic!("no clash");
        };
        assert!((by_mm - 93.41).abs() < 0.01 && (travel_mm - 84.0).abs() < 1e-9, "{by_mm} {travel_mm}");
    }

    #[test]
    fn impossible_moduli_are_refused() {
        let rubber = Moduli { youngs_pa: 206e9, shear_pa: 50e9 };
        assert!(matches!(Coil::new(0.025, 0.003, 12.0, 0.12, rubber), Err(ElasticityError::Moduli { .. })));
    }
}
