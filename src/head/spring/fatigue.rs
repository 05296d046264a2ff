//! Fatigue of a spring's wire under a periodic load.

use super::wire::{ANGLES, Wire, WireLoad, WireStress};
use serde::Serialize;

/// Number of cycles from which the endurance of spring wire is constant.
const ENDURANCE_CYCLES: f64 = 1e6;

/// Fatigue strength at 1000 cycles over the tensile strength (Shigley's Mechanical Engineering Design, 9th edition, figure
/// 6-18, at its upper end of 1.4 GPa).
const STRENGTH_AT_1000: f64 = 0.77;

/// Default duration for which a spring must withstand its swing, hours.
pub const MISSION_HOURS: f64 = 1000.0;

/// A stress that alternates about a mean, von Mises.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StressCycle {
    /// Amplitude, Pa.
    pub amplitude_pa: f64,
    /// Mean, Pa.
    pub mean_pa: f64,
}

/// The range of the stress at each angle around the coil, at the two ends of a spring.
#[derive(Debug, Clone)]
pub(super) struct StressRange {
    wire: Wire,
    /// Minimum and maximum of each entry.
    ranges: Vec<(WireStress, WireStress)>,
    largest_pa: f64,
}

impl Wire {
    /// The margin of a stress cycle that is repeated `cycles` times; `None` if the strength is unknown.
    ///
    /// The line of Goodman, `1 / (amplitude / Sf + mean / Sut)` (Shigley, equation 6-46). The fatigue strength Sf is the
    /// endurance for a million cycles and more, and a line in the logarithms from there to 77 % of the tensile strength at
    /// 1000 cycles.
    pub fn fatigue_margin(&self, cycle: &StressCycle, cycles: f64) -> Option<f64> {
        let strength_pa = self.material.tensile_strength_pa(self.diameter_m)?;
        let endurance_pa = self.material.endurance_pa(self.diameter_m)?;
        let decades = (ENDURANCE_CYCLES / cycles.max(1e3)).log10().max(0.0) / 3.0;
        let fatigue_pa = endurance_pa * (STRENGTH_AT_1000 * strength_pa / endurance_pa).max(1.0).powf(decades);
        Some(1.0 / (cycle.amplitude_pa / fatigue_pa + cycle.mean_pa / strength_pa))
    }
}

impl StressRange {
    pub fn new(wire: Wire) -> Self {
        Self { wire, ranges: Vec::new(), largest_pa: 0.0 }
    }

    /// Adds the loads on the two ends of the spring at one time.
    pub fn add(&mut self, ends: &[WireLoad; 2]) {
        let wire = self.wire;
        let now = ends.iter().flat_map(|end| (0..ANGLES).map(move |k| wire.stress_at(end, k)));
        if self.ranges.is_empty() {
            self.ranges = now.clone().map(|stress| (stress, stress)).collect();
        }
        for ((low, high), stress) in self.ranges.iter_mut().zip(now) {
            (*low, *high) = (low.zip(&stress, f64::min), high.zip(&stress, f64::max));
            self.largest_pa = self.largest_pa.max(stress.von_mises_pa());
        }
    }

    /// Maximum von Mises stress, Pa; `None` without a load.
    pub fn largest_pa(&self) -> Option<f64> {
        (!self.ranges.is_empty()).then_some(self.largest_pa)
    }

    /// The cycle with the smallest margin against endless repetition; without strengths, that with the largest amplitude.
    ///
    /// Amplitude and mean are the von Mises stresses of the amplitudes and of the means of the entries (Shigley, equations
    /// 6-55 and 6-56).
    pub fn worst_cycle(&self) -> Option<StressCycle> {
        let cycles = self.ranges.iter().map(|(low, high)| StressCycle {
            amplitude_pa: low.zip(high, |low, high| 0.5 * (high - low)).von_mises_pa(),
            mean_pa: low.zip(high, |low, high| 0.5 * (high + low)).von_mises_pa(),
        });
        let damage = |cycle: &StressCycle| {
            self.wire.fatigue_margin(cycle, f64::INFINITY).map_or(cycle.amplitude_pa, |margin| 1.0 / margin)
        };
        cycles.max_by(|a, b| damage(a).total_cmp(&damage(b)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::Vector;
    use zsim_elasticity::Material;

    const WIRE: Wire = Wire { coil_radius_m: 0.0125, diameter_m: 0.003, material: Material::SpringSteel };

    fn pressed(force_n: f64) -> [WireLoad; 2] {
        [WireLoad { force: -Vector::z() * force_n, moment: Vector::zeros() }; 2]
    }

    #[test]
    fn a_pulsating_load_has_half_of_its_stress_as_amplitude_and_as_mean() {
        let mut range = StressRange::new(WIRE);
        range.add(&pressed(0.0));
        range.add(&pressed(60.0));
        let (cycle, largest_pa) = (range.worst_cycle().unwrap(), range.largest_pa().unwrap());
        assert_relative_eq!(cycle.amplitude_pa, 0.5 * largest_pa, max_relative = 1e-12);
        assert_relative_eq!(cycle.mean_pa, 0.5 * largest_pa, max_relative = 1e-12);
    }

    #[test]
    fn the_amplitude_that_the_data_permit_has_margin_one() {
        // Zimmerli: a torsional stress of 379 MPa with an amplitude of 241 MPa. In Goodman's line for von Mises stresses the
        // mean counts with the tensile strength, which is less than sqrt(3) 0.67 times it: the margin is a little less.
        let root = 3_f64.sqrt();
        let cycle = StressCycle { amplitude_pa: root * 241e6, mean_pa: root * 379e6 };
        let strength_pa = 2211e6 / 3_f64.powf(0.145);
        let expected = 1.0 / ((1.0 - 379e6 / (0.67 * strength_pa)) + root * 379e6 / strength_pa);
        let margin = WIRE.fatigue_margin(&cycle, 1e7).unwrap();
        assert_relative_eq!(margin, expected, max_relative = 1e-12);
        assert!(margin > 0.9 && margin < 1.0, "{margin}");
    }

    #[test]
    fn fewer_cycles_permit_more_up_to_the_strength_at_a_thousand() {
        let cycle = StressCycle { amplitude_pa: 400e6, mean_pa: 0.0 };
        let margin = |cycles: f64| WIRE.fatigue_margin(&cycle, cycles).unwrap();
        assert_eq!(margin(1e6), margin(1e9));
        assert_relative_eq!(margin(1e3), 0.77 * 2211.0 / 3_f64.powf(0.145) / 400.0, max_relative = 1e-12);
        // The line is straight in the logarithms.
        assert_relative_eq!(margin(1e4).powi(3), margin(1e3).powi(2) * margin(1e6), max_relative = 1e-12);
        let unknown = Wire {
            material: Material::Moduli {
                youngs_gpa: 206.0,
                shear_gpa: 79.3,
                density_kg_per_m3: None,
                tensile_strength_mpa: None,
                yield_mpa: None,
                endurance_mpa: None,
            },
            ..WIRE
        };
        assert_eq!(unknown.fatigue_margin(&cycle, 1e6), None);
    }
}
