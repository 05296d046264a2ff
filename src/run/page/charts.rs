//! The charts of the page.

use super::RunResults;
use super::view::TurnRates;
use crate::integrity::{Integrity, alignment_s};
use zsim_base::geometry::Vector;
use zsim_base::time::Stamp;
use zsim_estimation::WindowReport;
use zsim_evaluation::Errors;
use zsim_report::LengthUnit;
use zsim_report::page::{Abscissa, Chart, ChartGroup, Curve, CurveStyle, Ordinate, Section};

/// Maximum number of times of a chart: about three for each pixel of its width.
const MAX_TIMES: usize = 3000;
/// Number of standard deviations of the bands.
const BAND_SIGMAS: f64 = 2.0;

/// All charts that the results allow.
pub(super) fn all(results: &RunResults) -> Vec<ChartGroup> {
    let group = |section, charts: Vec<Chart>| ChartGroup { section, charts };
    let components = components(results);
    let mut groups = vec![group(Section::Errors, vec![error_and_bound(results)])];
    groups.extend((!components.is_empty()).then(|| group(Section::Errors, components)));
    groups.extend(loops(results).map(|chart| group(Section::Errors, vec![chart])));
    groups.push(group(Section::Clock, vec![clock(results)]));
    groups.extend(windows(results));
    groups.push(group(Section::Motion, vec![turn_rate(results)]));
    groups.retain(|group| group.charts.iter().any(|chart| !chart.x.is_empty()));
    groups
}

/// Every n-th index, so that at most [`MAX_TIMES`] remain.
fn decimated(count: usize) -> impl Iterator<Item = usize> + Clone {
    (0..count).step_by(count.div_ceil(MAX_TIMES).max(1))
}

fn chart(title: &str, label: String, t_s: Vec<f64>, curves: Vec<Curve>) -> Chart {
    let (abscissa, ordinate) = (Abscissa::Time, Ordinate::Linear);
    Chart { title: title.to_owned(), label, abscissa, ordinate, x: t_s, curves }
}

fn curve(name: &str, style: CurveStyle, values: Vec<f64>) -> Curve {
    Curve { name: name.to_owned(), style, values }
}

/// Position error aligned at the start, and its 99 % bound.
fn error_and_bound(results: &RunResults) -> Chart {
    let bounds = results.integrity.bounds();
    let errors = results.pairs.and_then(Integrity::aligned_errors);
    let finite = bounds.iter().map(|bound| bound.bound_m_99).filter(|bound| bound.is_finite());
    let largest_error_m = errors.iter().flat_map(|errors| &errors.position_m).map(Vector::norm).fold(0.0, f64::max);
    let LengthUnit { symbol: unit, per_m } = LengthUnit::for_lengths_up_to(finite.fold(largest_error_m, f64::max));
    let kept = decimated(bounds.len());
    let t_s = kept.clone().map(|k| results.seconds(bounds[k].stamp)).collect();
    let mut curves =
        vec![curve("99 % bound", CurveStyle::Bound, kept.clone().map(|k| bounds[k].bound_m_99 * per_m).collect())];
    if let Some(errors) = &errors {
        let at = |k: usize| value_at(errors, bounds[k].stamp).map_or(f64::NAN, |k| errors.position_m[k].norm() * per_m);
        curves.push(curve("error", CurveStyle::Estimate, kept.map(at).collect()));
    }
    chart(&bound_title(results), format!("Error ({unit})"), t_s, curves)
}

/// Title of the chart of the bound: the interval of the alignment, and from when there is no bound.
fn bound_title(results: &RunResults) -> String {
    let title = match results.pairs {
        Some(pairs) => {
            let aligned_s = alignment_s(pairs.duration_s());
            format!("Position error after alignment over the first {aligned_s:.0} s, and its 99 % bound")
        }
        None => "99 % bound on the position error".to_owned(),
    };
    match results.integrity.bounds().iter().position(|bound| !bound.bound_m_99.is_finite()) {
        None => title,
        Some(0) => title + " (unbounded)",
        Some(first) => {
            let from_s = results.seconds(results.integrity.bounds()[first].stamp);
            format!("{title} (unbounded from {from_s:.1} s)")
        }
    }
}

/// Index of the error at `stamp`; `None` if there is none within 50 ms.
fn value_at(errors: &Errors, stamp: Stamp) -> Option<usize> {
    let after = errors.stamps.partition_point(|at| *at < stamp).min(errors.stamps.len().checked_sub(1)?);
    (errors.stamps[after].seconds_since(stamp).abs() < 0.05).then_some(after)
}

/// The components of position and rotation error in the map frame, each with the band of its standard deviation.
fn components(results: &RunResults) -> Vec<Chart> {
    let Some(errors) = results.pairs.and_then(Integrity::aligned_errors) else { return Vec::new() };
    let map_from_view = results.view_from_map().rotation.inverse();
    let bounds = results.integrity.bounds();
    let kept = decimated(bounds.len());
    let t_s: Vec<f64> = kept.clone().map(|k| results.seconds(bounds[k].stamp)).collect();
    let largest_m = errors.position_m.iter().map(Vector::norm).fold(0.0, f64::max);
    let LengthUnit { symbol: unit, per_m } = LengthUnit::for_lengths_up_to(largest_m);
    let component = |axis: usize, name: &str| {
        let (is_position, k) = (axis < 3, axis % 3);
        let vectors = if is_position { &errors.position_m } else { &errors.rotation_rad };
        let (unit, factor) = if is_position { (unit, per_m) } else { ("\u{b0}", 1_f64.to_degrees()) };
        let sigma_factor = if is_position { per_m } else { 1.0 };
        let error = |stamp| value_at(&errors, stamp).map_or(f64::NAN, |at| (map_from_view * vectors[at])[k] * factor);
        let band = |sign: f64| {
            kept.clone().map(|at| sign * BAND_SIGMAS * bounds[at].sigmas[axis] * sigma_factor).collect::<Vec<_>>()
        };
        let curves = vec![
            curve("2 sigma", CurveStyle::BandTop, band(1.0)),
            curve("\u{2212}2 sigma", CurveStyle::BandBottom, band(-1.0)),
            curve("error", CurveStyle::Estimate, kept.clone().map(|at| error(bounds[at].stamp)).collect()),
        ];
        chart(&format!("{name} with its 95 % band"), format!("Error ({unit})"), t_s.clone(), curves)
    };
    let names = ["x error", "y error", "z error", "Roll error", "Pitch error", "Yaw error"];
    names.iter().enumerate().map(|(axis, name)| component(axis, name)).collect()
}

/// Position error of open loop and closed loop after rigid alignment, and the information bound.
fn loops(results: &RunResults) -> Option<Chart> {
    let (best, open) = (results.best.comparison?.errors.as_ref()?, results.loops.open_errors());
    let largest = |errors: &Errors| errors.position_m.iter().map(Vector::norm).fold(0.0, f64::max);
    let LengthUnit { symbol: unit, per_m } =
        LengthUnit::for_lengths_up_to(open.map_or(0.0, largest).max(largest(best)));
    let kept = decimated(best.stamps.len());
    let t_s = kept.clone().map(|k| results.seconds(best.stamps[k])).collect();
    let error =
        |errors: &Errors, stamp| value_at(errors, stamp).map_or(f64::NAN, |k| errors.position_m[k].norm() * per_m);
    let over_time = |errors: &Errors| kept.clone().map(|k| error(errors, best.stamps[k])).collect::<Vec<_>>();
    let name = if open.is_some() { "closed loop" } else { "open loop" };
    let mut curves = vec![curve(name, CurveStyle::Estimate, over_time(best))];
    curves.extend(open.map(|open| curve("open loop", CurveStyle::Second, over_time(open))));
    if let Some(bound) = results.bound {
        let at = |stamp: Stamp| {
            let after = bound.stamps.partition_point(|at| *at < stamp);
            bound.position_sigma_m.get(after).map_or(f64::NAN, |sigma| sigma.norm() * per_m)
        };
        let limit = kept.clone().map(|k| at(best.stamps[k])).collect();
        curves.push(curve("information bound in the world, known map (sigma)", CurveStyle::Limit, limit));
    }
    Some(chart("Position error after rigid alignment", format!("Error ({unit})"), t_s, curves))
}

/// The estimated and the true clock offset.
fn clock(results: &RunResults) -> Chart {
    let estimate = &results.loops.open.estimate.clock_offsets;
    let kept = decimated(estimate.len());
    let t_s = kept.clone().map(|k| results.seconds(estimate[k].0)).collect();
    let estimated = kept.clone().map(|k| estimate[k].1 * 1e3).collect();
    let mut curves = vec![curve("estimate", CurveStyle::Estimate, estimated)];
    if let Some(truth) = results.true_offsets().filter(|offsets| !offsets.is_empty()) {
        let at = |stamp: Stamp| truth[truth.partition_point(|(at, _)| *at < stamp).min(truth.len() - 1)].1 * 1e3;
        curves.push(curve("truth", CurveStyle::Truth, kept.map(|k| at(estimate[k].0)).collect()));
    }
    chart("IMU clock offset relative to the lidar clock", "Offset (ms)".to_owned(), t_s, curves)
}

/// Matches, conditioning, residual and run time of the windows.
fn windows(results: &RunResults) -> Vec<ChartGroup> {
    let windows = &results.loops.open.estimate.windows;
    let kept = decimated(windows.len());
    let t_s: Vec<f64> = kept.clone().map(|k| results.seconds(windows[k].stamp)).collect();
    let values = |of: &dyn Fn(&WindowReport) -> f64| kept.clone().map(|k| of(&windows[k])).collect::<Vec<_>>();
    let one = |title: &str, label: &str, curves| chart(title, label.to_owned(), t_s.clone(), curves);
    let matches = vec![
        curve("within the window", CurveStyle::Estimate, values(&|window| window.matches as f64)),
        curve("with fixed views", CurveStyle::Second, values(&|window| window.view_matches as f64)),
    ];
    let conditioning = values(&|window| if window.conditioning > 0.0 { window.conditioning } else { f64::NAN });
    let conditioning = vec![curve("conditioning", CurveStyle::Estimate, conditioning)];
    let residual = vec![curve("residual", CurveStyle::Estimate, values(&|window| window.residual_rms_m * 1e3))];
    let elapsed = vec![curve("window", CurveStyle::Estimate, values(&|window| window.elapsed_s * 1e3))];
    let weak = Chart {
        ordinate: Ordinate::Logarithmic,
        ..one(
            "Conditioning of the position, 1 if all directions are constrained alike",
            "Eigenvalue ratio",
            conditioning,
        )
    };
    let group = |section, chart: Chart| ChartGroup { section, charts: vec![chart] };
    vec![
        group(Section::Matching, one("Surfel matches per window", "Matches", matches)),
        group(Section::Matching, weak),
        group(Section::Matching, one("RMS residual of the matches", "Residual (mm)", residual)),
        group(Section::Timing, one("Run time per window", "Time (ms)", elapsed)),
    ]
}

/// The angular velocity of the head.
fn turn_rate(results: &RunResults) -> Chart {
    let trajectory = results.best.map_from_head;
    let rates = TurnRates::of(trajectory);
    let kept = decimated(trajectory.len());
    let t_s = kept.clone().map(|k| results.seconds(trajectory.stamps()[k])).collect();
    let values = kept.map(|k| rates.at(trajectory.stamps()[k])).collect();
    let curves = vec![curve("angular velocity", CurveStyle::Estimate, values)];
    chart("Angular velocity of the head", "Rate (\u{b0}/s)".to_owned(), t_s, curves)
}
