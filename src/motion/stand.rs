//! A base that stands still.

use super::BaseMotion;
use super::jet::PoseJet;
use crate::geometry::{Kinematics, Route, Vector};
use serde::{Deserialize, Serialize};

/// A base that stands still where the route begins, facing along it; without a route at the world's origin, facing x.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StandSpec {
    /// Height of the base above the floor, m.
    #[serde(with = "crate::spec::checked::Finite")]
    pub height_m: f64,
}

/// Where a carrier that follows no route stands: the route's first point and its heading there, or the origin.
pub(super) fn standpoint(route: Option<&Route>) -> (Vector, f64) {
    let points = route.map_or(&[][..], |route| &route.points_in_world);
    let start = points.first().copied().unwrap_or_else(Vector::zeros);
    let ahead = points.iter().map(|point| point - start).find(|way| way.xy().norm() > 1e-6);
    (start, ahead.map_or(0.0, |way| way.y.atan2(way.x)))
}

/// A base at rest.
pub(super) struct Stand(Kinematics);

impl Stand {
    pub fn new(spec: &StandSpec, route: Option<&Route>) -> Self {
        let (floor, heading) = standpoint(route);
        Self(PoseJet::at_rest(&(floor + Vector::z() * spec.height_m), heading).kinematics())
    }
}

impl BaseMotion for Stand {
    fn at(&self, _t_s: f64) -> Kinematics {
        self.0
    }
}
