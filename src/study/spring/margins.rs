//! Margins of a coil spring in its largest swing: clash, solid length, buckling, yield and fatigue.

use super::fatigue::{StressCycle, StressRange};
use super::model::SpringModel;
use super::wire::WireLoad;
use crate::dynamics::HeadState;
use crate::elasticity::{Coil, SectionLoad, buckling_load_n};
use serde::Serialize;

/// Margins of a coil spring over the observed states: what is available over what is needed; above 1 is safe.
///
/// `None` for a quantity that is unknown, or that is not loaded.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SpringMargins {
    /// Gap between neighbouring coils at rest over its largest reduction on the inner side of the bend.
    pub clash: Option<f64>,
    /// Smallest gap between neighbouring coils, mm; negative where they clash.
    pub gap_mm: Option<f64>,
    /// Travel from the free to the solid length over the largest compression of the axis.
    pub solid: Option<f64>,
    /// Buckling load with a guided top over the largest axial load.
    pub buckling: Option<f64>,
    /// Yield stress over the maximum stress in the wire.
    pub yielding: Option<f64>,
    /// The stress cycle of the wire with the smallest margin.
    pub cycle: Option<StressCycle>,
}

/// Extremes of the load on a coil spring over time.
pub(super) struct LoadRecord<'a> {
    model: &'a SpringModel,
    coil: Option<Coil>,
    stress: Option<StressRange>,
    rest_gap_m: f64,
    least_gap_m: Option<f64>,
    largest_axial_n: f64,
}

impl<'a> LoadRecord<'a> {
    /// A record that starts with the head at rest.
    pub fn new(model: &'a SpringModel, at_rest: &HeadState) -> Self {
        let coil = model.coil.filter(|_| model.carries_alone());
        let stress = model.wire.filter(|_| model.carries_alone()).map(StressRange::new);
        let mut record =
            Self { model, coil, stress, rest_gap_m: f64::NAN, least_gap_m: None, largest_axial_n: f64::NEG_INFINITY };
        record.add(at_rest, None);
        record.rest_gap_m = record.least_gap_m.unwrap_or(f64::NAN);
        record
    }

    /// Adds a state.
    ///
    /// `gap_m` is the smallest gap between neighbouring coils; without it, the gap follows from the loads on the two ends of
    /// the spring.
    pub fn add(&mut self, state: &HeadState, gap_m: Option<f64>) {
        let Some(mounting) = &self.model.mounting else { return };
        let ends = mounting.ends(state);
        if let Some(stress) = &mut self.stress {
            stress.add(&ends);
        }
        if let Some(coil) = &self.coil {
            let loads = ends.map(|end| section_load(&end));
            let by_loads = loads.iter().map(|load| coil.inner_gap_m(load)).reduce(f64::min);
            self.least_gap_m = [self.least_gap_m, gap_m.or(by_loads)].into_iter().flatten().reduce(f64::min);
            self.largest_axial_n = loads.iter().map(|load| load.axial_n).fold(self.largest_axial_n, f64::max);
        }
    }

    /// Maximum von Mises stress in the wire, Pa.
    pub fn stress_pa(&self) -> Option<f64> {
        self.stress.as_ref().and_then(StressRange::largest_pa)
    }

    /// The margins over all added states.
    pub fn margins(&self) -> SpringMargins {
        let closed_m = self.least_gap_m.map(|gap_m| self.rest_gap_m - gap_m).filter(|closed_m| *closed_m > 0.0);
        let pressed = self.coil.filter(|_| self.largest_axial_n > 0.0);
        let travel_n =
            |coil: Coil| (coil.free_length_m() - coil.solid_length_m()) * coil.axial_n_per_m() / self.largest_axial_n;
        let yield_pa = self.model.wire.and_then(|wire| wire.yield_pa());
        SpringMargins {
            clash: closed_m.map(|closed_m| self.rest_gap_m / closed_m),
            gap_mm: self.least_gap_m.map(|gap_m| gap_m * 1e3),
            solid: pressed.map(travel_n),
            buckling: pressed.and_then(|coil| buckling_load_n(&coil)).map(|load_n| load_n / self.largest_axial_n),
            yielding: yield_pa.zip(self.stress_pa()).map(|(yield_pa, stress_pa)| yield_pa / stress_pa),
            cycle: self.stress.as_ref().and_then(StressRange::worst_cycle),
        }
    }
}

/// The axial force and the bending moment of the load that the head exerts on a section.
fn section_load(load: &WireLoad) -> SectionLoad {
    SectionLoad { axial_n: -load.force.z, bending_nm: load.moment.xy().norm() }
}

#[cfg(test)]
mod tests {
    use super::super::{Shake, closed_form, simulated};
    use crate::dynamics::load;
    use crate::sensors::Lidar;
    use crate::spec::{Kind, find, parse};
    use crate::study::coverage::CoveragePlan;
    use approx::assert_relative_eq;

    #[test]
    fn the_margins_of_a_small_swing_follow_from_its_bending_moment() {
        // At its resonance the handheld head pitches by the gain times 0.1 degrees; its field of view is twice that. The
        // moment at the foot is that of the weight and of the inertia, which the elastic moment of the bent spring balances.
        let (spec, source) = load("handheld").unwrap();
        let shake = Shake { pitch_deg: 0.1, frequency_hz: None };
        let lidar_source = find(Kind::Lidar, "utm30lx").unwrap();
        let lidar = Lidar::new(&parse(&lidar_source).unwrap(), &lidar_source).unwrap();
        let plan = CoveragePlan { from_s: 15.0, duration_s: 3.0, ..CoveragePlan::default() };
        let linear = closed_form(&spec, &source, &shake).unwrap();
        let (full, _) = simulated(&spec, &source, &shake, &lidar, &plan).unwrap();
        // The gap by the loads (d'Alembert) and by the force law of the deflected spring are computed independently.
        let closed = |gap_mm: f64| (120.0 - 36.0 - 0.86) / 12.0 - gap_mm;
        let (by_loads, by_law) = (closed(linear.margins.gap_mm.unwrap()), closed(full.margins.gap_mm.unwrap()));
        assert!(by_loads > 0.0);
        assert_relative_eq!(by_law, by_loads, max_relative = 0.05);
        // A uniform bend by the head's pitch would close R phi / 12; the bend is largest at the foot.
        let uniform = 12.5 * (0.5 * linear.field_of_view_deg).to_radians() / 12.0;
        assert!(by_loads > uniform && by_loads < 2.0 * uniform, "{by_loads} {uniform}");
        assert_relative_eq!(full.margins.yielding.unwrap(), linear.margins.yielding.unwrap(), max_relative = 0.03);
        assert_relative_eq!(linear.margins.yielding.unwrap(), 1.0 / linear.stress_share.unwrap(), max_relative = 1e-12);
    }
}
