//! What was seen, as CSV.

use super::Coverage;
use std::fmt::Write;

/// `time_s,fraction_seen`, a line a scan.
pub fn over_time_csv(coverage: &Coverage) -> String {
    let mut text = "time_s,fraction_seen\n".to_owned();
    for (time_s, seen) in &coverage.over_time {
        // Writing to a string does not fail.
        let _ = writeln!(text, "{time_s:.6},{seen:.6}");
    }
    text
}

/// `azimuth_low_deg,azimuth_high_deg,elevation_low_deg,elevation_high_deg,beams_per_sr_s`, a line a cell of the sphere.
pub fn density_csv(coverage: &Coverage) -> String {
    let mut text = "azimuth_low_deg,azimuth_high_deg,elevation_low_deg,elevation_high_deg,beams_per_sr_s\n".to_owned();
    for cell in &coverage.cells {
        let ((left, right), (low, high)) = (cell.azimuth_deg, cell.elevation_deg);
        let _ = writeln!(text, "{left:.4},{right:.4},{low:.4},{high:.4},{:.3}", cell.beams_per_sr_s);
    }
    text
}
