//! Figures and plots that compare several estimated trajectories.

use super::figures::LengthUnit;
use super::plot::{Chart, Colour, Figure, Mark, Series};
use super::quantity::{length, percent};
use super::table::table;
use serde_json::{Map, Value, json};
use zsim_base::geometry::{Trajectory, Vector};
use zsim_base::time::Stamp;
use zsim_evaluation::{Errors, RelativeError, TrajectoryErrors, gap_s};

const TIME: &str = "Time (s)";

/// Colours of the trajectories, in order; after these, the same colours as dashes.
const COLOURS: [Colour; 5] = [Colour::Estimate, Colour::Second, Colour::Third, Colour::Fourth, Colour::Fifth];

/// Figures of a trajectory by key, each with its unit in the key; `null` where the trajectory is too short or the truth has
/// no attitudes.
pub fn trajectory_figures(errors: &TrajectoryErrors) -> Map<String, Value> {
    let drift = errors.drift;
    let mut figures = Map::new();
    let mut insert = |key: &str, value: Option<f64>| figures.insert(key.to_owned(), json!(value));
    insert("duration_s", Some(errors.duration_s));
    insert("coverage", Some(errors.coverage));
    insert("position_rmse_m", Some(errors.position_rmse_m));
    insert("position_median_m", Some(errors.position_median_m));
    insert("position_max_m", Some(errors.position_max_m));
    insert("rotation_rmse_deg", errors.rotation_rmse_rad.map(f64::to_degrees));
    insert("rotation_max_deg", errors.rotation_max_rad.map(f64::to_degrees));
    insert("drift_m_per_min", drift.map(|drift| drift.position_m_per_min));
    insert("yaw_drift_deg_per_min", drift.and_then(|drift| drift.yaw_rad_per_min).map(f64::to_degrees));
    insert("end_error_m", drift.map(|drift| drift.end_error_m));
    let relative = [("metre", errors.per_metre), ("second", errors.per_second), ("minute", errors.per_minute)];
    for (per, error) in relative {
        insert(&format!("relative_error_per_{per}_m"), error.map(|error| error.position_rmse_m));
        insert(&format!("relative_error_per_{per}_deg"), error.map(|error| error.rotation_rmse_rad.to_degrees()));
    }
    figures.insert("poses".to_owned(), json!(errors.poses));
    figures
}

/// Table of several trajectories for the terminal: a row each, errors of the position after alignment.
pub fn comparison_table(compared: &[(&str, &TrajectoryErrors)]) -> String {
    let row = |(name, errors): &(&str, &TrajectoryErrors)| {
        vec![
            (*name).to_owned(),
            percent(errors.coverage),
            length(errors.position_rmse_m),
            length(errors.position_max_m),
            errors.rotation_rmse_rad.map_or_else(dash, degrees),
            relative(errors.per_metre),
            relative(errors.per_second),
            errors.drift.map_or_else(dash, |drift| length(drift.position_m_per_min)),
        ]
    };
    let header = ["", "covered", "APE", "APE max", "angle", "RPE 1 m", "RPE 1 s", "drift/min"];
    table(&header, &compared.iter().map(row).collect::<Vec<_>>(), true)
}

/// Table of the figures that [`comparison_table`] omits.
pub fn comparison_details(compared: &[(&str, &TrajectoryErrors)]) -> String {
    let row = |(name, errors): &(&str, &TrajectoryErrors)| {
        let turned = |error: Option<RelativeError>| error.map_or_else(dash, |error| degrees(error.rotation_rmse_rad));
        vec![
            (*name).to_owned(),
            length(errors.position_median_m),
            errors.rotation_max_rad.map_or_else(dash, degrees),
            turned(errors.per_metre),
            turned(errors.per_second),
            errors.drift.and_then(|drift| drift.yaw_rad_per_min).map_or_else(dash, degrees),
            errors.drift.map_or_else(dash, |drift| length(drift.end_error_m)),
        ]
    };
    let header = ["", "APE median", "angle max", "angle 1 m", "angle 1 s", "yaw/min", "end error"];
    table(&header, &compared.iter().map(row).collect::<Vec<_>>(), true)
}

fn dash() -> String {
    "-".to_owned()
}

fn degrees(angle_rad: f64) -> String {
    format!("{:.3}\u{b0}", angle_rad.to_degrees())
}

fn relative(error: Option<RelativeError>) -> String {
    error.map_or_else(dash, |error| length(error.position_rmse_m))
}

/// Position error of each trajectory over time, after its own alignment, and its rotation error, if it is known.
pub fn compared_errors(compared: &[(&str, &Errors)]) -> Figure {
    let max_m = compared.iter().flat_map(|(_, errors)| &errors.position_m).map(Vector::norm).fold(0.0, f64::max);
    let LengthUnit { symbol: unit, per_m } = LengthUnit::for_lengths_up_to(max_m);
    let origin = compared.iter().filter_map(|(_, errors)| errors.stamps.first()).min().copied().unwrap_or_default();
    let chart = |title: &str, unit: &str, factor: f64, vectors: fn(&Errors) -> &[Vector]| {
        let empty = Chart::new(title, TIME, &format!("Error ({unit})")).starting_at_zero();
        compared.iter().enumerate().fold(empty, |chart, (index, (name, errors))| {
            chart.with(curve(index, name, norms(&errors.stamps, origin, vectors(errors), factor)))
        })
    };
    let has_rotations = compared.iter().any(|(_, errors)| !errors.rotation_rad.is_empty());
    let rotation =
        || chart("Rotation error, after alignment", "\u{b0}", 1_f64.to_degrees(), |errors| &errors.rotation_rad);
    let position = chart("Position error, after alignment", unit, per_m, |errors| &errors.position_m);
    Figure::of([position].into_iter().chain(has_rotations.then(rotation)).collect())
}

/// Top view of the true trajectory and of each aligned estimate, `world_from_head`.
pub fn compared_trajectories(truth: &Trajectory, compared: &[(&str, &Trajectory)]) -> Figure {
    let top = |trajectory: &Trajectory| -> Vec<(f64, f64)> {
        trajectory.poses().iter().map(|pose| (pose.translation.vector.x, pose.translation.vector.y)).collect()
    };
    let empty = Chart::new("Trajectories, top view", "x (m)", "y (m)").as_map();
    let chart = compared
        .iter()
        .enumerate()
        .fold(empty, |chart, (index, (name, trajectory))| chart.with(curve(index, name, top(trajectory))));
    Figure::of(vec![chart.with(Series::line("truth", Colour::Truth, top(truth)).marked(Mark::Dashes(1.0)))])
}

/// Magnitudes over the time since `origin`, s; NaN in a gap ([`gap_s`]), where the line is interrupted.
fn norms(stamps: &[Stamp], origin: Stamp, vectors: &[Vector], factor: f64) -> Vec<(f64, f64)> {
    let mut points: Vec<(f64, f64)> = Vec::with_capacity(vectors.len());
    let gap_s = gap_s(stamps);
    for (stamp, vector) in stamps.iter().zip(vectors) {
        let time_s = stamp.seconds_since(origin);
        if points.last().is_some_and(|(before_s, _)| time_s - before_s > gap_s) {
            points.push((time_s, f64::NAN));
        }
        points.push((time_s, vector.norm() * factor));
    }
    points
}

/// The line of trajectory number `index`.
fn curve(index: usize, name: &str, points: Vec<(f64, f64)>) -> Series {
    let mark = if (index / COLOURS.len()).is_multiple_of(2) { Mark::Line(1.4) } else { Mark::Dashes(1.4) };
    Series::line(name, COLOURS[index % COLOURS.len()], points).marked(mark)
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_evaluation::Drift;

    fn errors() -> TrajectoryErrors {
        let relative = RelativeError { position_rmse_m: 0.00123, rotation_rmse_rad: 0.5_f64.to_radians() };
        TrajectoryErrors {
            poses: 100,
            duration_s: 99.0,
            coverage: 0.5,
            position_rmse_m: 0.0123,
            position_median_m: 0.01,
            position_max_m: 1.5,
            rotation_rmse_rad: Some(1_f64.to_radians()),
            rotation_max_rad: Some(2_f64.to_radians()),
            per_metre: Some(relative),
            per_second: None,
            per_minute: None,
            drift: None,
        }
    }

    #[test]
    fn tables_of_long_names_have_80_columns_and_a_dash_for_an_unknown_figure() {
        let (errors, name) = (errors(), "results/a_run_with_a_long_name/closed_loop.tum");
        let compared = [(name, &errors), ("b.tum", &errors)];
        for text in [comparison_table(&compared), comparison_details(&compared)] {
            assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
        }
        let text = comparison_table(&compared);
        let row: Vec<&str> = text.lines().last().unwrap().split_whitespace().collect();
        assert_eq!(row, "b.tum 50.0 % 12.3 mm 1.50 m 1.000\u{b0} 1.23 mm - -".split(' ').collect::<Vec<_>>());
    }

    #[test]
    fn without_true_attitudes_angles_are_unknown() {
        let drift = Drift { position_m_per_min: 0.01, yaw_rad_per_min: None, end_error_m: 0.02 };
        let relative = TrajectoryErrors { per_metre: None, drift: Some(drift), ..errors() };
        let errors = TrajectoryErrors { rotation_rmse_rad: None, rotation_max_rad: None, ..relative };
        let figures = trajectory_figures(&errors);
        for key in ["rotation_rmse_deg", "rotation_max_deg", "yaw_drift_deg_per_min", "relative_error_per_metre_m"] {
            assert!(figures[key].is_null(), "{key}");
        }
        assert_eq!(figures["drift_m_per_min"], 0.01);
        let row = comparison_table(&[("a", &errors)]);
        let row: Vec<&str> = row.lines().last().unwrap().split_whitespace().collect();
        assert_eq!(row, "a 50.0 % 12.3 mm 1.50 m - - - 10.0 mm".split(' ').collect::<Vec<_>>());
        let stamps = (0..3).map(|s| Stamp::from_nanos(s * 1_000_000_000)).collect();
        let over_time = Errors { stamps, position_m: vec![Vector::x(); 3], rotation_rad: Vec::new() };
        let svg = compared_errors(&[("a", &over_time)]).svg().unwrap();
        assert!(svg.contains("Position error") && !svg.contains("Rotation error"));
    }

    #[test]
    fn figures_have_their_unit_in_the_key_and_null_for_an_unknown_figure() {
        let figures = trajectory_figures(&errors());
        assert!((figures["relative_error_per_metre_deg"].as_f64().unwrap() - 0.5).abs() < 1e-12);
        assert!(figures["relative_error_per_second_m"].is_null() && figures["drift_m_per_min"].is_null());
    }

    #[test]
    fn a_gap_interrupts_the_line() {
        let stamps = [0, 1, 2, 5].map(|s| Stamp::from_nanos(s * 1_000_000_000));
        let points = norms(&stamps, stamps[0], &[Vector::x(), Vector::y(), Vector::z(), Vector::x()], 2.0);
        assert_eq!(points[..3], [(0.0, 2.0), (1.0, 2.0), (2.0, 2.0)]);
        assert!(points[3].1.is_nan() && points[4] == (5.0, 2.0));
    }
}
