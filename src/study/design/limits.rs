//! Limits of springs that can be made, do not clash and last.

use serde::{Deserialize, Serialize};
use zsim_base::spec::checked;
use zsim_elasticity::{SpringDesign, SpringSpec};
use zsim_head::spring::{DesignMetrics, MISSION_HOURS, Wire};

/// Limits of a spring that can be ordered and lasts; each has a default.
///
/// A margin is what is available over what is needed, over the largest swing under the shake.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct BuildLimitsSpec {
    /// Spring index, mean coil diameter over wire diameter, minimum and maximum. Coils of 4 to 16 can be made
    /// without difficulty.
    #[serde(with = "checked::PositiveArray::<2>")]
    pub index: [f64; 2],
    /// Wire diameters for `space: coil(...)`. The springs of a catalogue can be ordered as they are.
    pub wires: WireStock,
    /// Gap between neighbouring coils at rest over its largest reduction on the inner side of the bend, minimum.
    #[serde(with = "checked::Positive")]
    pub clash_margin: f64,
    /// Smallest gap between neighbouring coils over that of EN 13906-1 (0.0015 D^2 / d + 0.1 d), minimum.
    #[serde(with = "checked::NonNegative")]
    pub gap_over_standard: f64,
    /// Travel to the solid length over the largest compression of the axis, minimum.
    #[serde(with = "checked::Positive")]
    pub solid_margin: f64,
    /// Mass that the spring supports over the mass of the head, minimum. A fixed foot and a free top: the
    /// head tips over.
    #[serde(with = "checked::Positive")]
    pub tipping_margin: f64,
    /// Buckling load over the largest axial load, minimum. A fixed foot and a guided top.
    #[serde(with = "checked::Positive")]
    pub buckling_margin: f64,
    /// Yield stress over the maximum stress (von Mises, with the curvature factors of Wahl), minimum.
    #[serde(with = "checked::Positive")]
    pub yield_margin: f64,
    /// Margin of the stress cycle by Goodman's line over the mission, minimum.
    #[serde(with = "checked::Positive")]
    pub fatigue_margin: f64,
    /// Duration of the mission, in which the head swings at the frequency of the shake, hours.
    #[serde(with = "checked::Positive")]
    pub mission_hours: f64,
}

/// Wire diameters that can be ordered.
#[derive(Debug, Clone, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum WireStock {
    /// The nominal diameters of EN 10270-1 from 0.5 to 10 mm.
    Standard,
    /// These diameters, mm.
    Diameters(Vec<f64>),
    /// Any diameter.
    Any,
}

/// Nominal wire diameters of EN 10270-1, mm.
const STANDARD_WIRES_MM: [f64; 52] = [
    0.50, 0.53, 0.56, 0.60, 0.63, 0.65, 0.70, 0.75, 0.80, 0.85, 0.90, 0.95, 1.00, 1.05, 1.10, 1.20, 1.25, 1.30, 1.40,
    1.50, 1.60, 1.70, 1.80, 1.90, 2.00, 2.10, 2.25, 2.40, 2.50, 2.60, 2.80, 3.00, 3.20, 3.40, 3.60, 3.80, 4.00, 4.25,
    4.50, 4.75, 5.00, 5.30, 5.60, 6.00, 6.30, 6.50, 7.00, 7.50, 8.00, 8.50, 9.00, 10.00,
];

/// A limit that a design violates.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Violation {
    /// Key of the limit in the brief, or the measure.
    pub limit: &'static str,
    /// Value of the design; `None` if it is not known.
    pub value: Option<f64>,
    /// Relative violation: 0.1 for a margin that is 10 % of the limit too small.
    pub excess: f64,
}

impl Violation {
    /// The violation with the largest excess.
    pub fn worst(violations: &[Violation]) -> Option<&Violation> {
        violations.iter().max_by(|a, b| a.excess.total_cmp(&b.excess))
    }
}

impl Default for BuildLimitsSpec {
    fn default() -> Self {
        Self {
            index: [4.0, 16.0],
            wires: WireStock::Standard,
            clash_margin: 1.2,
            gap_over_standard: 1.0,
            solid_margin: 1.15,
            tipping_margin: 1.2,
            buckling_margin: 2.0,
            yield_margin: 1.2,
            fatigue_margin: 1.2,
            mission_hours: MISSION_HOURS,
        }
    }
}

impl WireStock {
    /// The diameters between two bounds, mm; `None` if all are available.
    pub fn between(&self, [low_mm, high_mm]: [f64; 2]) -> Option<Vec<f64>> {
        let within = |wires: &[f64]| {
            let mut wires: Vec<f64> =
                wires.iter().copied().filter(|wire_mm| (low_mm..=high_mm).contains(wire_mm)).collect();
            wires.sort_by(f64::total_cmp);
            wires
        };
        match self {
            WireStock::Any => None,
            WireStock::Standard => Some(within(&STANDARD_WIRES_MM)),
            WireStock::Diameters(wires) => Some(within(wires)),
        }
    }
}

impl BuildLimitsSpec {
    /// The limits that a spring with these metrics violates, except the tipping margin.
    ///
    /// A margin that is not known is no violation; the design says so in `unchecked`.
    pub fn violations(&self, spring: &SpringSpec, metrics: &DesignMetrics) -> Vec<Violation> {
        let (Ok(Some(wire)), Ok(SpringDesign::Coil(coil))) = (Wire::of(spring), spring.design()) else {
            return Vec::new();
        };
        let margins = &metrics.margins;
        let gap_over_standard = margins.gap_mm.map(|gap_mm| 1e-3 * gap_mm / coil.standard_gap_m());
        let least = [
            ("index", Some(wire.index()), self.index[0]),
            ("clash_margin", margins.clash, self.clash_margin),
            ("gap_over_standard", gap_over_standard, self.gap_over_standard),
            ("solid_margin", margins.solid, self.solid_margin),
            ("buckling_margin", margins.buckling, self.buckling_margin),
            ("yield_margin", margins.yielding, self.yield_margin),
            ("fatigue_margin", metrics.fatigue_margin, self.fatigue_margin),
        ];
        let too_little = least.into_iter().filter_map(|(limit, value, least)| {
            let value = value.filter(|value| *value < least)?;
            Some(Violation { limit, value: Some(value), excess: ((least - value) / least).min(10.0) })
        });
        let most = self.index[1];
        let too_large = (wire.index() > most).then(|| Violation {
            limit: "index",
            value: Some(wire.index()),
            excess: wire.index() / most - 1.0,
        });
        too_little.chain(too_large).collect()
    }
}
