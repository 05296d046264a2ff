//! Settings of the flight.

use super::super::walk::WalkSpec;
use super::rotors::RotorSpec;
use serde::Deserialize;
use serde::Serialize;
use zsim_base::spec::checked::NonNegative;
use zsim_base::spec::checked::Positive;

/// A small multirotor that carries the base.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UavSpec {
    /// Time at rest at the start, s.
    #[serde(default = "crate::usual::still_s", with = "NonNegative")]
    pub still_s: f64,
    /// Time in which gusts and vibration rise to their full amplitude, s.
    #[serde(default = "crate::usual::onset_s", with = "Positive")]
    pub onset_s: f64,
    /// Height of the base above the floor of the route, m.
    #[serde(with = "Positive")]
    pub height_m: f64,
    /// How the craft follows the route.
    pub follow: WalkSpec,
    /// The wind.
    pub gust: GustSpec,
    /// Natural frequency of the position control, Hz. A higher value reduces the response to gusts.
    #[serde(with = "Positive")]
    pub hold_hz: f64,
    /// Damping ratio of the position control.
    #[serde(with = "Positive")]
    pub hold_damping: f64,
    /// Drag: acceleration per m/s of relative wind, 1/s.
    #[serde(with = "NonNegative")]
    pub drag_per_s: f64,
    /// The rotors.
    pub rotors: RotorSpec,
}

/// Wind with Dryden gusts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GustSpec {
    /// Mean wind at 6 m (20 feet) above the ground, m/s; gusts scale with it. Light turbulence: 7.7, moderate: 15.4.
    #[serde(with = "NonNegative")]
    pub wind_m_per_s: f64,
    /// Airspeed of the craft, m/s. A higher airspeed shifts gusts to higher frequencies.
    #[serde(with = "Positive")]
    pub airspeed_m_per_s: f64,
}
