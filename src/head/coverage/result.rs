//! Settings and result of a coverage computation; the result as a document and as CSV.

use serde::Serialize;
use zsim_report::{Document, Table};

/// Settings of a coverage computation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoveragePlan {
    /// Start of the observation after the motion's start, s; skips the rest at the beginning.
    pub from_s: f64,
    /// Duration of the observation, s.
    pub duration_s: f64,
    /// Time step of the simulation, s.
    pub step_s: f64,
    /// Range of the gyroscope per axis, degrees/s.
    pub rate_limit_deg_per_s: f64,
}

impl Default for CoveragePlan {
    /// 30 s from 5 s on, steps of 1 ms, 600 degrees/s as the paper's gyroscope.
    fn default() -> Self {
        Self { from_s: 5.0, duration_s: 30.0, step_s: 1e-3, rate_limit_deg_per_s: 600.0 }
    }
}

/// Coverage of the sphere by a lidar.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Coverage {
    /// Observed fraction of the sphere.
    pub fraction_seen: f64,
    /// Mean fraction of the sphere observed per second; `None` for an observation of less than a second.
    pub fraction_in_1s: Option<f64>,
    /// Mean fraction of the sphere observed per sweep, from one turning point of the swing to the next; `None` without a
    /// complete sweep.
    pub fraction_in_a_sweep: Option<f64>,
    /// Mean duration of a sweep, s.
    pub sweep_s: Option<f64>,
    /// Beams per steradian in a sweep: median over the observed cells, mean over the sweeps.
    pub density_in_a_sweep_per_sr: Option<f64>,
    /// Beams per steradian and second over the complete observation, in the observed cells.
    pub density_per_sr_s: Density,
    /// Time until 50 % of the finally observed fraction is observed, s.
    pub half_covered_s: f64,
    /// Time until 90 % of the finally observed fraction is observed, s.
    pub covered_s: f64,
    /// Angle between the 2.5 % and 97.5 % quantiles of the forward beam's elevation, degrees.
    pub field_of_view_deg: f64,
    /// Maximum tilt of the lidar's scan plane from horizontal, degrees.
    pub most_tilt_deg: f64,
    /// Use of the gyroscope's range.
    pub gyro: GyroUsage,
    /// Elevation (degrees) and beams per steradian and second, averaged over all azimuths.
    pub by_elevation: Vec<(f64, f64)>,
    /// Time (s) and observed fraction of the sphere.
    pub over_time: Vec<(f64, f64)>,
    /// Beam density of each cell of the sphere, from the bottom up.
    #[serde(skip)]
    pub cells: Vec<CoverageCell>,
}

/// A cell of the sphere of directions; all cells have the same solid angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoverageCell {
    /// Limits in azimuth, degrees from the base's heading, positive to the left.
    pub azimuth_deg: (f64, f64),
    /// Limits in elevation, degrees above the horizon.
    pub elevation_deg: (f64, f64),
    /// Beams per steradian and second.
    pub beams_per_sr_s: f64,
}

/// Statistics of the beam density over the observed cells, beams per steradian and second.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Density {
    /// Mean.
    pub mean: f64,
    /// 10 % quantile.
    pub p10: f64,
    /// Median.
    pub median: f64,
}

/// Angular rates in comparison with a gyroscope's range.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GyroUsage {
    /// Range per axis, degrees/s.
    pub limit_deg_per_s: f64,
    /// Maximum angular rate on an axis, degrees/s.
    pub most_deg_per_s: f64,
    /// 99 % quantile over time of the largest rate among the axes, degrees/s.
    pub p99_deg_per_s: f64,
    /// Fraction of the time in which at least one axis is saturated.
    pub saturated: f64,
}

impl GyroUsage {
    /// Fraction of the range above the maximum rate; negative if the rate exceeds the range.
    pub fn range_left(&self) -> f64 {
        1.0 - self.most_deg_per_s / self.limit_deg_per_s
    }
}

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
