//! Walking along a route: a way with rounded corners, and the heading that goes with it.

use super::MotionError;
use super::smooth::{PEAK, Steps, Way};
use crate::geometry::{Route, Vector};
use crate::spec::{Source, SpecError};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// How a walker follows a route.
///
/// The walk is the route at piecewise constant speed, convolved with a bump in time ([`super`]): corners are cut by at
/// most `0.137 smoothing_s |change of velocity|`, and the speed never exceeds `speed_m_per_s`. At the end of an open
/// route the walker turns round and goes back; a closed one is walked round and round.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WalkSpec {
    /// Speed on the straight, m/s.
    #[serde(with = "crate::spec::checked::Positive")]
    pub speed_m_per_s: f64,
    /// Speed about a corner of 90 degrees or more, m/s; about a smaller one in proportion nearer to the full speed.
    #[serde(with = "crate::spec::checked::Positive")]
    pub corner_speed_m_per_s: f64,
    /// How far before and after a corner the walker is slow, m.
    #[serde(with = "crate::spec::checked::NonNegative")]
    pub corner_reach_m: f64,
    /// Half-width of the bump that rounds the walk, s.
    #[serde(with = "crate::spec::checked::Positive")]
    pub smoothing_s: f64,
    /// Least half-width of a turn of the body, s.
    #[serde(with = "crate::spec::checked::Positive")]
    pub turn_s: f64,
    /// Greatest rate of a turn, degrees/s: greater turns take longer.
    #[serde(with = "crate::spec::checked::Positive")]
    pub turn_rate_deg_per_s: f64,
    /// How much later than the walk the body turns, s.
    #[serde(with = "crate::spec::checked::Finite")]
    pub turn_lag_s: f64,
}

/// Where a walker is, and which way they face.
#[derive(Debug, Clone)]
pub(super) struct Walk {
    /// The point on the floor.
    pub way: Way,
    /// The heading, rad, unwrapped.
    pub heading: Steps,
    /// The speed as a share of the full one.
    pub speed_share: Steps,
}

/// Most pieces of a way that are kept: 10 hours round a small room.
const MOST_KNOTS: usize = 1 << 18;

/// Two points of a route nearer than this are one.
const SAME_PLACE_M: f64 = 1e-3;

impl WalkSpec {
    /// Checks what concerns several fields.
    pub(super) fn check(&self, source: &Source) -> Result<(), SpecError> {
        if self.corner_speed_m_per_s > self.speed_m_per_s {
            let message = format!(
                "corners are walked at {} m/s, faster than the straight at {} m/s",
                self.corner_speed_m_per_s, self.speed_m_per_s
            );
            return Err(SpecError::about(source, "corner_speed_m_per_s", message));
        }
        Ok(())
    }

    /// The walk along `route` from `from_s` until `until_s` at least.
    pub(super) fn along(&self, route: &Route, from_s: f64, until_s: f64) -> Result<Walk, MotionError> {
        check_route(route, self.speed_m_per_s * self.smoothing_s)?;
        let mut walker = Walker::new(self, route, from_s);
        let order = visits(route.points_in_world.len(), route.closed);
        for (next, after) in order {
            walker.go(route.points_in_world[next], route.points_in_world[after]);
            if walker.way.end_s() > until_s + self.smoothing_s {
                break;
            }
            if walker.way.knots() > MOST_KNOTS {
                return Err(MotionError::TooLong { duration_s: until_s, most: MOST_KNOTS });
            }
        }
        let speed_share = walker.way.speed_share(self.speed_m_per_s);
        Ok(Walk { way: walker.way, heading: walker.heading, speed_share })
    }

    /// The speed about a corner that turns by `angle` rad.
    fn corner_speed(&self, angle: f64) -> f64 {
        let share = (angle / FRAC_PI_2).min(1.0);
        self.speed_m_per_s + (self.corner_speed_m_per_s - self.speed_m_per_s) * share
    }

    /// Half-width of a turn by `angle` rad, s.
    fn turn_half_s(&self, angle: f64) -> f64 {
        self.turn_s.max(PEAK * angle.abs() / self.turn_rate_deg_per_s.to_radians())
    }
}

/// The points that a walker who stands on point 0 visits, each with the one after it, for ever: round a closed route,
/// to and fro on an open one.
fn visits(points: usize, closed: bool) -> impl Iterator<Item = (usize, usize)> {
    let period = if closed { points } else { 2 * (points - 1) };
    let point = move |visit: usize| {
        let k = visit % period;
        if k < points { k } else { period - k }
    };
    (1..).map(move |visit| (point(visit), point(visit + 1)))
}

/// Checks that a route can be followed: `shortest_m` and more of it, no point twice in a row.
fn check_route(route: &Route, shortest_m: f64) -> Result<(), MotionError> {
    let points = &route.points_in_world;
    if points.len() < if route.closed { 3 } else { 2 } {
        return Err(MotionError::RouteTooFew { points: points.len() });
    }
    if let Some(index) = points.iter().position(|point| !point.iter().all(|x| x.is_finite())) {
        return Err(MotionError::RouteNotFinite { index });
    }
    let legs = if route.closed { points.len() } else { points.len() - 1 };
    let mut length_m = 0.0;
    for first in 0..legs {
        let second = (first + 1) % points.len();
        let gap_m = (points[second] - points[first]).norm();
        if gap_m < SAME_PLACE_M {
            return Err(MotionError::RouteRepeats { first, second, gap_m });
        }
        length_m += gap_m;
    }
    if length_m < shortest_m {
        return Err(MotionError::RouteTooShort { length_m, needed_m: shortest_m });
    }
    Ok(())
}

/// Someone half-way through a walk.
struct Walker<'a> {
    spec: &'a WalkSpec,
    way: Way,
    heading: Steps,
    /// Speed about the corner where the walker stands.
    corner_m_per_s: f64,
    turns: usize,
}

impl<'a> Walker<'a> {
    fn new(spec: &'a WalkSpec, route: &Route, from_s: f64) -> Self {
        let start = route.points_in_world[0];
        let ways = route.points_in_world.iter().map(|point| point - start);
        let heading = ways.filter_map(|way| heading_of(&way)).next().unwrap_or(0.0);
        Self {
            spec,
            way: Way::new(start, from_s + spec.smoothing_s, spec.smoothing_s),
            heading: Steps::from_level(heading),
            corner_m_per_s: spec.speed_m_per_s,
            turns: 0,
        }
    }

    /// Walks to `next`, and turns there towards `after`.
    fn go(&mut self, next: Vector, after: Vector) {
        let start = self.way.end();
        let (leg, leaving) = (next - start, after - next);
        let angle = leg.angle(&leaving);
        let turns_round = angle > PI - 1e-6;
        let ahead_m_per_s = if turns_round { self.spec.speed_m_per_s } else { self.spec.corner_speed(angle) };

        let length_m = leg.norm();
        let slow_m = self.spec.corner_reach_m.min(length_m / 2.0);
        let fast_m = length_m - 2.0 * slow_m;
        if slow_m > 0.0 {
            self.way.go(start + leg * (slow_m / length_m), slow_m / self.corner_m_per_s);
        }
        if fast_m > 1e-9 {
            self.way.go(start + leg * ((length_m - slow_m) / length_m), fast_m / self.spec.speed_m_per_s);
        }
        if slow_m > 0.0 {
            self.way.go(next, slow_m / ahead_m_per_s);
        }
        self.corner_m_per_s = ahead_m_per_s;
        if turns_round { self.turn_round() } else { self.turn_to(&leaving) }
    }

    /// Turns about on the spot, to the left and to the right by turns.
    fn turn_round(&mut self) {
        let half_s = self.spec.turn_half_s(PI);
        let middle_s = self.way.end_s() + half_s / 2.0 + self.spec.turn_lag_s;
        self.way.go(self.way.end(), half_s);
        self.heading.push(middle_s, half_s, if self.turns.is_multiple_of(2) { PI } else { -PI });
        self.turns += 1;
    }

    /// Turns the body towards `leaving`, the shorter way; a leg straight up or down keeps the heading.
    fn turn_to(&mut self, leaving: &Vector) {
        let Some(new) = heading_of(leaving) else { return };
        let change = (new - self.heading.last() + PI).rem_euclid(TAU) - PI;
        if change != 0.0 {
            self.heading.push(self.way.end_s() + self.spec.turn_lag_s, self.spec.turn_half_s(change), change);
        }
    }
}

/// The heading of a direction, rad; `None` for straight up or down.
fn heading_of(way: &Vector) -> Option<f64> {
    (way.xy().norm() > 1e-6).then(|| way.y.atan2(way.x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_open_route_is_walked_to_and_fro_and_a_closed_one_round() {
        let first = |points, closed| visits(points, closed).take(5).map(|(next, _)| next).collect::<Vec<_>>();
        assert_eq!(first(3, false), [1, 2, 1, 0, 1]);
        assert_eq!(first(2, false), [1, 0, 1, 0, 1]);
        assert_eq!(first(3, true), [1, 2, 0, 1, 2]);
        assert_eq!(visits(3, false).nth(1), Some((2, 1)));
    }
}
