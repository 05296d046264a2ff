//! Figure of a lidar's coverage.

use super::{Coverage, CoverageCell};
use crate::report::plot::{Cell, Cells, Chart, Colour, Figure, Series};

/// Fraction of the cells that saturate the colour scale.
///
/// Few directions at the turning points of a swing have a very high density; scaling to them would make all others
/// pale.
const SATURATED_FRACTION: f64 = 0.02;

/// Beam density by direction and by elevation, and observed fraction of the sphere over time.
pub fn coverage_figure(coverage: &Coverage) -> Figure {
    let density = Series::line("", Colour::Estimate, coverage.by_elevation.clone());
    let fraction = Series::line("", Colour::Estimate, coverage.over_time.clone());
    Figure::of(vec![
        density_map(&coverage.cells),
        Chart::new("By elevation", "Elevation (degrees)", "Beams per sr and s").with(density).starting_at_zero(),
        Chart::new("Coverage over time", "Time (s)", "Observed fraction of the sphere")
            .with(fraction)
            .starting_at_zero(),
    ])
}

/// Equirectangular map of the sphere as viewed from inside; unobserved cells are white.
fn density_map(cells: &[CoverageCell]) -> Chart {
    let mut densities: Vec<f64> =
        cells.iter().map(|cell| cell.beams_per_sr_s).filter(|density| *density > 0.0).collect();
    densities.sort_by(f64::total_cmp);
    let maximum =
        densities.get(((1.0 - SATURATED_FRACTION) * densities.len() as f64) as usize).or(densities.last()).copied();
    let cell = |cell: &CoverageCell| Cell {
        x: (-cell.azimuth_deg.1, -cell.azimuth_deg.0),
        y: (cell.elevation_deg.0, cell.elevation_deg.1),
        value: if cell.beams_per_sr_s > 0.0 { cell.beams_per_sr_s } else { f64::NAN },
    };
    let shown = Cells {
        unit: "beams per sr and s".to_owned(),
        range: (0.0, maximum.unwrap_or(1.0)),
        cells: cells.iter().map(cell).collect(),
    };
    Chart::new("Beam density", "Bearing, clockwise from ahead (degrees)", "Elevation (degrees)")
        .between((-180.0, 180.0), (-90.0, 90.0))
        .with_cells(shown)
}
