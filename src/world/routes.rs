//! Routes of a scene.

use super::error::unknown_name;
use super::{RouteSpec, SceneSpec};
use std::collections::BTreeMap;
use zsim_base::geometry::{Route, Vector};
use zsim_base::spec::checked::MAX_LENGTH_M;
use zsim_base::spec::{Source, SpecError};

/// The routes of a scene, checked, by name.
pub(super) fn routes(spec: &SceneSpec, source: &Source) -> Result<BTreeMap<String, Route>, SpecError> {
    for (name, route) in &spec.routes {
        let count = route.points_m.len();
        if count < 2 {
            let message = format!("the route `{name}` has {count} points; it needs at least 2");
            return Err(SpecError::about(source, name, message));
        }
        if !route.points_m.iter().flatten().all(|x| x.abs() <= MAX_LENGTH_M) {
            let message = format!("the route `{name}` has a point that is not within 100 km of the origin");
            return Err(SpecError::about(source, name, message));
        }
        if route.points_m.windows(2).any(|pair| pair[0] == pair[1]) {
            let message = format!("the route `{name}` has the same point twice in a row");
            return Err(SpecError::about(source, name, message).with_help("to make a walker rest, use the motion"));
        }
    }
    if let Some(name) = &spec.default_route
        && !spec.routes.contains_key(name)
    {
        return Err(unknown_name(source, "route", name, spec.routes.keys()));
    }
    let route = |(name, route): (&String, &RouteSpec)| {
        let points_in_world = route.points_m.iter().map(|point| Vector::from(*point)).collect();
        (name.clone(), Route { points_in_world, closed: route.closed })
    };
    Ok(spec.routes.iter().map(route).collect())
}
