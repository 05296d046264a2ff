//! Following a route: a path with rounded corners, and the heading along it.

use super::MotionError;
use super::smooth::{PEAK, SmoothPath, SmoothSteps};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use zsim_base::geometry::{Route, Vector};
use zsim_base::spec::{Source, SpecError};

/// How a walker or a vehicle follows a route.
///
/// The motion is the route at piecewise constant speed, convolved in time with a smoothing kernel. Corners are cut by
/// at most `0.137 smoothing_s |change of velocity|`, and the speed never exceeds `speed_m_per_s`. At the end of an open
/// route the walker turns round and goes back; a closed route is repeated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WalkSpec {
    /// Speed on straight legs, m/s.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub speed_m_per_s: f64,
    /// Speed at a corner of 90 degrees or more, m/s; 60 % of the speed on straight legs by default. At a smaller corner the
    /// speed is interpolated linearly in the angle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub corner_speed_m_per_s: Option<Speed>,
    /// Distance before and after a corner over which the speed is reduced, m.
    #[serde(default = "crate::usual::corner_reach_m", with = "zsim_base::spec::checked::NonNegative")]
    pub corner_reach_m: f64,
    /// Half-width of the smoothing kernel, s. A larger value cuts corners more and accelerates more gently.
    #[serde(default = "crate::usual::smoothing_s", with = "zsim_base::spec::checked::Positive")]
    pub smoothing_s: f64,
    /// Minimum half-width of a turn in heading, s.
    #[serde(default = "crate::usual::turn_s", with = "zsim_base::spec::checked::Positive")]
    pub turn_s: f64,
    /// Maximum turn rate, degrees/s. A larger turn takes longer.
    #[serde(default = "crate::usual::turn_rate_deg_per_s", with = "zsim_base::spec::checked::Positive")]
    pub turn_rate_deg_per_s: f64,
    /// Delay of the turn in heading after the turn of the path, s.
    #[serde(default = "crate::usual::turn_lag_s", with = "zsim_base::spec::checked::Finite")]
    pub turn_lag_s: f64,
}

/// A speed above zero, m/s.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(transparent)]
pub struct Speed(#[serde(with = "zsim_base::spec::checked::Positive")] pub f64);

/// Motion along a route: position, heading and speed.
#[derive(Debug, Clone)]
pub(super) struct RouteMotion {
    /// Position on the floor, m.
    pub path: SmoothPath,
    /// Heading, rad, unwrapped.
    pub heading: SmoothSteps,
    /// Speed as a fraction of the full speed.
    pub speed_fraction: SmoothSteps,
}

/// Maximum number of path segments: 10 hours of walking round a small room.
const MAX_KNOTS: usize = 1 << 18;

/// Speed at a corner over that on straight legs, where a spec has none.
const USUAL_CORNER_SPEED: f64 = 0.6;

/// Two points of a route closer than this coincide, m: a leg of 1 mm has no useful direction.
const SAME_POINT_M: f64 = 1e-3;

impl WalkSpec {
    /// Checks the relations between fields.
    pub(super) fn check(&self, source: &Source) -> Result<(), SpecError> {
        if self.right_angle_speed() > self.speed_m_per_s {
            let message = format!(
                "corners are walked at {} m/s, faster than the straight at {} m/s",
                self.right_angle_speed(),
                self.speed_m_per_s
            );
            return Err(SpecError::about(source, "corner_speed_m_per_s", message));
        }
        Ok(())
    }

    /// Speed at a corner of 90 degrees or more, m/s.
    fn right_angle_speed(&self) -> f64 {
        self.corner_speed_m_per_s.map_or(USUAL_CORNER_SPEED * self.speed_m_per_s, |speed| speed.0)
    }

    /// The motion along `route` from `from_s` until at least `until_s`.
    pub(super) fn along(&self, route: &Route, from_s: f64, until_s: f64) -> Result<RouteMotion, MotionError> {
        check_route(route, self.speed_m_per_s * self.smoothing_s)?;
        let mut walker = Walker::new(self, route, from_s);
        let order = visit_order(route.points_in_world.len(), route.closed);
        for (next, after) in order {
            walker.walk_to(route.points_in_world[next], route.points_in_world[after]);
            if walker.path.end_s() > until_s + self.smoothing_s {
                break;
            }
            if walker.path.knots() > MAX_KNOTS {
                return Err(MotionError::TooLong { duration_s: until_s, max: MAX_KNOTS });
            }
        }
        let speed_fraction = walker.path.speed_fraction(self.speed_m_per_s);
        Ok(RouteMotion { path: walker.path, heading: walker.heading, speed_fraction })
    }

    /// Speed at a corner that turns by `angle` rad, m/s.
    fn corner_speed(&self, angle: f64) -> f64 {
        let fraction = (angle / FRAC_PI_2).min(1.0);
        self.speed_m_per_s + (self.right_angle_speed() - self.speed_m_per_s) * fraction
    }

    /// Half-width of a turn by `angle` rad, s.
    fn turn_half_s(&self, angle: f64) -> f64 {
        self.turn_s.max(PEAK * angle.abs() / self.turn_rate_deg_per_s.to_radians())
    }
}

/// Pairs (point, following point) in the order of visit, without end, for a walker that starts at point 0: round a
/// closed route, back and forth on an open one.
fn visit_order(points: usize, closed: bool) -> impl Iterator<Item = (usize, usize)> {
    let period = if closed { points } else { 2 * (points - 1) };
    let point = move |visit: usize| {
        let k = visit % period;
        if k < points { k } else { period - k }
    };
    (1..).map(move |visit| (point(visit), point(visit + 1)))
}

/// Checks that a route is at least `shortest_m` long, and that no two successive points coincide.
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
        if gap_m < SAME_POINT_M {
            return Err(MotionError::RouteRepeats { first, second, gap_m });
        }
        length_m += gap_m;
    }
    if length_m < shortest_m {
        return Err(MotionError::RouteTooShort { length_m, needed_m: shortest_m });
    }
    Ok(())
}

/// A walk under construction.
struct Walker<'a> {
    spec: &'a WalkSpec,
    path: SmoothPath,
    heading: SmoothSteps,
    /// Speed at the corner at which the walker is, m/s.
    corner_m_per_s: f64,
    turns: usize,
}

impl<'a> Walker<'a> {
    fn new(spec: &'a WalkSpec, route: &Route, from_s: f64) -> Self {
        let start = route.points_in_world[0];
        let offsets = route.points_in_world.iter().map(|point| point - start);
        let heading = offsets.filter_map(|offset| heading_of(&offset)).next().unwrap_or(0.0);
        Self {
            spec,
            path: SmoothPath::new(start, from_s + spec.smoothing_s, spec.smoothing_s),
            heading: SmoothSteps::from_level(heading),
            corner_m_per_s: spec.speed_m_per_s,
            turns: 0,
        }
    }

    /// Adds the leg to `next`, and the turn there towards `after`.
    fn walk_to(&mut self, next: Vector, after: Vector) {
        let start = self.path.end();
        let (leg, leaving) = (next - start, after - next);
        let angle = leg.angle(&leaving);
        let turns_round = angle > PI - 1e-6;
        let ahead_m_per_s = if turns_round { self.spec.speed_m_per_s } else { self.spec.corner_speed(angle) };

        let length_m = leg.norm();
        let slow_m = self.spec.corner_reach_m.min(length_m / 2.0);
        let fast_m = length_m - 2.0 * slow_m;
        if slow_m > 0.0 {
            self.path.move_to(start + leg * (slow_m / length_m), slow_m / self.corner_m_per_s);
        }
        if fast_m > 1e-9 {
            self.path.move_to(start + leg * ((length_m - slow_m) / length_m), fast_m / self.spec.speed_m_per_s);
        }
        if slow_m > 0.0 {
            self.path.move_to(next, slow_m / ahead_m_per_s);
        }
        self.corner_m_per_s = ahead_m_per_s;
        if turns_round { self.turn_round() } else { self.turn_to(&leaving) }
    }

    /// Adds a turn by 180 degrees on the spot, alternately to the left and to the right.
    fn turn_round(&mut self) {
        let half_s = self.spec.turn_half_s(PI);
        let middle_s = self.path.end_s() + half_s / 2.0 + self.spec.turn_lag_s;
        self.path.move_to(self.path.end(), half_s);
        self.heading.push(middle_s, half_s, if self.turns.is_multiple_of(2) { PI } else { -PI });
        self.turns += 1;
    }

    /// Adds a turn of the heading towards `leaving` through the smaller angle. A vertical leg keeps the heading.
    fn turn_to(&mut self, leaving: &Vector) {
        let Some(new) = heading_of(leaving) else { return };
        let change = (new - self.heading.last() + PI).rem_euclid(TAU) - PI;
        if change != 0.0 {
            self.heading.push(self.path.end_s() + self.spec.turn_lag_s, self.spec.turn_half_s(change), change);
        }
    }
}

/// Heading of a direction, rad; `None` for a vertical one.
fn heading_of(direction: &Vector) -> Option<f64> {
    (direction.xy().norm() > 1e-6).then(|| direction.y.atan2(direction.x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_open_route_is_walked_back_and_forth_and_a_closed_one_round() {
        let first = |points, closed| visit_order(points, closed).take(5).map(|(next, _)| next).collect::<Vec<_>>();
        assert_eq!(first(3, false), [1, 2, 1, 0, 1]);
        assert_eq!(first(2, false), [1, 0, 1, 0, 1]);
        assert_eq!(first(3, true), [1, 2, 0, 1, 2]);
        assert_eq!(visit_order(3, false).nth(1), Some((2, 1)));
    }
}
