//! A base at constant velocity.

use super::BaseMotion;
use super::jet::PoseJet;
use super::stand::start_on_route;
use serde::{Deserialize, Serialize};
use zsim_base::geometry::{Kinematics, Route, Vector};

/// A base at constant velocity from the start of the run.
///
/// It starts at the first point of the route and keeps the heading there, straight on past corners: the scene must be
/// long enough.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CruiseSpec {
    /// Height of the base above the floor, m.
    #[serde(with = "zsim_base::spec::checked::Finite")]
    pub height_m: f64,
    /// Speed, m/s.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub speed_m_per_s: f64,
}

/// A base that cruises.
pub(super) struct Cruise {
    start: Kinematics,
    velocity_in_world: Vector,
}

impl Cruise {
    pub fn new(spec: &CruiseSpec, route: Option<&Route>) -> Self {
        let (floor, heading) = start_on_route(route);
        let start = PoseJet::at_rest(&(floor + Vector::z() * spec.height_m), heading).kinematics();
        Self { start, velocity_in_world: Vector::new(heading.cos(), heading.sin(), 0.0) * spec.speed_m_per_s }
    }
}

impl BaseMotion for Cruise {
    fn at(&self, t_s: f64) -> Kinematics {
        let mut now = Kinematics { velocity_in_world: self.velocity_in_world, ..self.start };
        now.world_from_body.translation.vector += self.velocity_in_world * t_s;
        now
    }
}
