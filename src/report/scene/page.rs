//! The page of a scene.

use super::plan::{DEFAULT_CUT_M, plan};
use crate::page::{MaterialRow, NamedValue, ScenePage, TimedPose, Triangle, View, area_m2, largest};
use crate::plot::PlotError;
use zsim_base::geometry::{Pose, Route, Vector};
use zsim_world::{MaterialId, World};

/// Speed along the route when the view plays it, m/s.
const WALK_M_PER_S: f64 = 1.0;
/// Height of the path above the route's floor, m: that of a head in a hand.
const HEAD_HEIGHT_M: f64 = 1.0;

/// The page of a scene as HTML; movers are where they are at the start of a run.
///
/// # Errors
/// When the plan cannot be drawn, or a value cannot be written as JSON.
pub fn page(world: &World) -> Result<String, PlotError> {
    let all: Vec<(Triangle, MaterialId)> = world.triangles().chain(world.moving_triangles(0.0)).collect();
    let page = ScenePage {
        name: world.name(),
        properties: properties(world, all.len()),
        materials: materials(world, &all),
        plan: plan(world, DEFAULT_CUT_M),
        view: view(world, all),
    };
    page.html()
}

fn view(world: &World, triangles: Vec<(Triangle, MaterialId)>) -> View {
    let (shown, surfaces_are_partial) = largest(triangles);
    let (surfaces, surface_materials) =
        shown.into_iter().map(|(triangle, material)| (triangle, material.index())).unzip();
    View {
        materials: world.materials().iter().map(|material| material.name.clone()).collect(),
        estimate: world.default_route().map(walk).unwrap_or_default(),
        surfaces,
        surface_materials,
        surfaces_are_partial,
        ..View::default()
    }
}

/// The corners of a route with the times of a steady walk.
fn walk(route: &Route) -> Vec<TimedPose> {
    let corners = route.points_in_world.iter().chain(route.closed.then(|| &route.points_in_world[0]));
    let mut before: Option<(f64, Vector)> = None;
    corners
        .map(|corner| {
            let t_s = before.map_or(0.0, |(t_s, last)| t_s + (corner - last).norm() / WALK_M_PER_S);
            before = Some((t_s, *corner));
            TimedPose { t_s, pose: Pose::translation(corner.x, corner.y, corner.z + HEAD_HEIGHT_M) }
        })
        .collect()
}

/// The materials in use, the largest area first.
fn materials(world: &World, triangles: &[(Triangle, MaterialId)]) -> Vec<MaterialRow> {
    let mut rows: Vec<MaterialRow> = world
        .materials()
        .iter()
        .map(|material| MaterialRow {
            name: material.name.clone(),
            reflectance: material.reflectance,
            transmission: material.transmission,
            area_m2: 0.0,
        })
        .collect();
    triangles.iter().for_each(|(triangle, material)| rows[material.index()].area_m2 += area_m2(triangle));
    rows.retain(|row| row.area_m2 > 0.0);
    rows.sort_by(|a, b| b.area_m2.total_cmp(&a.area_m2));
    rows
}

fn properties(world: &World, triangles: usize) -> Vec<NamedValue> {
    let (lower, upper) = world.bounds();
    let size = upper - lower;
    let mut rows = vec![
        NamedValue::new("size in x, y, z", format!("{:.1} x {:.1} x {:.1} m", size.x, size.y, size.z)),
        NamedValue::new("triangles", triangles.to_string()),
    ];
    for (name, route) in world.routes() {
        let length_m = walk(route).last().map_or(0.0, |last| last.t_s * WALK_M_PER_S);
        let kind = if route.closed { "closed" } else { "open" };
        rows.push(NamedValue::new(format!("route {name}"), format!("{length_m:.1} m, {kind}")));
    }
    rows
}
