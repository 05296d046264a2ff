//! The design space of a search: coils that can be ordered, within bounds or from a catalogue.

use super::catalogue::catalogue;
use super::spec::{CoilDesign, DesignSpec, SpaceSpec};
use crate::sweep::Measure;
use zsim_base::spec::{Source, SpecError};
use zsim_elasticity::{EndsSpec, Material};

/// A validated design space.
pub(super) enum Space {
    Coils(CoilSpace),
    Catalogue(Vec<CoilDesign>),
}

/// Coils with mean diameter, wire diameter, active coils and free length within bounds.
pub(super) struct CoilSpace {
    bounds: [[f64; 2]; 4],
    /// The wires that can be ordered, mm; `None` for any.
    wires_mm: Option<Vec<f64>>,
    ends: EndsSpec,
    material: Material,
}

/// Steps per mm of the mean diameter and of the free length, and per active coil, in which coils are ordered. The table of
/// candidates then has the dimensions of the evaluated coil.
const STEPS_PER_MM: f64 = 10.0;
const STEPS_PER_MM_OF_LENGTH: f64 = 2.0;
const STEPS_PER_COIL: f64 = 10.0;

impl Space {
    /// The space of `spec`, read from `source`.
    ///
    /// # Errors
    /// When bounds are reversed, no wire is available between them, or a catalogue cannot be read.
    pub fn of(spec: &DesignSpec, source: &Source) -> Result<Self, SpecError> {
        let (bounds, ends, material) = match &spec.space {
            SpaceSpec::Catalogue(name) => return Ok(Space::Catalogue(catalogue(name, source)?)),
            SpaceSpec::Coil { coil_diameter_mm, wire_diameter_mm, active_coils, free_length_mm, ends, material } => {
                ([*coil_diameter_mm, *wire_diameter_mm, *active_coils, *free_length_mm], *ends, *material)
            }
        };
        if let Some([low, high]) = bounds.iter().find(|[low, high]| high < low) {
            let message = format!("the lower bound {low} exceeds the upper bound {high}");
            return Err(SpecError::about(source, "space", message));
        }
        let wires_mm = spec.build.wires.between(bounds[1]);
        if wires_mm.as_ref().is_some_and(Vec::is_empty) {
            let [low, high] = bounds[1];
            let message = format!("no wire of {low} to {high} mm is available: widen the bounds or change build.wires");
            return Err(SpecError::about(source, "wire_diameter_mm", message));
        }
        Ok(Space::Coils(CoilSpace { bounds, wires_mm, ends, material }))
    }
}

impl Space {
    /// The property of the material without which no spring of the space has a measure; the materials of a catalogue have all.
    pub fn missing_for(&self, measure: Measure) -> Option<&'static str> {
        let Space::Coils(CoilSpace { material, bounds, .. }) = self else { return None };
        let wire_m = 1e-3 * bounds[1][0];
        match measure.key() {
            "stress_share" => material.yield_pa(wire_m).is_none().then_some("strength"),
            "spring_mass_g" => material.density_kg_per_m3().is_none().then_some("density"),
            _ => None,
        }
    }
}

impl CoilSpace {
    /// The coil that can be ordered nearest to a point of the unit cube.
    pub fn coil_at(&self, point: &[f64]) -> CoilDesign {
        let between = |k: usize| self.bounds[k][0] + point[k] * (self.bounds[k][1] - self.bounds[k][0]);
        let stepped =
            |k: usize, steps: f64| ((between(k) * steps).round() / steps).clamp(self.bounds[k][0], self.bounds[k][1]);
        let wire_mm = between(1);
        let distance = |wire: &f64| (wire - wire_mm).abs();
        let nearest = self.wires_mm.iter().flatten().copied().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        CoilDesign {
            name: String::new(),
            coil_diameter_mm: stepped(0, STEPS_PER_MM),
            wire_diameter_mm: nearest.unwrap_or(wire_mm),
            active_coils: stepped(2, STEPS_PER_COIL),
            free_length_mm: stepped(3, STEPS_PER_MM_OF_LENGTH),
            ends: self.ends,
            material: self.material,
        }
    }
}
