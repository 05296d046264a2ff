//! The result of a gain measurement as a document.

use super::bode::LOWEST_SHARE;
use super::curve::{MIN_COHERENCE, SIGMAS_95, continuous_phases, wrapped};
use super::table::{name_of, peak_table, swing_table};
use super::{GainCurve, GainPoint, SwingStudy, axis_name, swing_figure};
use zsim_dynamics::HeadModel;
use zsim_motion::Axis;
use zsim_report::page::{Abscissa, AxisGains, Chart, ChartGroup, Curve, CurveStyle, Interactive, Ordinate, Section};
use zsim_report::plot::PlotError;
use zsim_report::{Content, Document, Plot, Table, capitalised};

/// Maximum number of frequencies of a chart; more are thinned, and the largest gain of each interval is kept.
const MAX_LINES: usize = 2_000;

/// The result of a gain measurement of the head `name`.
///
/// # Errors
/// When a plot fails.
pub fn document(
    name: &str,
    head: &HeadModel,
    curves: &[GainCurve],
    swings: &[SwingStudy],
) -> Result<Document, PlotError> {
    let mut document = Document::new(format!("Gains of {name}"), summary(head, curves));
    document.heading("Highest peak of each axis");
    document.add(peak_table(curves));
    document.heading("Modes of the head at rest");
    document.add_detail(modes(head));
    document.add_detail(Interactive::Gains(curves.iter().map(axis_gains).collect()));
    if !swings.is_empty() {
        document.heading("By swing amplitude");
        document.add(swing_table(swings));
        let ends =
            swings.iter().filter_map(|study| Some(format!("{}: ended {}", name_of(study.axis), study.ended.as_ref()?)));
        document.add(Content::List(ends.collect()));
        let svg = swing_figure(swings).svg()?;
        let (name, address) = ("By swing amplitude".to_owned(), "plots/swing.svg".to_owned());
        document.add(Content::Plots(vec![Plot { name, address, svg }]));
    }
    let contacts = curves.iter().map(|curve| (curve.axis, curve.coil_contact));
    let in_swings = swings.iter().flat_map(|study| study.points.iter().map(|p| (study.axis, p.coil_contact)));
    let warnings = contacts.chain(in_swings).filter_map(|(axis, contact)| Some((axis, contact?)));
    let warnings = warnings.map(|(axis, contact)| format!("{}: {}", name_of(axis), contact.warning())).collect();
    document.heading("Warnings");
    document.add(Content::List(warnings));
    document.footer =
        "Charts: drag to zoom, double-click to zoom out, arrow keys move the cursor. All values are in gains.csv."
            .to_owned();
    Ok(document)
}

/// Natural frequencies, the highest peak, and the difference between simulation and closed form.
fn summary(head: &HeadModel, curves: &[GainCurve]) -> String {
    let modes: Vec<String> = head.linear_modes().iter().map(|mode| format!("{:.2}", mode.frequency_hz)).collect();
    let mut text = format!("Natural frequencies: {} Hz.", modes.join(", "));
    let peaks = curves.iter().filter_map(|curve| Some((curve.axis, curve.peak?, curve.peak_model)));
    let peaks: Vec<_> = peaks.collect();
    if let Some((axis, peak, _)) = peaks.iter().max_by(|a, b| a.1.gain.total_cmp(&b.1.gain)) {
        text += &format!(" Highest gain: {:.1} at {:.2} Hz, {}.", peak.gain, peak.freq_hz, axis_title(*axis));
    }
    let differences = peaks.iter().filter_map(|(_, peak, model)| Some((peak.gain / (*model)?.gain - 1.0).abs()));
    if let Some(largest) = differences.reduce(f64::max) {
        text += &format!(" Simulated and closed-form peak gains differ by at most {:.1} %.", 100.0 * largest);
    }
    text
}

/// The modes, slowest first.
fn modes(head: &HeadModel) -> Table {
    let rows = head.linear_modes().iter().map(|mode| {
        vec![
            mode.kind.name().to_owned(),
            format!("{:.3}", mode.frequency_hz),
            format!("{:.3}", mode.damped_frequency_hz()),
            format!("{:.4}", mode.damping_ratio),
        ]
    });
    Table::new(["mode", "natural Hz", "damped Hz", "damping ratio"], rows)
}

/// Quantity and direction of an axis.
fn axis_title(axis: Axis) -> String {
    let quantity = if axis.is_rotation() { "angular rate about" } else { "acceleration along" };
    format!("{quantity} {}", ["x", "y", "z"][axis as usize % 3])
}

fn axis_gains(curve: &GainCurve) -> AxisGains {
    let points = with_model_peak(&thinned(&curve.points), curve);
    let axis = axis_name(curve.axis);
    let groups = [vec![gain_chart(&points)], vec![phase_chart(&points), coherence_chart(&points)]];
    AxisGains {
        axis,
        title: capitalised(&axis_title(curve.axis)),
        groups: groups.map(|charts| ChartGroup { section: Section::Axis(axis), charts }).into(),
    }
}

/// At most [`MAX_LINES`] points, evenly distributed over the logarithm of the frequency.
fn thinned(points: &[GainPoint]) -> Vec<GainPoint> {
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return Vec::new() };
    if points.len() <= MAX_LINES {
        return points.to_vec();
    }
    let per_log = MAX_LINES as f64 / (last.freq_hz / first.freq_hz).ln();
    let interval = |p: &GainPoint| ((p.freq_hz / first.freq_hz).ln() * per_log) as usize;
    let intervals = points.chunk_by(|a, b| interval(a) == interval(b));
    intervals.filter_map(|some| some.iter().max_by(|a, b| a.gain.total_cmp(&b.gain)).copied()).collect()
}

/// The points, and the peak of the closed form between them, where only the closed form has a value.
fn with_model_peak(points: &[GainPoint], curve: &GainCurve) -> Vec<GainPoint> {
    let mut all = points.to_vec();
    let Some(peak) = curve.peak_model else { return all };
    let after = all.partition_point(|p| p.freq_hz < peak.freq_hz);
    if let [before, next] = &points[after.saturating_sub(1)..points.len().min(after + 1)] {
        let share = (peak.freq_hz - before.freq_hz) / (next.freq_hz - before.freq_hz);
        let turn = wrapped(next.phase_model_rad - before.phase_model_rad);
        let (freq_hz, gain_model) = (peak.freq_hz, peak.gain);
        let phase_model_rad = before.phase_model_rad + share * turn;
        let [gain, gain_sigma, coherence, phase_rad] = [f64::NAN; 4];
        let at_peak = GainPoint { freq_hz, gain, coherence, gain_sigma, gain_model, phase_rad, phase_model_rad };
        all.insert(after, at_peak);
    }
    all
}

fn chart(title: &str, label: &str, ordinate: Ordinate, points: &[GainPoint], curves: Vec<Curve>) -> Chart {
    Chart {
        title: title.to_owned(),
        label: label.to_owned(),
        abscissa: Abscissa::Frequency,
        ordinate,
        x: points.iter().map(|p| p.freq_hz).collect(),
        curves,
    }
}

fn curve(name: &str, style: CurveStyle, points: &[GainPoint], value: impl Fn(&GainPoint) -> f64) -> Curve {
    Curve { name: name.to_owned(), style, values: points.iter().map(value).collect() }
}

/// A measured value; NaN if the coherence is too low.
fn measured(p: &GainPoint, value: f64) -> f64 {
    if p.coherence >= MIN_COHERENCE { value } else { f64::NAN }
}

fn gain_chart(points: &[GainPoint]) -> Chart {
    let edge =
        |sign: f64| move |p: &GainPoint| f64::max(p.gain + sign * SIGMAS_95 * p.gain_sigma, LOWEST_SHARE * p.gain);
    let curves = vec![
        curve("95 % band", CurveStyle::BandTop, points, edge(1.0)),
        curve("lower edge", CurveStyle::BandBottom, points, edge(-1.0)),
        curve("simulated", CurveStyle::Measured, points, |p| measured(p, p.gain)),
        curve("closed form", CurveStyle::Model, points, |p| p.gain_model),
    ];
    chart("Gain", "Head over base", Ordinate::Logarithmic, points, curves)
}

/// The phase without jumps: that of the closed form is continuous, and the measured one is within half a turn of it.
fn phase_chart(points: &[GainPoint]) -> Chart {
    let phases = continuous_phases(points);
    let model = phases.iter().map(|(model_rad, _)| model_rad.to_degrees()).collect();
    let simulated = points.iter().zip(&phases).map(|(p, (_, phase_rad))| measured(p, *phase_rad).to_degrees());
    let curves = vec![
        Curve { name: "simulated".to_owned(), style: CurveStyle::Measured, values: simulated.collect() },
        Curve { name: "closed form".to_owned(), style: CurveStyle::Model, values: model },
    ];
    chart("Phase", "Phase (\u{b0})", Ordinate::Degrees, points, curves)
}

fn coherence_chart(points: &[GainPoint]) -> Chart {
    let curves = vec![curve("simulated", CurveStyle::Measured, points, |p| p.coherence)];
    chart("Coherence", "Coherence", Ordinate::Linear, points, curves)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// A resonance at 1 Hz with a damping ratio of 2 %, whose phase falls from 0 to -180 degrees.
    fn resonance(freq_hz: f64) -> GainPoint {
        let response =
            nalgebra::Complex::new(1.0, 0.0) / nalgebra::Complex::new(1.0 - freq_hz * freq_hz, 2.0 * 0.02 * freq_hz);
        let (gain, phase_rad) = response.to_polar();
        GainPoint {
            freq_hz,
            gain,
            coherence: 1.0,
            gain_sigma: 0.0,
            gain_model: gain,
            phase_rad,
            phase_model_rad: phase_rad,
        }
    }

    #[test]
    fn a_thinned_curve_keeps_its_peak() {
        let points: Vec<GainPoint> = (1..=40_000).map(|k| resonance(f64::from(k) * 2.5e-4)).collect();
        let kept = thinned(&points);
        assert!(kept.len() <= MAX_LINES + 1, "{}", kept.len());
        assert!(kept.windows(2).all(|pair| pair[0].freq_hz < pair[1].freq_hz));
        // The highest peak of this resonance is 1 / (2 zeta sqrt(1 - zeta^2)) = 25.005.
        let largest = kept.iter().map(|p| p.gain).fold(0.0, f64::max);
        assert!((largest - 25.005).abs() < 0.01, "{largest}");
    }

    #[test]
    fn a_phase_that_passes_half_a_turn_does_not_jump() {
        // Two resonances in series: the phase falls to -360 degrees, the argument jumps to +180 on the way.
        let points: Vec<GainPoint> = (1..400)
            .map(|k| {
                let p = resonance(f64::from(k) * 0.01);
                let twice = wrapped(2.0 * p.phase_rad);
                GainPoint { phase_rad: twice + if k % 2 == 0 { TAU } else { 0.0 }, phase_model_rad: twice, ..p }
            })
            .collect();
        let chart = phase_chart(&points);
        for curve in &chart.curves {
            let largest = curve.values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
            assert!(largest < 90.0, "{}: {largest}", curve.name);
            assert!((curve.values.last().unwrap() + 360.0).abs() < 5.0, "{}", curve.name);
        }
    }
}
