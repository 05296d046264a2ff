//! Figures of gain curves.

use super::curve::{MIN_COHERENCE, SIGMAS_95};
use super::{GainCurve, GainPoint, SwingPoint, SwingStudy};
use zsim_motion::Axis;
use zsim_report::plot::{BandPoint, Chart, Colour, Figure, Mark, Series};

/// Panels of the paper's figure 3: title, label, axes.
pub(super) const PANELS: [(&str, &str, &[Axis]); 3] = [
    ("Angular rates; lines: closed form", "Gain, rotation", &[Axis::Roll, Axis::Pitch, Axis::Yaw]),
    ("Horizontal accelerations; lines: closed form", "Gain, x and y", &[Axis::X, Axis::Y]),
    ("Vertical acceleration; line: closed form", "Gain, z", &[Axis::Z]),
];

/// Gains in three charts with the linear axes of the paper, rotations first: measurement as dots with 95 % bands, closed form as
/// lines.
pub fn gain_panels(curves: &[GainCurve]) -> Vec<Chart> {
    let panels = PANELS.iter().map(|(title, label, axes)| {
        let shown = curves.iter().filter(|curve| axes.contains(&curve.axis));
        let chart = Chart::new(title, "Frequency (Hz)", label).starting_at_zero();
        shown.fold(chart, |chart, curve| with_curve(chart, curve, 0.0, |x| x))
    });
    panels.collect()
}

/// Adds a curve to a chart whose axes have the scale `scaled`; the lower edge of the band is at least `lowest` of the gain.
pub(super) fn with_curve(chart: Chart, curve: &GainCurve, lowest: f64, scaled: fn(f64) -> f64) -> Chart {
    let (name, colour) = style(curve.axis);
    let point = |(freq_hz, gain): (f64, f64)| Some((scaled(freq_hz), scaled(gain))).filter(|(_, y)| y.is_finite());
    // The peak may be between two spectral lines.
    let peak = curve.peak_model.map(|peak| (peak.freq_hz, peak.gain));
    let lines = curve.points.iter().map(|p| (p.freq_hz, p.gain_model)).chain(peak);
    let mut model: Vec<_> = lines.filter_map(point).collect();
    model.sort_by(|a, b| a.0.total_cmp(&b.0));
    let measured = || curve.points.iter().filter(|p| p.coherence >= MIN_COHERENCE && scaled(p.gain).is_finite());
    let dots = measured().map(|p| (scaled(p.freq_hz), scaled(p.gain))).collect();
    let ends = |p: &GainPoint| BandPoint {
        x: scaled(p.freq_hz),
        low: scaled((p.gain - SIGMAS_95 * p.gain_sigma).max(lowest * p.gain)),
        high: scaled(p.gain + SIGMAS_95 * p.gain_sigma),
    };
    let dots = Series::dots(name, colour, dots).marked(Mark::Dots(dot_size(colour)));
    chart
        .with(Series::line("", colour, model).marked(Mark::Line(1.0)))
        .with(dots.with_band(measured().map(ends).collect()))
}

/// Coherence in the same charts as [`gain_panels`].
pub fn coherence_figure(curves: &[GainCurve]) -> Figure {
    Figure::of(coherence_panels(curves))
}

/// Charts of [`coherence_figure`], rotations first.
pub fn coherence_panels(curves: &[GainCurve]) -> Vec<Chart> {
    let panels = PANELS.iter().map(|(_, label, axes)| {
        let title = label.replace("Gain", "Coherence");
        let shown = curves.iter().filter(|curve| axes.contains(&curve.axis));
        shown.fold(Chart::new(&title, "Frequency (Hz)", "Coherence").starting_at_zero(), |chart, curve| {
            let (name, colour) = style(curve.axis);
            chart.with(Series::line(name, colour, curve.points.iter().map(|p| (p.freq_hz, p.coherence)).collect()))
        })
    });
    panels.collect()
}

/// Resonance frequency, peak gain and coherence over the swing amplitude.
pub fn swing_figure(studies: &[SwingStudy]) -> Figure {
    let chart = |label: &str, value: fn(&SwingPoint) -> Option<f64>, sigma: fn(&SwingPoint) -> Option<f64>| {
        let empty = Chart::new("", "Swing amplitude of the head, RMS (°)", label);
        studies.iter().fold(empty, |chart, study| {
            let (name, colour) = style(study.axis);
            let points: Vec<_> = study.points.iter().filter_map(|p| Some((p.swing_rms_deg, value(p)?))).collect();
            let mark = if study.axis.is_rotation() { Mark::Line(1.5) } else { Mark::Dashes(1.5) };
            let ends = |p: &SwingPoint| {
                let (value, half) = (value(p)?, SIGMAS_95 * sigma(p)?);
                Some(BandPoint { x: p.swing_rms_deg, low: (value - half).max(0.0), high: value + half })
            };
            let band = study.points.iter().filter_map(ends).collect();
            let dots = Series::dots("", colour, points.clone()).marked(Mark::Dots(4.0)).with_band(band);
            chart.with(Series::line(name, colour, points).marked(mark)).with(dots)
        })
    };
    Figure::of(vec![
        chart("Resonance (Hz)", |p| p.peak.map(|peak| peak.freq_hz), |_| None),
        chart("Peak gain, 95 % band", |p| p.peak.map(|peak| peak.gain), |p| p.peak_gain_sigma).starting_at_zero(),
        chart("Coherence at the peak", |p| p.coherence, |_| None),
    ])
}

/// Size of the dots: x and y of a round spring coincide, and the curve drawn first has larger ones.
pub(super) fn dot_size(colour: Colour) -> f64 {
    if colour == Colour::Estimate { 4.5 } else { 2.5 }
}

/// Name and colour of an axis's curve.
pub(super) fn style(axis: Axis) -> (&'static str, Colour) {
    let name = ["x", "y", "z", "about x", "about y", "about z"][axis as usize];
    (name, [Colour::Estimate, Colour::Second, Colour::Third][axis as usize % 3])
}
