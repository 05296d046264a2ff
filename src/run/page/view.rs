//! Paths of head and base, angular velocity of the head, and points of the cloud with the quantities that colour them.

use super::RunResults;
use rayon::prelude::*;
use zsim_base::geometry::{Pose, Trajectory, Vector};
use zsim_base::time::{Span, Stamp};
use zsim_recording::CloudPoint;
use zsim_report::page::{MAX_PAGE_POSES, TimedPose, ViewPoint};
use zsim_world::World;

/// Maximum rate of the poses: a dozen in a period of the fastest mode that is visible.
const MAX_RATE_HZ: f64 = 50.0;
/// Half the time over which the angular velocity is computed.
const HALF_STEP: Span = Span::from_nanos(5_000_000);

/// Stamps of the poses of the view.
fn stamps(trajectory: &Trajectory) -> impl Iterator<Item = Stamp> + '_ {
    let count = trajectory.len();
    let seconds = trajectory.span().map_or(0.0, |(first, last)| last.seconds_since(first));
    let wanted = (seconds * MAX_RATE_HZ).min(MAX_PAGE_POSES as f64).max(2.0);
    let stride = (count as f64 / wanted).ceil().max(1.0) as usize;
    trajectory.stamps().iter().copied().step_by(stride)
}

/// The estimated poses of the head.
pub(super) fn estimate(results: &RunResults) -> Vec<TimedPose> {
    let view_from_map = results.view_from_map();
    let trajectory = results.best.map_from_head;
    let timed =
        |stamp: Stamp| Some(TimedPose { t_s: results.seconds(stamp), pose: view_from_map * trajectory.at(stamp)? });
    stamps(trajectory).filter_map(timed).collect()
}

/// The poses of `sampled`, the truth at the stamps of the estimate, at the stamps of the view.
pub(super) fn truth(results: &RunResults, sampled: &[(Stamp, Pose)]) -> Vec<TimedPose> {
    let mut sampled = sampled.iter().peekable();
    let mut poses = Vec::new();
    for stamp in stamps(results.best.map_from_head) {
        while sampled.next_if(|(at, _)| *at < stamp).is_some() {}
        let found = sampled.next_if(|(at, _)| *at == stamp);
        poses.extend(found.map(|(_, pose)| TimedPose { t_s: results.seconds(stamp), pose: *pose }));
    }
    poses
}

/// Angular velocity of the head.
pub(super) struct TurnRates<'a>(&'a Trajectory);

impl<'a> TurnRates<'a> {
    pub(super) fn of(trajectory: &'a Trajectory) -> Self {
        Self(trajectory)
    }

    /// Magnitude at `stamp`, degrees/s, from the rotation over 10 ms; 0 at the ends of the trajectory.
    pub(super) fn at(&self, stamp: Stamp) -> f64 {
        let (Some(before), Some(after)) = (self.0.at(stamp - HALF_STEP), self.0.at(stamp + HALF_STEP)) else {
            return 0.0;
        };
        before.rotation.angle_to(&after.rotation).to_degrees() / (2.0 * HALF_STEP.seconds())
    }
}

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
