//! What is said of a lidar's coverage.

use zsim::study::coverage::Coverage;

/// Its figures, each with its name.
pub(super) fn rows(seen: &Coverage) -> Vec<(&'static str, String)> {
    let or_dash = |x: Option<f64>, decimals: usize| x.map_or("-".to_owned(), |x| format!("{x:.decimals$}"));
    vec![
        ("share of the sphere seen", format!("{:.3}", seen.fraction_seen)),
        ("in a sweep", or_dash(seen.fraction_in_a_sweep, 3)),
        ("time of a sweep, s", or_dash(seen.sweep_s, 3)),
        ("beams per sr in a sweep", or_dash(seen.density_in_a_sweep_per_sr, 0)),
        ("beams per sr and s", format!("{:.0}", seen.density_per_sr_s.median)),
        ("time to nine tenths of it, s", format!("{:.2}", seen.covered_s)),
        ("share of time beyond the gyro's range", format!("{:.4}", seen.gyro.saturated)),
    ]
}
