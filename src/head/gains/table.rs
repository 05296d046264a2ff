//! Gain curves and their peaks as tables.

use super::{GainCurve, SwingStudy, axis_name};
use zsim_dynamics::Peak;
use zsim_motion::Axis;
use zsim_report::{Table, quantity_name};

/// Name of an axis for tables.
pub(super) fn name_of(axis: Axis) -> String {
    quantity_name(axis_name(axis))
}

/// A number with these decimals, or a dash.
fn or_dash(x: Option<f64>, decimals: usize) -> String {
    x.map_or("-".to_owned(), |x| format!("{x:.decimals$}"))
}

/// The highest peak of each curve, simulated and in closed form: one row per axis.
pub(super) fn peak_table(curves: &[GainCurve]) -> Table {
    let peak = |peak: Option<Peak>| [or_dash(peak.map(|peak| peak.freq_hz), 3), or_dash(peak.map(|peak| peak.gain), 2)];
    let row = |curve: &GainCurve| {
        let coherence = format!("{:.4}", min_coherence(curve));
        [&[name_of(curve.axis)][..], &peak(curve.peak), &peak(curve.peak_model), &[coherence]].concat()
    };
    Table::new(["axis", "peak Hz", "gain", "closed form Hz", "gain", "min coherence"], curves.iter().map(row))
}

/// The highest peak at each swing amplitude.
pub(super) fn swing_table(studies: &[SwingStudy]) -> Table {
    let points = studies.iter().flat_map(|study| study.points.iter().map(|p| (name_of(study.axis), p)));
    let rows = points.map(|(axis, p)| {
        vec![
            format!("{axis}, {:.1} deg", p.swing_rms_deg),
            format!("{:.1}", p.swing_most_deg),
            or_dash(p.peak.map(|peak| peak.freq_hz), 3),
            or_dash(p.peak.map(|peak| peak.gain), 2),
            or_dash(p.coherence, 3),
        ]
    });
    Table::new(["swing RMS", "max deg", "peak Hz", "gain", "coherence"], rows)
}

/// The minimum coherence of a curve, 0 to 1.
pub fn min_coherence(curve: &GainCurve) -> f64 {
    curve.points.iter().map(|p| p.coherence).fold(1.0, f64::min)
}

/// The content of `gains.csv`: one row per frequency.
pub fn csv(curves: &[GainCurve]) -> String {
    let points = curves.iter().flat_map(|curve| curve.points.iter().map(|p| (axis_name(curve.axis), p)));
    let rows = points.map(|(axis, p)| {
        vec![
            axis.to_owned(),
            format!("{:.6}", p.freq_hz),
            format!("{:.6e}", p.gain),
            format!("{:.6}", p.coherence),
            format!("{:.6e}", p.gain_model),
            format!("{:.3e}", p.gain_sigma),
            format!("{:.3}", p.phase_rad.to_degrees()),
            format!("{:.3}", p.phase_model_rad.to_degrees()),
        ]
    });
    let header = ["axis", "freq_hz", "gain", "coherence", "gain_model", "gain_sigma", "phase_deg", "phase_model_deg"];
    Table::new(header, rows).csv()
}

/// The content of `swing.csv`: one row per amplitude; the last four columns are empty without a peak.
pub fn swing_csv(studies: &[SwingStudy]) -> String {
    let or_empty = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.5}"));
    let points = studies.iter().flat_map(|study| study.points.iter().map(|p| (axis_name(study.axis), p)));
    let rows = points.map(|(axis, p)| {
        vec![
            axis.to_owned(),
            format!("{:.5}", p.base_rms),
            format!("{:.4}", p.swing_rms_deg),
            format!("{:.4}", p.swing_most_deg),
            or_empty(p.peak.map(|peak| peak.freq_hz)),
            or_empty(p.peak.map(|peak| peak.gain)),
            or_empty(p.peak_gain_sigma),
            or_empty(p.coherence),
        ]
    });
    let header =
        ["axis", "base_rms", "swing_rms_deg", "swing_most_deg", "peak_hz", "peak_gain", "peak_gain_sigma", "coherence"];
    Table::new(header, rows).csv()
}
