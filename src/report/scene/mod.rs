//! Views of a scene: a page with its surfaces in three dimensions, and a floor plan with an elevation.

mod plan;

pub use plan::{DEFAULT_CUT_M, plan};

use crate::Table;
use crate::page::table::named_values;
use crate::page::{TimedPose, Triangle, View, area_m2, encode, html, largest, scripts, stage};
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
/// When the plan cannot be drawn.
pub fn page(world: &World) -> Result<String, PlotError> {
    let all: Vec<(Triangle, MaterialId)> = world.triangles().chain(world.moving_triangles(0.0)).collect();
    let sections = format!(
        "{}<section id=\"plan\"><h2>Floor plan and elevation</h2>\n{}</section>\n\
         <section id=\"properties\"><h2>Contents</h2>\n<div class=\"tables\">\n{}{}</div></section>\n",
        stage::view_section("Surfaces and route", "route", "route"),
        plan(world, DEFAULT_CUT_M).svg()?,
        named_values("scene", &properties(world, all.len()).rows),
        named_values("materials", &materials(world, &all).rows),
    );
    let page = html::Page {
        kind: "scene",
        title: world.name(),
        without_scripts: "The three-dimensional view needs scripts; the floor plan below does not.",
        sections,
        data: encode::inert(&view(world, all).json().to_string()),
        scripts: &scripts::VIEW,
        ..html::Page::default()
    };
    Ok(page.html())
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

/// The materials in use with their areas, the largest first.
fn materials(world: &World, triangles: &[(Triangle, MaterialId)]) -> Table {
    let mut areas_m2 = vec![0.0; world.materials().len()];
    triangles.iter().for_each(|(triangle, material)| areas_m2[material.index()] += area_m2(triangle));
    let mut used: Vec<_> = world.materials().iter().zip(areas_m2).filter(|(_, area_m2)| *area_m2 > 0.0).collect();
    used.sort_by(|a, b| b.1.total_cmp(&a.1));
    Table::facts(used.into_iter().map(|(material, area_m2)| {
        let through = material.transmission;
        let transmission = if through > 0.0 { format!(", transmits {through:.2}") } else { String::new() };
        (&*material.name, format!("reflectance {:.2}{transmission}, {area_m2:.0} m\u{b2}", material.reflectance))
    }))
}

fn properties(world: &World, triangles: usize) -> Table {
    let (lower, upper) = world.bounds();
    let size = upper - lower;
    let mut rows = vec![
        ("size in x, y, z".to_owned(), format!("{:.1} x {:.1} x {:.1} m", size.x, size.y, size.z)),
        ("triangles".to_owned(), triangles.to_string()),
    ];
    for (name, route) in world.routes() {
        let length_m = walk(route).last().map_or(0.0, |last| last.t_s * WALK_M_PER_S);
        let kind = if route.closed { "closed" } else { "open" };
        rows.push((format!("route {name}"), format!("{length_m:.1} m, {kind}")));
    }
    Table::facts(rows)
}
