use super::{Coverage, CoverageCell};
use crate::report::plot::{Cell, Cells, Chart, Colour, Figure, Series};

/// Share of the cells that are darker than the darkest colour: few directions at the ends of a swing would else make
/// all others light.
const BEYOND: f64 = 0.02;

/// Density by direction and by elevation, and the share of the sphere seen by time.
pub fn coverage_figure(coverage: &Coverage) -> Figure {
    let density = Series::line("", Colour::Estimate, coverage.by_elevation.clone());
    let seen = Series::line("", Colour::Estimate, coverage.over_time.clone());
    Figure::of(vec![
        density_map(&coverage.cells),
        Chart::new("By elevation", "Elevation (degrees)", "Beams per sr and s").with(density).starting_at_zero(),
        Chart::new("How soon", "Time (s)", "Share of the sphere seen").with(seen).starting_at_zero(),
    ])
}

/// The sphere unrolled as from within, left at the left; what was never seen is white.
fn density_map(cells: &[CoverageCell]) -> Chart {
    let mut amounts: Vec<f64> = cells.iter().map(|cell| cell.beams_per_sr_s).filter(|amount| *amount > 0.0).collect();
    amounts.sort_by(f64::total_cmp);
    let most = amounts.get(((1.0 - BEYOND) * amounts.len() as f64) as usize).or(amounts.last()).copied();
    let cell = |cell: &CoverageCell| Cell {
        x: (-cell.azimuth_deg.1, -cell.azimuth_deg.0),
        y: (cell.elevation_deg.0, cell.elevation_deg.1),
        value: if cell.beams_per_sr_s > 0.0 { cell.beams_per_sr_s } else { f64::NAN },
    };
    let shown = Cells {
        unit: "beams per sr and s".to_owned(),
        range: (0.0, most.unwrap_or(1.0)),
        cells: cells.iter().map(cell).collect(),
    };
    Chart::new("Where beams go", "Bearing, clockwise from ahead (degrees)", "Elevation (degrees)")
        .between((-180.0, 180.0), (-90.0, 90.0))
        .with_cells(shown)
}
