use super::Coverage;
use crate::report::plot::{Chart, Colour, Figure, Series};

/// Density by elevation, and the share of the sphere seen by time.
pub fn coverage_figure(coverage: &Coverage) -> Figure {
    let density = Series::line("", Colour::Estimate, coverage.by_elevation.clone());
    let seen = Series::line("", Colour::Estimate, coverage.over_time.clone());
    Figure::of(vec![
        Chart::new("Where beams go", "Elevation (degrees)", "Beams per sr and s").with(density).starting_at_zero(),
        Chart::new("How soon", "Time (s)", "Share of the sphere seen").with(seen).starting_at_zero(),
    ])
}
