//! Gain and phase over frequency on logarithmic axes.

use super::curve::{MIN_COHERENCE, SIGMAS_95};
use super::figure::{PANELS, dot_size, style};
use super::{GainCurve, GainPoint};
use std::f64::consts::{PI, TAU};
use zsim_report::plot::{BandPoint, Chart, Figure, Mark, Series, Tick};

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
    let point = |freq_hz: f64, gain: f64| (gain > 0.0).then(|| (freq_hz.log10(), gain.log10()));
    curves.iter().fold(chart, |chart, curve| {
        let (name, colour) = style(curve.axis);
        // The peak may be between two spectral lines.
        let peak = curve.peak_model.map(|peak| (peak.freq_hz, peak.gain));
        let lines = curve.points.iter().map(|p| (p.freq_hz, p.gain_model)).chain(peak);
        let mut model: Vec<_> = lines.filter_map(|(freq_hz, gain)| point(freq_hz, gain)).collect();
        model.sort_by(|a, b| a.0.total_cmp(&b.0));
        let ends = |p: &GainPoint| BandPoint {
            x: p.freq_hz.log10(),
            low: (p.gain - SIGMAS_95 * p.gain_sigma).max(LOWEST_SHARE * p.gain).log10(),
            high: (p.gain + SIGMAS_95 * p.gain_sigma).log10(),
        };
        let measured = || curve.points.iter().filter(|p| p.coherence >= MIN_COHERENCE && p.gain > 0.0);
        let dots = measured().filter_map(|p| point(p.freq_hz, p.gain)).collect();
        let dots = Series::dots(name, colour, dots).marked(Mark::Dots(dot_size(colour)));
        chart
            .with(Series::line("", colour, model).marked(Mark::Line(1.0)))
            .with(dots.with_band(measured().map(ends).collect()))
    })
}

fn phase_chart(label: &str, curves: &[&GainCurve]) -> Chart {
    curves.iter().fold(over_frequency("", &format!("{label} (°)")), |chart, curve| {
        let (name, colour) = style(curve.axis);
        let model = unwrapped(curve.points.iter().map(|p| p.phase_model_rad));
        let with_model = || curve.points.iter().zip(&model);
        let line = with_model().map(|(p, phase_rad)| (p.freq_hz.log10(), phase_rad.to_degrees())).collect();
        // The turn of the measured phase that is the nearest to the model.
        let dots = with_model().filter(|(p, _)| p.coherence >= MIN_COHERENCE).map(|(p, phase_rad)| {
            (p.freq_hz.log10(), (phase_rad + wrapped(p.phase_rad - p.phase_model_rad)).to_degrees())
        });
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

/// An angle from -pi to pi.
fn wrapped(angle_rad: f64) -> f64 {
    (angle_rad + PI).rem_euclid(TAU) - PI
}

/// Phases without jumps by a turn.
fn unwrapped(phases_rad: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut before: Option<f64> = None;
    phases_rad
        .map(|phase_rad| {
            let near = before.map_or(phase_rad, |before| before + wrapped(phase_rad - before));
            *before.insert(near)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unwrapped_phases_have_no_jump_and_are_the_same_angles() {
        // A delay: the phase falls by 0.4 rad per line, through two turns.
        let true_rad: Vec<f64> = (0..40).map(|k| -0.4 * f64::from(k)).collect();
        let found = unwrapped(true_rad.iter().map(|phase_rad| wrapped(*phase_rad)));
        assert!(found.iter().zip(&true_rad).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}");
    }

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
