//! Gain curves as CSV.

use super::{GainCurve, SwingStudy, axis_name};
use std::fmt::Write;

/// CSV with one row per frequency: `axis,freq_hz,gain,coherence,gain_model,gain_sigma`.
pub fn csv(curves: &[GainCurve]) -> String {
    let mut text = "axis,freq_hz,gain,coherence,gain_model,gain_sigma\n".to_owned();
    for curve in curves {
        let axis = axis_name(curve.axis);
        for p in &curve.points {
            // Writing to a string does not fail.
            let _ = writeln!(
                text,
                "{axis},{:.6},{:.6e},{:.6},{:.6e},{:.3e}",
                p.freq_hz, p.gain, p.coherence, p.gain_model, p.gain_sigma
            );
        }
    }
    text
}

/// CSV with one row per amplitude: `axis,base_rms,swing_rms_deg,swing_most_deg,peak_hz,peak_gain,coherence`.
///
/// The last three are empty without a peak.
pub fn swing_csv(studies: &[SwingStudy]) -> String {
    let mut text = "axis,base_rms,swing_rms_deg,swing_most_deg,peak_hz,peak_gain,coherence\n".to_owned();
    let or_empty = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.5}"));
    for study in studies {
        for p in &study.points {
            let _ = writeln!(
                text,
                "{},{:.5},{:.4},{:.4},{},{},{}",
                axis_name(study.axis),
                p.base_rms,
                p.swing_rms_deg,
                p.swing_most_deg,
                or_empty(p.peak.map(|peak| peak.freq_hz)),
                or_empty(p.peak.map(|peak| peak.gain)),
                or_empty(p.coherence),
            );
        }
    }
    text
}
