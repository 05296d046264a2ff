//! Curves as figures.

use super::{GainCurve, GainPoint, SwingPoint, SwingStudy};
use crate::motion::Axis;
use crate::report::plot::{Chart, Colour, Figure, Mark, Series};

/// The panels of the paper's figure 3: rotations; along x and y; along z.
const PANELS: [(&str, &str, &[Axis]); 3] = [
    ("Rates of rotation; lines: closed form", "Gain, rotation", &[Axis::Roll, Axis::Pitch, Axis::Yaw]),
    ("Accelerations level; lines: closed form", "Gain, x and y", &[Axis::X, Axis::Y]),
    ("Acceleration upward; line: closed form", "Gain, z", &[Axis::Z]),
];

/// Below this coherence a gain is not drawn: nothing was measured there.
const LEAST_COHERENCE: f64 = 0.5;

/// Standard errors from a gain to the end of its band: 95 % of a normal distribution.
const BAND: f64 = 1.96;

/// The gains in three panels as in the paper: measured ones as dots with their 95 % band, over the closed form.
pub fn gain_figure(curves: &[GainCurve]) -> Figure {
    Figure::of(gain_panels(curves))
}

/// The charts of [`gain_figure`], rotations first.
pub fn gain_panels(curves: &[GainCurve]) -> Vec<Chart> {
    let panels = PANELS.iter().map(|(title, label, axes)| {
        let shown = curves.iter().filter(|curve| axes.contains(&curve.axis));
        shown.fold(Chart::new(title, "Frequency (Hz)", label).starting_at_zero(), |chart, curve| {
            let (name, colour) = named(curve.axis);
            // x and y of a round spring lie on each other: the one behind has the larger dots.
            let size = if colour == Colour::Estimate { 4.5 } else { 2.5 };
            // The peak may stand between two lines.
            let top = curve.peak_model.map(|peak| (peak.freq_hz, peak.gain));
            let mut model: Vec<_> = curve.points.iter().map(|p| (p.freq_hz, p.gain_model)).chain(top).collect();
            model.sort_by(|a, b| a.0.total_cmp(&b.0));
            let measured = |p: &&GainPoint| p.coherence >= LEAST_COHERENCE;
            let dots = curve.points.iter().filter(measured).map(|p| (p.freq_hz, p.gain)).collect();
            let ends =
                |p: &GainPoint| (p.freq_hz, (p.gain - BAND * p.gain_sigma).max(0.0), p.gain + BAND * p.gain_sigma);
            let band = curve.points.iter().filter(measured).map(ends).collect();
            chart
                .with(Series::line("", colour, model).marked(Mark::Line(1.0)))
                .with(Series::dots(name, colour, dots).marked(Mark::Dots(size)).with_band(band))
        })
    });
    panels.collect()
}

/// The coherence in the same panels.
pub fn coherence_figure(curves: &[GainCurve]) -> Figure {
    Figure::of(coherence_panels(curves))
}

/// The charts of [`coherence_figure`], rotations first.
pub fn coherence_panels(curves: &[GainCurve]) -> Vec<Chart> {
    let panels = PANELS.iter().map(|(_, label, axes)| {
        let title = label.replace("Gain", "Coherence");
        let shown = curves.iter().filter(|curve| axes.contains(&curve.axis));
        shown.fold(Chart::new(&title, "Frequency (Hz)", "Coherence").starting_at_zero(), |chart, curve| {
            let (name, colour) = named(curve.axis);
            chart.with(Series::line(name, colour, curve.points.iter().map(|p| (p.freq_hz, p.coherence)).collect()))
        })
    });
    panels.collect()
}

/// How resonance and gain move with the swing.
pub fn swing_figure(studies: &[SwingStudy]) -> Figure {
    let chart = |label: &str, value: fn(&SwingPoint) -> Option<f64>| {
        let empty = Chart::new("", "Swing of the head (degrees rms)", label);
        studies.iter().fold(empty, |chart, study| {
            let (name, colour) = named(study.axis);
            let points: Vec<_> = study.points.iter().filter_map(|p| Some((p.swing_rms_deg, value(p)?))).collect();
            let mark = if study.axis.is_rotation() { Mark::Line(1.5) } else { Mark::Dashes(1.5) };
            let dots = Series::dots("", colour, points.clone()).marked(Mark::Dots(4.0));
            chart.with(Series::line(name, colour, points).marked(mark)).with(dots)
        })
    };
    Figure::of(vec![
        chart("Resonance (Hz)", |p| p.peak.map(|peak| peak.freq_hz)),
        chart("Peak gain", |p| p.peak.map(|peak| peak.gain)).starting_at_zero(),
        chart("Coherence at the peak", |p| p.coherence),
    ])
}

fn named(axis: Axis) -> (&'static str, Colour) {
    match axis {
        Axis::X => ("x", Colour::Estimate),
        Axis::Y => ("y", Colour::Second),
        Axis::Z => ("z", Colour::Third),
        Axis::Roll => ("about x", Colour::Estimate),
        Axis::Pitch => ("about y", Colour::Second),
        Axis::Yaw => ("about z", Colour::Third),
    }
}
