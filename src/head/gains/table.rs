//! Gain curves as CSV, and their peaks as a table.

use super::{GainCurve, SwingStudy, axis_name};
use std::fmt::Write;
use zsim_dynamics::Peak;
use zsim_report::page::PageTable;
use zsim_report::quantity_name;

/// The highest peak of each curve, simulated and in closed form: one row per axis.
pub fn peak_table(curves: &[GainCurve]) -> PageTable {
    let peak = |peak: Option<Peak>| match peak {
        Some(p) => [format!("{:.3}", p.freq_hz), format!("{:.2}", p.gain)],
        None => ["-".to_owned(), "-".to_owned()],
    };
    let row = |curve: &GainCurve| {
        let ([hz, gain], [model_hz, model_gain]) = (peak(curve.peak), peak(curve.peak_model));
        vec![
            quantity_name(axis_name(curve.axis)),
            hz,
            gain,
            model_hz,
            model_gain,
            format!("{:.4}", min_coherence(curve)),
        ]
    };
    let header = ["axis", "peak Hz", "gain", "closed form Hz", "gain", "min coherence"];
    PageTable {
        title: "Highest peak of each axis".to_owned(),
        header: header.map(str::to_owned).to_vec(),
        rows: curves.iter().map(row).collect(),
        ..PageTable::default()
    }
}

/// The minimum coherence of a curve, 0 to 1.
pub fn min_coherence(curve: &GainCurve) -> f64 {
    curve.points.iter().map(|p| p.coherence).fold(1.0, f64::min)
}

/// CSV with one row per frequency: `axis,freq_hz,gain,coherence,gain_model,gain_sigma,phase_deg,phase_model_deg`.
pub fn csv(curves: &[GainCurve]) -> String {
    let mut text = "axis,freq_hz,gain,coherence,gain_model,gain_sigma,phase_deg,phase_model_deg\n".to_owned();
    for curve in curves {
        let axis = axis_name(curve.axis);
        for p in &curve.points {
            // Writing to a string does not fail.
            let _ = writeln!(
                text,
                "{axis},{:.6},{:.6e},{:.6},{:.6e},{:.3e},{:.3},{:.3}",
                p.freq_hz,
                p.gain,
                p.coherence,
                p.gain_model,
                p.gain_sigma,
                p.phase_rad.to_degrees(),
                p.phase_model_rad.to_degrees()
            );
        }
    }
    text
}

/// CSV with one row per amplitude: `axis,base_rms,swing_rms_deg,swing_most_deg,peak_hz,peak_gain,peak_gain_sigma,coherence`.
///
/// The last four are empty without a peak.
pub fn swing_csv(studies: &[SwingStudy]) -> String {
    let mut text =
        "axis,base_rms,swing_rms_deg,swing_most_deg,peak_hz,peak_gain,peak_gain_sigma,coherence\n".to_owned();
    let or_empty = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.5}"));
    for study in studies {
        for p in &study.points {
            let _ = writeln!(
                text,
                "{},{:.5},{:.4},{:.4},{},{},{},{}",
                axis_name(study.axis),
                p.base_rms,
                p.swing_rms_deg,
                p.swing_most_deg,
                or_empty(p.peak.map(|peak| peak.freq_hz)),
                or_empty(p.peak.map(|peak| peak.gain)),
                or_empty(p.peak_gain_sigma),
                or_empty(p.coherence),
            );
        }
    }
    text
}
