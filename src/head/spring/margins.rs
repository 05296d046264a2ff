//! Margins of a coil spring in its largest swing: clash, solid length, buckling, yield and fatigue.

use super::fatigue::{StressCycle, StressRange};
use super::model::{SpringModel, WoundSpring, at_rest};
use super::wire::{SpringMounting, WireLoad};
use serde::Serialize;
use zsim_dynamics::{CoilGap, EndLoad, HeadModel, HeadState, SpringEndLoads};
use zsim_elasticity::{Coil, SectionLoad, buckling_load_n};

/// Margins of a coil spring over the observed states, of several springs the smallest: what is available over what is needed;
/// above 1 is safe.
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
    /// The stress cycle with the smallest margin.
    pub cycle: Option<StressCycle>,
}

impl SpringMargins {
    /// No margin is known.
    const UNKNOWN: Self = Self { clash: None, gap_mm: None, solid: None, buckling: None, yielding: None, cycle: None };

    /// The smaller of each margin of two springs; the cycle is that of the first.
    fn least(self, other: Self) -> Self {
        let least = |a: Option<f64>, b: Option<f64>| [a, b].into_iter().flatten().reduce(f64::min);
        Self {
            clash: least(self.clash, other.clash),
            gap_mm: least(self.gap_mm, other.gap_mm),
            solid: least(self.solid, other.solid),
            buckling: least(self.buckling, other.buckling),
            yielding: least(self.yielding, other.yielding),
            cycle: self.cycle.or(other.cycle),
        }
    }
}

/// Extremes of the loads on the springs of a head over time.
pub(super) struct LoadRecord<'a> {
    springs: Vec<SpringRecord>,
    source: LoadSource<'a>,
}

/// How the loads on the ends of the springs are known.
enum LoadSource<'a> {
    /// A single spring: from weight and inertial force of the head.
    Inertia(SpringMounting),
    /// Several: by their force laws.
    Elasticity(SpringEndLoads<'a>),
    /// Not at all: a cable bears a part of the load, or there is no spring.
    Unknown,
}

/// Extremes of the load on one spring.
struct SpringRecord {
    spring: WoundSpring,
    stress: Option<StressRange>,
    rest_gap_m: f64,
    least_gap_m: Option<f64>,
    largest_axial_n: f64,
}

impl<'a> LoadRecord<'a> {
    /// A record of a simulation, which starts with the head at rest.
    pub fn of_simulation(model: &SpringModel, head: &'a HeadModel) -> Self {
        if model.suspension.is_empty() {
            return Self::of_linear_swing(model, head);
        }
        Self::starting(LoadSource::Elasticity(SpringEndLoads::of(head)), model.suspension.clone(), head)
    }

    /// A record of linear displacements, which starts with the head at rest.
    ///
    /// They stretch a spring in the second order, so that force laws yield no loads: those of several springs are unknown.
    pub fn of_linear_swing(model: &SpringModel, head: &'a HeadModel) -> Self {
        match model.mounting.filter(|_| model.carries_alone()) {
            Some(mounting) => {
                let spring = WoundSpring { wire: model.wire, coil: model.coil };
                Self::starting(LoadSource::Inertia(mounting), vec![spring], head)
            }
            None => Self::starting(LoadSource::Unknown, Vec::new(), head),
        }
    }

    fn starting(source: LoadSource<'a>, springs: Vec<WoundSpring>, head: &HeadModel) -> Self {
        let mut record = Self { springs: springs.into_iter().map(SpringRecord::new).collect(), source };
        record.add(&at_rest(head), &[]);
        record.springs.iter_mut().for_each(SpringRecord::end_rest);
        record
    }

    /// Adds a state.
    ///
    /// `gaps` are the smallest gaps between neighbouring coils of each spring; where there is none, the gap follows from the
    /// loads on the two ends of the spring.
    pub fn add(&mut self, state: &HeadState, gaps: &[Option<CoilGap>]) {
        let ends: Vec<Option<[WireLoad; 2]>> = match &mut self.source {
            LoadSource::Inertia(mounting) => vec![Some(mounting.ends(state))],
            LoadSource::Elasticity(loads) => {
                let base_from_head = state.base.world_from_body.inv_mul(&state.head.world_from_body);
                let as_section = |load: EndLoad| WireLoad { force: load.force, moment: load.moment };
                loads.at(&base_from_head).into_iter().map(|ends| ends.map(|ends| ends.map(as_section))).collect()
            }
            LoadSource::Unknown => return,
        };
        for (k, (spring, ends)) in self.springs.iter_mut().zip(ends).enumerate() {
            let gap_m = gaps.get(k).copied().flatten().map(|gap| gap.gap_m);
            if let Some(ends) = ends {
                spring.add(&ends, gap_m);
            }
        }
    }

    /// The margins over all added states, the smallest of all springs.
    pub fn margins(&self) -> SpringMargins {
        let of_springs = self.springs.iter().map(SpringRecord::margins);
        let least = of_springs.fold(SpringMargins::UNKNOWN, SpringMargins::least);
        let worst = self.springs.iter().filter_map(SpringRecord::worst_cycle).min_by(|a, b| a.1.total_cmp(&b.1));
        SpringMargins { cycle: worst.map(|(cycle, _)| cycle), ..least }
    }

    /// The margin by Goodman's line of the stress cycles of all springs, repeated `cycles` times; `None` if a strength is
    /// unknown.
    pub fn fatigue_margin(&self, cycles: f64) -> Option<f64> {
        let margin = |spring: &SpringRecord| spring.spring.wire?.fatigue_margin(&spring.worst_cycle()?.0, cycles);
        let margins: Option<Vec<f64>> = self.springs.iter().map(margin).collect();
        margins?.into_iter().reduce(f64::min)
    }
}

impl SpringRecord {
    fn new(spring: WoundSpring) -> Self {
        Self {
            spring,
            stress: spring.wire.map(StressRange::new),
            rest_gap_m: f64::NAN,
            least_gap_m: None,
            largest_axial_n: f64::NEG_INFINITY,
        }
    }

    /// Takes the state added so far as that at rest.
    fn end_rest(&mut self) {
        self.rest_gap_m = self.least_gap_m.unwrap_or(f64::NAN);
    }

    fn add(&mut self, ends: &[WireLoad; 2], gap_m: Option<f64>) {
        if let Some(stress) = &mut self.stress {
            stress.add(ends);
        }
        if let Some(coil) = &self.spring.coil {
            let loads = ends.map(|end| section_load(&end));
            let by_loads = loads.iter().map(|load| coil.inner_gap_m(load)).reduce(f64::min);
            self.least_gap_m = [self.least_gap_m, gap_m.or(by_loads)].into_iter().flatten().reduce(f64::min);
            self.largest_axial_n = loads.iter().map(|load| load.axial_n).fold(self.largest_axial_n, f64::max);
        }
    }

    /// The stress cycle with the smallest margin, and that margin for any number of cycles; infinite if it is not known.
    fn worst_cycle(&self) -> Option<(StressCycle, f64)> {
        let cycle = self.stress.as_ref().and_then(StressRange::worst_cycle)?;
        let margin = self.spring.wire.and_then(|wire| wire.fatigue_margin(&cycle, f64::INFINITY));
        Some((cycle, margin.unwrap_or(f64::INFINITY)))
    }

    fn margins(&self) -> SpringMargins {
        let closed_m = self.least_gap_m.map(|gap_m| self.rest_gap_m - gap_m).filter(|closed_m| *closed_m > 0.0);
        let pressed = self.spring.coil.filter(|_| self.largest_axial_n > 0.0);
        let travel_n =
            |coil: Coil| (coil.free_length_m() - coil.solid_length_m()) * coil.axial_n_per_m() / self.largest_axial_n;
        let yield_pa = self.spring.wire.and_then(|wire| wire.yield_pa());
        let stress_pa = self.stress.as_ref().and_then(StressRange::largest_pa);
        SpringMargins {
            clash: closed_m.map(|closed_m| self.rest_gap_m / closed_m),
            gap_mm: self.least_gap_m.map(|gap_m| gap_m * 1e3),
            solid: pressed.map(travel_n),
            buckling: pressed.and_then(|coil| buckling_load_n(&coil)).map(|load_n| load_n / self.largest_axial_n),
            yielding: yield_pa.zip(stress_pa).map(|(yield_pa, stress_pa)| yield_pa / stress_pa),
            cycle: None,
        }
    }
}

/// The axial force and the bending moment of the load that the head exerts on a section.
fn section_load(load: &WireLoad) -> SectionLoad {
    SectionLoad { axial_n: -load.force.z, bending_nm: load.moment.xy().norm() }
}

#[cfg(test)]
mod tests {
    use super::super::{MISSION_HOURS, Shake, closed_form, simulated};
    use crate::coverage::CoveragePlan;
    use approx::assert_relative_eq;
    use zsim_base::spec::{Kind, find, parse};
    use zsim_dynamics::{ElementSpec, HeadModel, LinkageSpec, PlacementSpec, SpringElementSpec, load};
    use zsim_sensors::Lidar;

    fn utm30lx() -> Lidar {
        let source = find(Kind::Lidar, "utm30lx").unwrap();
        Lidar::new(&parse(&source).unwrap(), &source).unwrap()
    }

    #[test]
    fn the_margins_of_a_small_swing_follow_from_its_bending_moment() {
        // At its resonance the handheld head pitches by the gain times 0.1 degrees; its field of view is twice that. The
        // moment at the foot is that of the weight and of the inertia, which the elastic moment of the bent spring balances.
        let (spec, source) = load("handheld").unwrap();
        let shake = Shake { pitch_deg: 0.1, frequency_hz: None };
        let plan = CoveragePlan { from_s: 15.0, duration_s: 3.0, ..CoveragePlan::default() };
        let linear = closed_form(&spec, &source, &shake, MISSION_HOURS).unwrap();
        let (full, _) = simulated(&spec, &source, &shake, &utm30lx(), &plan, MISSION_HOURS).unwrap();
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

    #[test]
    fn the_springs_of_a_suspension_have_margins_as_a_single_one() {
        // A suspension of the handheld spring alone, whose loads are by the force law, and the handheld head, whose loads are by
        // weight and inertia.
        let (single, source) = load("handheld").unwrap();
        let mut suspended = single.clone();
        if let LinkageSpec::Spring {
            spring,
            segments,
            base_from_spring,
            head_from_spring,
            spring_mass,
            cable,
            damping_ratio,
            ..
        } = single.linkage.clone()
        {
            let head = HeadModel::new(&single, &source).unwrap();
            suspended.linkage = LinkageSpec::Suspension {
                elements: vec![ElementSpec::Spring(SpringElementSpec {
                    spring,
                    segments,
                    base_from_spring,
                    head_from_spring,
                    spring_mass,
                    cable,
                })],
                base_from_head: PlacementSpec {
                    position_m: head.base_from_head_at_rest().translation.vector.into(),
                    roll_pitch_yaw_deg: [0.0; 3],
                },
                damping_ratio,
                end_stop: None,
                hold: None,
            };
        }
        let shake = Shake { pitch_deg: 0.5, frequency_hz: None };
        let plan = CoveragePlan { from_s: 15.0, duration_s: 2.0, ..CoveragePlan::default() };
        let margins = |spec| simulated(spec, &source, &shake, &utm30lx(), &plan, MISSION_HOURS).unwrap().0;
        let (one, several) = (margins(&single), margins(&suspended));
        let pairs = [
            (one.margins.gap_mm, several.margins.gap_mm),
            (one.margins.clash, several.margins.clash),
            (one.margins.solid, several.margins.solid),
            (one.margins.buckling, several.margins.buckling),
            (one.margins.yielding, several.margins.yielding),
            (one.fatigue_margin, several.fatigue_margin),
            (one.spring_mass_g, several.spring_mass_g),
        ];
        for (a, b) in pairs {
            assert_relative_eq!(a.unwrap(), b.unwrap(), max_relative = 0.03);
        }
    }
}
