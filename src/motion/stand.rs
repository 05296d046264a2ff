//! A stationary base.

use super::BaseMotion;
use super::jet::PoseJet;
use serde::{Deserialize, Serialize};
use zsim_base::geometry::{Kinematics, Route, Vector};

/// A stationary base at the start of the route, facing along it; without a route, at the origin of the world, facing x.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StandSpec {
    /// Height of the base above the floor, m.
    #[serde(with = "zsim_base::spec::checked::Finite")]
    pub height_m: f64,
}

/// Position and heading, rad, at the start of the route; without a route, the origin and 0.
pub(super) fn start_on_route(route: Option<&Route>) -> (Vector, f64) {
    let points = route.map_or(&[][..], |route| &route.points_in_world);
    let start = points.first().copied().unwrap_or_else(Vector::zeros);
    let ahead = points.iter().map(|point| point - start).find(|offset| offset.xy().norm() > 1e-6);
    (start, ahead.map_or(0.0, |offset| offset.y.atan2(offset.x)))
}

/// A base at rest.
pub(super) struct Stand(Kinematics);

impl Stand {
    pub fn new(spec: &StandSpec, route: Option<&Route>) -> Self {
        let (floor, heading) = start_on_route(route);
        Self(PoseJet::at_rest(&(floor + Vector::z() * spec.height_m), heading).kinematics())
    }
}

impl BaseMotion for Stand {
    fn at(&self, _t_s: f64) -> Kinematics {
        self.0
    }
}
