//! Plots as SVG and PNG.
//!
//! A [`Figure`] has one or more [`Chart`]s; a chart has [`Series`] on a pair of axes. Legends are above the axes, so that
//! they do not cover data; axis labels include the unit. This module lays out axes and legends; plotters only draws
//! primitives.

mod axis;
mod canvas;
mod chart;
mod figure;
mod frame;
mod legend;
mod merged_lines;
mod palette;
mod raster;

pub use canvas::PlotError;
pub use chart::{BandPoint, Cell, Cells, Chart, Mark, Series, SignedDot, SignedDots, Tick, robust_range};
pub use figure::Figure;
pub use palette::Colour;
