//! Gain and phase over frequency on logarithmic axes.

use super::curve::{MIN_COHERENCE, continuous_phases};
use super::figure::{PANELS, dot_size, style, with_curve};
use super::{GainCurve, GainPoint};
use zsim_report::plot::{Chart, Figure, Mark, Series, Tick};

/// The lower edge of a band is at least this fraction of the gain: a logarithmic axis has no zero.
pub(super) const LOWEST_SHARE: f64 = 0.01;

/// Ratio of gains above which an axis has ticks at powers of ten only.
const MANY_DECADES: f64 = 300.0;

/// Gain and phase in three rows, rotations first: measurement as dots with 95 % bands, closed form as lines.
pub fn gain_figure(curves: &[GainCurve]) -> Figure {
    let rows = PANELS.iter().flat_map(|(title, label, axes)| {
        let shown: Vec<&GainCurve> = curves.iter().filter(|curve| axes.contains(&curve.axis)).collect();
        [gain_chart(title, label, &shown), phase_chart(&label.replace("Gain", "Phase"), &shown)]
    });
    Figure::of(rows.collect()).in_columns(2)
}

/// A chart over the logarithm of the frequency.
fn over_frequency(title: &str, label: &str) -> Chart {
    Chart::new(title, "Frequency (Hz)", label).with_x_ticks(ticks(-3..=3, &[1.0, 2.0, 5.0]))
}

fn gain_chart(title: &str, label: &str, curves: &[&GainCurve]) -> Chart {
    let gains = || curves.iter().flat_map(|curve| &curve.points).map(|p| p.gain).filter(|gain| *gain > 0.0);
    let (least, largest) = (gains().fold(f64::INFINITY, f64::min), gains().fold(0.0, f64::max));
    let multiples: &[f64] = if largest > MANY_DECADES * least { &[1.0] } else { &[1.0, 2.0, 5.0] };
    let chart = over_frequency(title, label).with_y_ticks(ticks(-9..=6, multiples));
    curves.iter().fold(chart, |chart, curve| with_curve(chart, curve, LOWEST_SHARE, f64::log10))
}

fn phase_chart(label: &str, curves: &[&GainCurve]) -> Chart {
    curves.iter().fold(over_frequency("", &format!("{label} (°)")), |chart, curve| {
        let (name, colour) = style(curve.axis);
        let phases = continuous_phases(&curve.points);
        let with_phases = || curve.points.iter().zip(&phases);
        let at = |p: &GainPoint, phase_rad: f64| (p.freq_hz.log10(), phase_rad.to_degrees());
        let line = with_phases().map(|(p, (model_rad, _))| at(p, *model_rad)).collect();
        let measured = with_phases().filter(|(p, _)| p.coherence >= MIN_COHERENCE);
        let dots = measured.map(|(p, (_, phase_rad))| at(p, *phase_rad));
        let dots = Series::dots(name, colour, dots.collect()).marked(Mark::Dots(dot_size(colour)));
        chart.with(Series::line("", colour, line).marked(Mark::Line(1.0))).with(dots)
    })
}

/// Ticks at these multiples of powers of ten, at their logarithms.
fn ticks(powers: std::ops::RangeInclusive<i32>, multiples: &[f64]) -> Vec<Tick> {
    let tick = |multiple: f64, power: i32| {
        let (value, decimals) = (multiple * 10_f64.powi(power), usize::try_from(-power).unwrap_or(0));
        Tick { at: value.log10(), label: format!("{value:.decimals$}") }
    };
    powers.flat_map(|power| multiples.iter().map(move |multiple| tick(*multiple, power))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_at_the_logarithms_of_their_labels() {
        let ticks = ticks(-2..=1, &[1.0, 2.0, 5.0]);
        let labels: Vec<&str> = ticks.iter().map(|tick| tick.label.as_str()).collect();
        assert_eq!(labels, ["0.01", "0.02", "0.05", "0.1", "0.2", "0.5", "1", "2", "5", "10", "20", "50"]);
        assert!(
            ticks.iter().all(|tick| (10_f64.powf(tick.at) / tick.label.parse::<f64>().unwrap() - 1.0).abs() < 1e-9)
        );
    }
}
