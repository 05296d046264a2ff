//! Figures: sections through the map as in the paper's figure 4, and error curves.

use super::{LatencyResult, LatencyRun};
use crate::bootstrap::ConfidenceInterval;
use zsim_report::plot::{BandPoint, Chart, Colour, Figure, Mark, Series, SignedDot, SignedDots};
use zsim_run::timing::{ClockState, Disturbance};

/// Angular rate at the ends of the colour scale, degrees/s; larger rates saturate the colour.
const FULL_COLOUR_DEG_PER_S: f64 = 150.0;
/// Area of the axes of a panel, square points.
const PANEL_AREA: f64 = 72_000.0;
/// Minimum and maximum width of the axes of a panel, points.
const AXES_WIDTH: (f64, f64) = (160.0, 440.0);
/// Approximate room next to the axes of a panel, points.
const PANEL_MARGIN: f64 = 90.0;

/// An error measure of a run.
type ErrorMeasure = fn(&LatencyRun) -> ConfidenceInterval;

/// Vertical section through the map for each shown disturbance, as in the paper: latencies above, noises below.
///
/// Colour is the head's angular rate at the time of a point.
pub fn map_figure(study: &LatencyResult, clock: ClockState) -> Figure {
    let [latencies, noises] = study.shown();
    let columns = latencies.len();
    let mut letters = 'a'..;
    let mut charts = Vec::new();
    for (row, is_noise) in [(latencies, false), (noises, true)] {
        for disturbance in row {
            let title = format!("({}) {}", letters.next().unwrap_or(' '), label(disturbance, is_noise));
            charts.push(panel(study, disturbance, clock, &title, charts.is_empty()));
        }
    }
    let mut figure = Figure::of(charts).in_columns(columns);
    figure.width = panel_width(study) * columns as f64;
    figure
}

/// Width of a panel, points: a high section has narrow panels.
fn panel_width(study: &LatencyResult) -> f64 {
    let range = study.runs.iter().find_map(|run| Some(run.section.as_ref()?.range_m));
    let shape = range.map_or(1.0, |((left, right), (low, high))| (right - left) / (high - low));
    (PANEL_AREA * shape).sqrt().clamp(AXES_WIDTH.0, AXES_WIDTH.1) + PANEL_MARGIN
}

fn label(disturbance: Disturbance, is_noise: bool) -> String {
    if is_noise {
        format!("{} ms added noise", disturbance.noise_ms)
    } else {
        format!("{} ms latency", disturbance.latency_ms).replace('-', "\u{2212}")
    }
}

fn panel(study: &LatencyResult, disturbance: Disturbance, clock: ClockState, title: &str, is_first: bool) -> Chart {
    let chart = Chart::new(title, "Along the section (m)", "Up (m)").as_map();
    let Some(section) = study.run(disturbance, clock).and_then(|run| run.section.as_ref()) else { return chart };
    let dots = section.points_m.iter().zip(&section.rates_deg_per_s);
    let (along, up) = section.range_m;
    chart.between(along, up).with_signed_dots(SignedDots {
        unit: if is_first { "\u{b0}/s" } else { "" }.to_owned(),
        limit: FULL_COLOUR_DEG_PER_S,
        size: 1.6,
        dots: dots.map(|((x, y), rate)| SignedDot { x: f64::from(*x), y: f64::from(*y), value: *rate }).collect(),
    })
}

/// Cloud standard deviation and position RMSE over latency and over noise, with clock state off and on, and 95 % bands.
pub fn curve_figure(study: &LatencyResult) -> Figure {
    let over_latency = |run: &LatencyRun| run.disturbance.latency_ms;
    let over_noise = |run: &LatencyRun| run.disturbance.noise_ms;
    let (sigma, rmse): (ErrorMeasure, ErrorMeasure) = (|run| run.cloud_sigma_m, |run| run.position_rmse_m);
    let (cloud, position) = ("Standard deviation of the cloud (mm)", "Position error, RMS (mm)");
    let (latency, noise) = ("Latency of the IMU stamps (ms)", "Standard deviation of the noise on scan stamps (ms)");
    let chart = |labels: (&str, &str), of: &dyn Fn(ClockState) -> Vec<(f64, ConfidenceInterval)>| {
        let series = |name: &str, clock, colour| curve(name, colour, &of(clock));
        let dots = |clock, colour| {
            let points = of(clock).iter().map(|(x, y)| (*x, y.value * 1e3)).collect();
            Series::dots("", colour, points).marked(Mark::Dots(4.0))
        };
        Chart::new("", labels.0, labels.1)
            .starting_at_zero()
            .with(series("clock state off", ClockState::Off, Colour::Second))
            .with(series("clock state on", ClockState::On, Colour::Estimate))
            .with(dots(ClockState::Off, Colour::Second))
            .with(dots(ClockState::On, Colour::Estimate))
    };
    let latencies = |figure: ErrorMeasure| {
        move |clock| study.latencies(clock).iter().map(|run| (over_latency(run), figure(run))).collect()
    };
    let noises = |figure: ErrorMeasure| {
        move |clock| study.noises(clock).iter().map(|run| (over_noise(run), figure(run))).collect()
    };
    let mut figure = Figure::of(vec![
        chart((latency, cloud), &latencies(sigma)),
        chart((noise, cloud), &noises(sigma)),
        chart((latency, position), &latencies(rmse)),
        chart((noise, position), &noises(rmse)),
    ])
    .in_columns(2);
    figure.width = 960.0;
    figure
}

/// A curve with its confidence band, in mm.
fn curve(name: &str, colour: Colour, points: &[(f64, ConfidenceInterval)]) -> Series {
    let values = points.iter().map(|(x, y)| (*x, y.value * 1e3)).collect();
    let band = points.iter().map(|(x, y)| BandPoint { x: *x, low: y.low * 1e3, high: y.high * 1e3 }).collect();
    Series::line(name, colour, values).marked(Mark::Line(1.5)).with_band(band)
}
