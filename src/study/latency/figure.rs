//! The paper's figure 4, and the curves that it does not have.

use super::{Banded, ClockState, Disturbance, Study, StudyRun};
use crate::report::plot::{Chart, Colour, Figure, Mark, Series, SignedDots};

/// Rates of rotation beyond this have the colours' ends, degrees/s.
const FULL_COLOUR_DEG_PER_S: f64 = 150.0;
/// Width of a panel, points.
const PANEL_WIDTH: f64 = 400.0;

/// A figure of a run.
type Told = fn(&StudyRun) -> Banded;

/// The vertical cut through the map under each disturbance that is shown, coloured by the rate of rotation at which a
/// point was seen: a row of latencies and a row of noises, as in the paper.
pub fn map_figure(study: &Study, clock: ClockState) -> Figure {
    let [latencies, noises] = &study.shown;
    let columns = latencies.len();
    let mut letters = 'a'..;
    let mut charts = Vec::new();
    for row in [latencies, noises] {
        for disturbance in row {
            let title = format!("({}) {}", letters.next().unwrap_or(' '), said(*disturbance, row == noises));
            charts.push(panel(study, (*disturbance, clock), &title, charts.is_empty()));
        }
    }
    let mut figure = Figure::of(charts).in_columns(columns);
    figure.width = PANEL_WIDTH * columns as f64;
    figure
}

fn said(disturbance: Disturbance, is_noise: bool) -> String {
    if is_noise {
        format!("{} ms added noise", disturbance.noise_ms)
    } else {
        format!("{} ms latency", disturbance.latency_ms).replace('-', "\u{2212}")
    }
}

fn panel(study: &Study, (disturbance, clock): (Disturbance, ClockState), title: &str, is_first: bool) -> Chart {
    let points = study.run(disturbance, clock).map(|run| run.cut_m.as_slice()).unwrap_or_default();
    let dots = points.iter().zip(&study.cut_rates_deg_per_s);
    let unit = if is_first { "\u{b0}/s" } else { "" };
    let (along, up) = study.cut_range_m;
    Chart::new(title, "Along the cut (m)", "Up (m)").as_map().between(along, up).with_signed_dots(SignedDots {
        unit: unit.to_owned(),
        limit: FULL_COLOUR_DEG_PER_S,
        size: 1.6,
        dots: dots.map(|((x, y), rate)| (f64::from(*x), f64::from(*y), *rate)).collect(),
    })
}

/// Spread of the cloud and error of the position over the latency, and over the noise: with the clock state off and on,
/// each with its 95 % band.
pub fn curve_figure(study: &Study) -> Figure {
    let over_latency = |run: &StudyRun| run.disturbance.latency_ms;
    let over_noise = |run: &StudyRun| run.disturbance.noise_ms;
    let (sigma, rmse): (Told, Told) = (|run| run.cloud_sigma_m, |run| run.position_rmse_m);
    let (cloud, position) = ("Cloud, sigma (mm)", "Position RMSE (mm)");
    let (latency, noise) = ("Latency of the IMU's stamps (ms)", "Noise on the scans' stamps, sigma (ms)");
    let chart = |labels: (&str, &str), of: &dyn Fn(ClockState) -> Vec<(f64, Banded)>| {
        let series = |name: &str, clock, colour| banded(name, colour, &of(clock));
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
    let latencies =
        |figure: Told| move |clock| study.latencies(clock).iter().map(|run| (over_latency(run), figure(run))).collect();
    let noises =
        |figure: Told| move |clock| study.noises(clock).iter().map(|run| (over_noise(run), figure(run))).collect();
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

fn banded(name: &str, colour: Colour, curve: &[(f64, Banded)]) -> Series {
    let points = curve.iter().map(|(x, y)| (*x, y.value * 1e3)).collect();
    let band = curve.iter().map(|(x, y)| (*x, y.low * 1e3, y.high * 1e3)).collect();
    Series::line(name, colour, points).marked(Mark::Line(1.5)).with_band(band)
}
