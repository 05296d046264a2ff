//! Plots of a run.

use super::plot::{Chart, Colour, Figure, Mark, Series};
use zsim_base::geometry::{Rotation, Trajectory, Vector};
use zsim_base::time::Stamp;
use zsim_evaluation::{Errors, InformationBound};

const TIME: &str = "Time (s)";
/// Duration of the enlarged section of the pitch plot, s: several periods of the rocking mode.
const CLOSE_UP_S: f64 = 10.0;
/// Height of the side view, points.
const SIDE_VIEW_HEIGHT: f64 = 210.0;
/// Margins of the views as fractions of the range.
const MAP_MARGIN: f64 = 0.04;
const HEIGHT_MARGIN: f64 = 0.06;
/// Minimum range of the axes of the side view, m: a sensor at rest is a line, not noise that fills the chart.
const MIN_RANGE_M: f64 = 0.1;

/// Top view and side view of the true and the estimated trajectory; the top view also shows the outline of the walls.
///
/// `truth` is empty if it is not known; the estimate is then in the map frame.
pub fn trajectory_views(truth: &Trajectory, estimate: &Trajectory, outline_in_world: &[Vector]) -> Figure {
    let top = |at: &Vector| (at.x, at.y);
    let side = |at: &Vector| (at.x, at.z);
    let outline = Series::dots("", Colour::Backdrop, outline_in_world.iter().map(top).collect());
    let top_chart = Chart::new("Trajectory, top view", "x (m)", "y (m)").as_map().with(outline.marked(Mark::Dots(1.0)));
    let positions = || [truth, estimate].into_iter().flat_map(Trajectory::poses).map(|pose| &pose.translation.vector);
    // The range in x is that of the top view; heights vary by centimetres over a way of many metres.
    let x = range(positions().chain(outline_in_world).map(|at| at.x), MAP_MARGIN);
    let z = range(positions().map(|at| at.z), HEIGHT_MARGIN);
    let side_chart = Chart::new("Trajectory, side view (heights not to scale)", "x (m)", "z (m)").between(x, z);
    let mut figure = Figure::of(vec![view(top_chart, truth, estimate, top), view(side_chart, truth, estimate, side)]);
    figure.chart_height = SIDE_VIEW_HEIGHT;
    figure
}

/// Range of `values`, widened to [`MIN_RANGE_M`] and on both sides by the fraction `margin`; the unit interval without values.
fn range(values: impl Iterator<Item = f64>, margin: f64) -> (f64, f64) {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), value| (l.min(value), h.max(value)));
    if low > high {
        return (0.0, 1.0);
    }
    let half = (0.5 + margin) * (high - low).max(MIN_RANGE_M);
    (0.5 * (low + high) - half, 0.5 * (low + high) + half)
}

/// Adds both trajectories with start and end of the estimate to a chart.
fn view(chart: Chart, truth: &Trajectory, estimate: &Trajectory, project: fn(&Vector) -> (f64, f64)) -> Chart {
    let projected = |trajectory: &Trajectory| -> Vec<(f64, f64)> {
        trajectory.poses().iter().map(|pose| project(&pose.translation.vector)).collect()
    };
    let estimate = projected(estimate);
    let ends = estimate.first().copied().zip(estimate.last().copied());
    let chart = with_truth_and_estimate(chart, &projected(truth), &estimate);
    match ends {
        Some((start, end)) => chart.with_ends(start, Some(end)),
        None => chart,
    }
}

/// Adds the estimate, and the truth as dashes in front of it, to a chart; an empty curve is omitted.
fn with_truth_and_estimate(mut chart: Chart, truth: &[(f64, f64)], estimate: &[(f64, f64)]) -> Chart {
    if !estimate.is_empty() {
        chart = chart.with(Series::line("estimate", Colour::Estimate, estimate.to_vec()).marked(Mark::Line(2.4)));
    }
    if !truth.is_empty() {
        chart = chart.with(Series::line("truth", Colour::Truth, truth.to_vec()).marked(Mark::Dashes(1.0)));
    }
    chart
}

/// Position and rotation errors over time: components in the world frame and magnitude.
pub fn errors_over_time(errors: &Errors) -> Figure {
    let max_norm = |vectors: &[Vector]| vectors.iter().map(Vector::norm).fold(0.0, f64::max);
    let LengthUnit { symbol: unit, per_m } = LengthUnit::for_lengths_up_to(max_norm(&errors.position_m));
    let position = Chart::new("Position error, after alignment", TIME, &format!("Error ({unit})"));
    let rotation = Chart::new("Rotation error, after alignment", TIME, "Error (\u{b0})");
    Figure::of(vec![
        with_axes(position, &errors.stamps, &errors.position_m, per_m),
        with_axes(rotation, &errors.stamps, &errors.rotation_rad, 1_f64.to_degrees()),
    ])
}

/// Position error over time of the open loop and of the closed loop, each after its own alignment.
pub fn open_and_closed_loop_errors(open: &Errors, closed: &Errors) -> Figure {
    let max_m = open.position_m.iter().chain(&closed.position_m).map(Vector::norm).fold(0.0, f64::max);
    let LengthUnit { symbol: unit, per_m } = LengthUnit::for_lengths_up_to(max_m);
    let curve = |errors: &Errors| -> Vec<(f64, f64)> {
        seconds_of(&errors.stamps).into_iter().zip(errors.position_m.iter().map(|e| e.norm() * per_m)).collect()
    };
    let chart = Chart::new("Position error, after alignment", TIME, &format!("Error ({unit})"))
        .starting_at_zero()
        .with(Series::line("open loop", Colour::Second, curve(open)).marked(Mark::Line(1.0)))
        .with(Series::line("closed loop", Colour::Estimate, curve(closed)).marked(Mark::Line(1.4)));
    Figure::of(vec![chart])
}

fn with_axes(mut chart: Chart, stamps: &[Stamp], vectors: &[Vector], factor: f64) -> Chart {
    let seconds = seconds_of(stamps);
    let curve = |value: &dyn Fn(&Vector) -> f64| -> Vec<(f64, f64)> {
        seconds.iter().zip(vectors).map(|(t, vector)| (*t, value(vector) * factor)).collect()
    };
    for (axis, (name, colour)) in
        [("x", Colour::Second), ("y", Colour::Third), ("z", Colour::Estimate)].into_iter().enumerate()
    {
        chart = chart.with(Series::line(name, colour, curve(&|v| v[axis])).marked(Mark::Line(1.0)));
    }
    chart.with(Series::line("magnitude", Colour::Truth, curve(&|v| v.norm())).marked(Mark::Line(1.5)))
}

/// Cramer-Rao bound over time: standard deviations of position and attitude on each world axis.
pub fn bound_over_time(bound: &InformationBound) -> Figure {
    let max_m = bound.position_sigma_m.iter().map(Vector::norm).fold(0.0, f64::max);
    let LengthUnit { symbol: unit, per_m } = LengthUnit::for_lengths_up_to(max_m);
    let position = Chart::new("Information bound on the position", TIME, &format!("Sigma ({unit})"));
    let attitude = Chart::new("Information bound on the attitude", TIME, "Sigma (\u{b0})");
    Figure::of(vec![
        with_axes(position.starting_at_zero(), &bound.stamps, &bound.position_sigma_m, per_m),
        with_axes(attitude.starting_at_zero(), &bound.stamps, &bound.attitude_sigma_rad, 1_f64.to_degrees()),
    ])
}

/// Pitch of the head over the run, with an enlarged section of 10 s in the middle.
pub fn head_pitch(truth: &Trajectory, estimate: &Trajectory) -> Figure {
    let origin = [truth, estimate].into_iter().find_map(Trajectory::span).map(|(first, _)| first).unwrap_or_default();
    let (truth, estimate) = (pitches(truth, origin), pitches(estimate, origin));
    let end_s = truth.last().or(estimate.last()).map_or(0.0, |(t, _)| *t);
    let (from_s, to_s) = ((end_s - CLOSE_UP_S) / 2.0, (end_s + CLOSE_UP_S) / 2.0);
    let in_section = |curve: &[(f64, f64)]| -> Vec<(f64, f64)> {
        curve.iter().copied().filter(|(t, _)| (from_s..=to_s).contains(t)).collect()
    };
    let label = "Pitch, nose up (\u{b0})";
    let full = Chart::new("Pitch of the head", TIME, label);
    let section = Chart::new("Pitch of the head, 10 s", TIME, label);
    let mut charts = vec![with_truth_and_estimate(full, &truth, &estimate)];
    if end_s > 2.0 * CLOSE_UP_S {
        charts.push(with_truth_and_estimate(section, &in_section(&truth), &in_section(&estimate)));
    }
    Figure::of(charts)
}

/// Elevation of the head's x axis, degrees, over the time since `origin`, s.
fn pitches(trajectory: &Trajectory, origin: Stamp) -> Vec<(f64, f64)> {
    let nose_up = |rotation: &Rotation| (rotation * Vector::x()).z.clamp(-1.0, 1.0).asin().to_degrees();
    trajectory.iter().map(|(stamp, pose)| (stamp.seconds_since(origin), nose_up(&pose.rotation))).collect()
}

/// Clock offset over lidar time, ms: IMU stamp minus lidar stamp of the same time, estimated and true.
///
/// `truth` is empty if it is not known.
pub fn clock_offset(truth: &[(Stamp, f64)], estimate: &[(Stamp, f64)]) -> Figure {
    let origin = truth.first().or(estimate.first()).map(|(stamp, _)| *stamp).unwrap_or_default();
    let curve = |offsets: &[(Stamp, f64)]| -> Vec<(f64, f64)> {
        offsets.iter().map(|(stamp, offset_s)| (stamp.seconds_since(origin), offset_s * 1e3)).collect()
    };
    let chart = Chart::new("IMU clock offset relative to the lidar clock", TIME, "Offset (ms)").starting_at_zero();
    Figure::of(vec![with_truth_and_estimate(chart, &curve(truth), &curve(estimate))])
}

fn seconds_of(stamps: &[Stamp]) -> Vec<f64> {
    let origin = stamps.first().copied().unwrap_or_default();
    stamps.iter().map(|stamp| stamp.seconds_since(origin)).collect()
}

/// A unit of length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LengthUnit {
    /// Symbol of the unit.
    pub symbol: &'static str,
    /// Number of units per metre.
    pub per_m: f64,
}

impl LengthUnit {
    /// The unit for an axis with lengths up to `max_m`.
    pub fn for_lengths_up_to(max_m: f64) -> Self {
        let (symbol, per_m) = match max_m {
            m if m < 0.02 => ("mm", 1e3),
            m if m < 2.0 => ("cm", 1e2),
            m if m < 2e3 => ("m", 1.0),
            _ => ("km", 1e-3),
        };
        Self { symbol, per_m }
    }
}
