//! Table of the coverage of a lidar.

use zsim_head::coverage::Coverage;

/// Rows of the table: name and value.
pub(super) fn rows(seen: &Coverage) -> Vec<(&'static str, String)> {
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
