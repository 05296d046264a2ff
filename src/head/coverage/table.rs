//! Coverage as CSV.

use super::Coverage;
use std::fmt::Write;

/// CSV with one row per scan: `time_s,fraction_seen`.
pub fn over_time_csv(coverage: &Coverage) -> String {
    let mut text = "time_s,fraction_seen\n".to_owned();
    for (time_s, fraction) in &coverage.over_time {
        // Writing to a string does not fail.
        let _ = writeln!(text, "{time_s:.6},{fraction:.6}");
    }
    text
}

/// CSV with one row per cell: `azimuth_low_deg,azimuth_high_deg,elevation_low_deg,elevation_high_deg,beams_per_sr_s`.
pub fn density_csv(coverage: &Coverage) -> String {
    let mut text = "azimuth_low_deg,azimuth_high_deg,elevation_low_deg,elevation_high_deg,beams_per_sr_s\n".to_owned();
    for cell in &coverage.cells {
        let ((left, right), (low, high)) = (cell.azimuth_deg, cell.elevation_deg);
        let _ = writeln!(text, "{left:.4},{right:.4},{low:.4},{high:.4},{:.3}", cell.beams_per_sr_s);
    }
    text
}
