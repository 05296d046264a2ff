//! Coverage as a document and as CSV.

use super::Coverage;
use zsim_report::{Document, Table};

/// The values of a coverage computation that other reports repeat: name and value.
pub(crate) fn main_values(seen: &Coverage) -> Vec<(&'static str, String)> {
    let or_dash = |x: Option<f64>, decimals: usize| x.map_or("-".to_owned(), |x| format!("{x:.decimals$}"));
    vec![
        ("observed fraction of the sphere", format!("{:.3}", seen.fraction_seen)),
        ("observed fraction in one sweep", or_dash(seen.fraction_in_a_sweep, 3)),
        ("sweep time, s", or_dash(seen.sweep_s, 3)),
        ("beams per sr in one sweep, median", or_dash(seen.density_in_a_sweep_per_sr, 0)),
        ("beams per sr and s, median", format!("{:.0}", seen.density_per_sr_s.median)),
        ("time to 90 % of the observed part, s", format!("{:.2}", seen.covered_s)),
        ("fraction of time above the gyro range", format!("{:.4}", seen.gyro.saturated)),
    ]
}

/// All values of a coverage computation.
pub fn document(seen: &Coverage) -> Document {
    let (density, gyro) = (&seen.density_per_sr_s, &seen.gyro);
    let mut rows = main_values(seen);
    rows.extend([
        ("time to half of the observed part, s", format!("{:.2}", seen.half_covered_s)),
        ("beams per sr and s, mean and 10th percentile", format!("{:.0}, {:.0}", density.mean, density.p10)),
        ("elevation range of the forward beam (95 %), deg", format!("{:.1}", seen.field_of_view_deg)),
        ("maximum tilt of the scan plane, deg", format!("{:.1}", seen.most_tilt_deg)),
        ("maximum rate on an axis, deg/s", format!("{:.0} of {:.0}", gyro.most_deg_per_s, gyro.limit_deg_per_s)),
        ("99th percentile of the rate, deg/s", format!("{:.0}", gyro.p99_deg_per_s)),
    ]);
    let mut document = Document::new("Coverage", "");
    document.add(Table::facts(rows));
    document
}

/// The content of `coverage.csv`: one row per scan.
pub fn over_time_csv(coverage: &Coverage) -> String {
    let row = |(time_s, fraction): &(f64, f64)| vec![format!("{time_s:.6}"), format!("{fraction:.6}")];
    Table::new(["time_s", "fraction_seen"], coverage.over_time.iter().map(row)).csv()
}

/// The content of `density.csv`: one row per cell.
pub fn density_csv(coverage: &Coverage) -> String {
    let rows = coverage.cells.iter().map(|cell| {
        let ((left, right), (low, high)) = (cell.azimuth_deg, cell.elevation_deg);
        let limits = [left, right, low, high].map(|deg| format!("{deg:.4}"));
        [&limits[..], &[format!("{:.3}", cell.beams_per_sr_s)]].concat()
    });
    let header = ["azimuth_low_deg", "azimuth_high_deg", "elevation_low_deg", "elevation_high_deg", "beams_per_sr_s"];
    Table::new(header, rows).csv()
}
