//! Floor plan and elevation of a scene.

use crate::plot::{Chart, Colour, Figure, Mark, Series};
use std::collections::BTreeMap;
use zsim_base::geometry::{Route, Vector};
use zsim_world::{SectionPlane, Segment, World};

/// Height of the cut above the route's floor, m, as of an architect's plan.
pub const DEFAULT_CUT_M: f64 = 1.2;
/// Maximum number of edges behind a cut; the longest are shown.
const MAX_EDGES: usize = 8_000;
/// Edges whose ends are drawn within this distance are one line, m.
const SAME_LINE_M: f64 = 0.01;
/// Widths of cut surfaces, of edges beyond them, and of the route, points.
const CUT_WIDTH: f64 = 1.4;
const EDGE_WIDTH: f64 = 0.5;
const ROUTE_WIDTH: f64 = 1.4;

/// A line of the drawing, m.
type Line = [(f64, f64); 2];

/// The floor plan, cut `cut_m` above the floor where the default route starts, and the elevation towards +y, cut at that
/// point.
pub fn plan(world: &World, cut_m: f64) -> Figure {
    let (lower, upper) = world.bounds();
    let middle = (lower + upper) / 2.0;
    let start =
        world.default_route().map_or(Vector::new(middle.x, middle.y, lower.z), |route| route.points_in_world[0]);
    let edges = world.edges();
    let horizontal = SectionPlane { point_in_world: start + cut_m * Vector::z(), normal_in_world: -Vector::z() };
    let vertical = SectionPlane { point_in_world: start, normal_in_world: Vector::y() };
    let title = format!("{}: floor plan, cut at z = {:.1} m", world.name(), horizontal.point_in_world.z);
    let floor_plan = Chart::new(&title, "x (m)", "y (m)");
    let title = format!("Elevation towards +y, cut at y = {:.1} m", start.y);
    let elevation = Chart::new(&title, "x (m)", "z (m)");
    Figure::of(vec![
        drawing(floor_plan, world, &edges, &horizontal, |point| (point.x, point.y)),
        drawing(elevation, world, &edges, &vertical, |point| (point.x, point.z)),
    ])
}

/// What a cut shows: the surfaces that it cuts, the edges behind it (on the side of its normal), and the route.
fn drawing(
    chart: Chart,
    world: &World,
    edges: &[Segment],
    cut: &SectionPlane,
    project: fn(&Vector) -> (f64, f64),
) -> Chart {
    let behind = edges.iter().filter(|edge| edge.iter().all(|end| cut.distance_m(end) >= 0.0));
    let outlines = outlines(behind.map(|edge| edge.map(|end| project(&end))));
    let section: Vec<Line> = world.section(cut).iter().map(|segment| segment.map(|end| project(&end))).collect();
    let mut chart = chart
        .as_map()
        .with(
            Series::line("edges beyond the section", Colour::Backdrop, separate(&outlines))
                .marked(Mark::Line(EDGE_WIDTH)),
        )
        .with(Series::line("section", Colour::Truth, separate(&section)).marked(Mark::Line(CUT_WIDTH)));
    if let Some(route) = world.default_route() {
        chart = with_route(chart, route, project);
    }
    chart
}

fn with_route(chart: Chart, route: &Route, project: fn(&Vector) -> (f64, f64)) -> Chart {
    let mut points: Vec<(f64, f64)> = route.points_in_world.iter().map(project).collect();
    let ends = (points[0], points[points.len() - 1]);
    if route.closed {
        points.push(points[0]);
    }
    let chart = chart.with(Series::line("default route", Colour::Estimate, points).marked(Mark::Line(ROUTE_WIDTH)));
    chart.with_ends(ends.0, (!route.closed).then_some(ends.1))
}

/// The lines of a drawing without those that coincide or are points; the longest first, [`MAX_EDGES`] at most.
fn outlines(lines: impl Iterator<Item = Line>) -> Vec<Line> {
    let rounded = |(x, y): (f64, f64)| ((x / SAME_LINE_M).round() as i64, (y / SAME_LINE_M).round() as i64);
    let mut different = BTreeMap::new();
    for line in lines {
        let mut key = line.map(rounded);
        key.sort_unstable();
        if key[0] != key[1] {
            different.entry(key).or_insert(line);
        }
    }
    let mut outlines: Vec<Line> = different.into_values().collect();
    let length = |[from, to]: &Line| (to.0 - from.0).hypot(to.1 - from.1);
    outlines.sort_by(|a, b| length(b).total_cmp(&length(a)));
    outlines.truncate(MAX_EDGES);
    outlines
}

/// The points of separate lines: a point that is not finite interrupts the line.
fn separate(lines: &[Line]) -> Vec<(f64, f64)> {
    lines.iter().flat_map(|[from, to]| [*from, *to, (f64::NAN, f64::NAN)]).collect()
}
