//! The points of the view with the quantities that colour them.

use super::RunResults;
use super::paths::TurnRates;
use rayon::prelude::*;
use zsim_base::geometry::{Pose, Vector};
use zsim_recording::CloudPoint;
use zsim_report::page::ViewPoint;
use zsim_world::World;

/// Maximum distance from a point to its true surface, m.
const MAX_DISTANCE_M: f64 = 1.0;

/// The points of the view, in order of time.
pub(super) fn points(results: &RunResults) -> Vec<ViewPoint> {
    let turn_rates = TurnRates::of(results.best.map_from_head);
    let (world, view_from_map) = (results.world(), results.view_from_map());
    let view_point = |point: &CloudPoint| {
        let position = transformed(&view_from_map, &point.point_in_map.cast());
        let sensor = results.best.map_from_head.at(point.stamp).map(|pose| (view_from_map * pose).translation.vector);
        let surface = world.zip(sensor).and_then(|(world, sensor)| distance(world, &position, &sensor));
        ViewPoint {
            position,
            t_s: results.seconds(point.stamp),
            intensity: point.intensity.into(),
            turn_rate_deg_per_s: turn_rates.at(point.stamp),
            sigma_m: point.error_m.into(),
            error_m: surface.map_or(f64::NAN, |(distance_m, _)| distance_m),
            material: surface.map(|(_, material)| material),
        }
    };
    let mut points: Vec<ViewPoint> = results.points.par_iter().map(view_point).collect();
    points.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
    points
}

fn transformed(a_from_b: &Pose, point: &Vector) -> Vector {
    a_from_b.rotation * point + a_from_b.translation.vector
}

/// Signed distance to the nearest surface, positive on the side of the sensor, m, and the material of the surface.
fn distance(world: &World, point: &Vector, sensor: &Vector) -> Option<(f64, usize)> {
    let (nearest, material) = world.nearest_material(point, MAX_DISTANCE_M)?;
    let offset = point - nearest.point_in_world;
    let facing = (sensor - nearest.point_in_world).dot(&nearest.normal_in_world);
    let side = (offset.dot(&nearest.normal_in_world) * facing).signum();
    Some((offset.norm() * side, material.index()))
}
