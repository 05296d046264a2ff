//! Checks whether routes can be walked: free of surfaces, above a floor, within the scene.

use super::{Ray, World};
use zsim_base::geometry::{Route, Vector};

/// Height above the route at which a surface blocks it, m: below tables and lintels there is room for a carrier.
const CARRIER_HEIGHT_M: f64 = 1.0;
/// Maximum distance of the floor below a route, m.
const MAX_DROP_M: f64 = 1.0;
/// Distance between two points at which the floor is searched, m.
const STEP_M: f64 = 0.5;
/// Maximum number of legs, and of searches for the floor, of a route: bounds the time.
const MAX_CASTS: usize = 20_000;

impl World {
    /// Warnings about routes that cannot be walked, one sentence each, with the first position: a surface 1 m above the route
    /// (movers, plants and canopies do not count), no floor within 1 m below it, or a point outside the scene.
    pub fn route_warnings(&self) -> Vec<String> {
        self.routes().iter().flat_map(|(name, route)| self.warnings_of(name, route)).collect()
    }

    fn warnings_of(&self, name: &str, route: &Route) -> Vec<String> {
        let points = &route.points_in_world;
        let closing = route.closed.then(|| (points[points.len() - 1], points[0]));
        let legs: Vec<(Vector, Vector)> = points.windows(2).map(|pair| (pair[0], pair[1])).chain(closing).collect();
        let mut warnings = Vec::new();
        let blocked: Vec<_> =
            legs.iter().take(MAX_CASTS).enumerate().filter_map(|(k, leg)| Some((k, self.obstacle(leg)?))).collect();
        if let Some((k, (place, material))) = blocked.first() {
            let (from, to) = (k + 1, (k + 1) % points.len() + 1);
            warnings.push(format!(
                "the route `{name}` passes through `{material}` at {}, between its points {from} and {to}{}",
                written(place),
                more(blocked.len() - 1, "leg")
            ));
        }
        let length_m: f64 = legs.iter().map(|(from, to)| (to - from).norm()).sum();
        let step_m = STEP_M.max(length_m / MAX_CASTS as f64);
        let along = legs.iter().flat_map(|leg| points_along(leg, step_m)).take(2 * MAX_CASTS);
        let missing: Vec<Vector> = along.filter(|place| !self.has_floor(place)).collect();
        let (lower, upper) = self.bounds();
        let is_outside = |place: &&Vector| (0..2).any(|axis| place[axis] < lower[axis] || place[axis] > upper[axis]);
        if let Some(place) = missing.iter().find(is_outside) {
            warnings.push(format!("the route `{name}` leaves the scene at {}", written(place)));
        } else if let Some(place) = missing.first() {
            let part_m = missing.len() as f64 * step_m;
            warnings.push(format!(
                "the route `{name}` has no floor within {MAX_DROP_M} m below it at {}, and for {:.1} m of its {length_m:.1} m",
                written(place),
                part_m.min(length_m)
            ));
        }
        warnings
    }

    /// The first surface on a leg at the height of a carrier: position and material.
    fn obstacle(&self, (from, to): &(Vector, Vector)) -> Option<(Vector, &str)> {
        let up = Vector::z() * CARRIER_HEIGHT_M;
        let ray = Ray { origin_in_world: from + up, direction_in_world: (to - from).try_normalize(0.0)? };
        let hit = self.cast_static(&ray, (to - from).norm())?;
        Some((ray.at(hit.distance_m), &self.material(hit.material).name))
    }

    fn has_floor(&self, place: &Vector) -> bool {
        let ray = Ray { origin_in_world: place + Vector::z() * CARRIER_HEIGHT_M, direction_in_world: -Vector::z() };
        self.cast_static(&ray, CARRIER_HEIGHT_M + MAX_DROP_M).is_some()
    }
}

/// Returns points along a leg, the start included and the end not.
fn points_along((from, to): &(Vector, Vector), step_m: f64) -> impl Iterator<Item = Vector> + use<> {
    let (from, leg) = (*from, to - from);
    let count = (leg.norm() / step_m).ceil().max(1.0);
    (0..count as usize).map(move |k| from + leg * (k as f64 / count))
}

fn written(place: &Vector) -> String {
    format!("({:.2}, {:.2}, {:.2}) m", place.x, place.y, place.z)
}

/// How many others there are, in words.
fn more(count: usize, noun: &str) -> String {
    match count {
        0 => String::new(),
        1 => format!(", and on 1 other {noun}"),
        _ => format!(", and on {count} other {noun}s"),
    }
}
