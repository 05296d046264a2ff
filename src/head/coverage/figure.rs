//! Figure of a lidar's coverage.

use super::{Coverage, CoverageCell};
use zsim_report::plot::{Cell, Cells, Chart, Colour, Figure, Series, Tick};

/// Fraction of the cells that saturate the colour scale.
///
/// Few directions at the turning points of a swing have a very high density; scaling to them would make all others
/// pale.
const SATURATED_FRACTION: f64 = 0.02;

/// Title and label of the density of beams.
const DENSITY: &str = "Beam density (1/sr/s)";
/// Distances between ticks, degrees.
const BEARING_STEP_DEG: f64 = 45.0;
const ELEVATION_STEP_DEG: f64 = 15.0;

/// Beam density by direction and by elevation, and observed fraction of the sphere over time.
pub fn coverage_figure(coverage: &Coverage) -> Figure {
    let observed = ObservedRange::of(&coverage.cells);
    let (low, high) = observed.elevation_deg;
    let within = coverage.by_elevation.iter().copied().filter(|(elevation, _)| (low..=high).contains(elevation));
    let density = Series::line("", Colour::Estimate, within.collect());
    let fraction = Series::line("", Colour::Estimate, coverage.over_time.clone());
    Figure::of(vec![
        density_map(&coverage.cells, &observed),
        Chart::new("Beam density by elevation", "Elevation (°)", DENSITY)
            .with(density)
            .with_x_ticks(angle_ticks(observed.elevation_deg, ELEVATION_STEP_DEG))
            .starting_at_zero(),
        Chart::new("Coverage over time", "Time (s)", "Observed fraction of the sphere")
            .with(fraction)
            .starting_at_zero(),
    ])
}

/// The part of the sphere in the figure: the observed cells, extended to ticks.
struct ObservedRange {
    bearing_deg: (f64, f64),
    elevation_deg: (f64, f64),
}

impl ObservedRange {
    /// The range of the cells with beams; the whole sphere without any.
    fn of(cells: &[CoverageCell]) -> Self {
        let observed = || cells.iter().filter(|cell| cell.beams_per_sr_s > 0.0);
        let range = |of: fn(&CoverageCell) -> (f64, f64), step: f64, limit: f64| {
            let ends = observed().map(of).fold(None, |ends, (from, to)| match ends {
                None => Some((from, to)),
                Some((low, high)) => Some((from.min(low), to.max(high))),
            });
            let (low, high) = ends.unwrap_or((-limit, limit));
            (((low / step).floor() * step).max(-limit), ((high / step).ceil() * step).min(limit))
        };
        Self {
            bearing_deg: range(bearing, BEARING_STEP_DEG, 180.0),
            elevation_deg: range(|cell| cell.elevation_deg, ELEVATION_STEP_DEG, 90.0),
        }
    }
}

/// Bearing of a cell's edges, clockwise, degrees: azimuths are anticlockwise.
fn bearing(cell: &CoverageCell) -> (f64, f64) {
    (-cell.azimuth_deg.1, -cell.azimuth_deg.0)
}

/// Ticks at the multiples of `step`, degrees.
fn angle_ticks((low, high): (f64, f64), step: f64) -> Vec<Tick> {
    let (first, last) = ((low / step).ceil() as i32, (high / step).floor() as i32);
    let angles = (first..=last).map(|k| f64::from(k) * step);
    angles.map(|at| Tick { at, label: format!("{at:.0}").replace('-', "\u{2212}") }).collect()
}

/// Equirectangular map of the observed part of the sphere as viewed from inside; unobserved cells are white.
fn density_map(cells: &[CoverageCell], observed: &ObservedRange) -> Chart {
    let mut densities: Vec<f64> =
        cells.iter().map(|cell| cell.beams_per_sr_s).filter(|density| *density > 0.0).collect();
    densities.sort_by(f64::total_cmp);
    let maximum =
        densities.get(((1.0 - SATURATED_FRACTION) * densities.len() as f64) as usize).or(densities.last()).copied();
    let cell = |cell: &CoverageCell| Cell {
        x: bearing(cell),
        y: (cell.elevation_deg.0, cell.elevation_deg.1),
        value: cell.beams_per_sr_s,
    };
    let shown = Cells {
        unit: String::new(),
        range: (0.0, maximum.unwrap_or(1.0)),
        cells: cells.iter().filter(|cell| cell.beams_per_sr_s > 0.0).map(cell).collect(),
    };
    Chart::new(DENSITY, "Bearing, clockwise from ahead (°)", "Elevation (°)")
        .between(observed.bearing_deg, observed.elevation_deg)
        .with_x_ticks(angle_ticks(observed.bearing_deg, BEARING_STEP_DEG))
        .with_y_ticks(angle_ticks(observed.elevation_deg, ELEVATION_STEP_DEG))
        .with_cells(shown)
}
