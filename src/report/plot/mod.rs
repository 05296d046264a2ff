//! Plots as SVG and PNG.
//!
//! A [`Figure`] has one or more [`Chart`]s; a chart has [`Series`] on a pair of axes. Legends are above the axes, so that
//! they do not cover data; axis labels include the unit. This module lays out axes and legends; plotters only draws
//! primitives.

mod axis;
mod canvas;
mod chart;
mod figure;
mod font;
mod frame;
mod legend;
mod palette;
mod stroke;

pub use chart::{Cell, Cells, Chart, Mark, Series, SignedDots};
pub use figure::Figure;
pub use palette::Colour;

/// Error of plotting or saving a plot.
#[derive(Debug, thiserror::Error)]
pub enum PlotError {
    /// The drawing backend failed.
    #[error("cannot draw the plot: {0}")]
    Drawing(String),
    /// The file cannot be written.
    #[error("cannot write {path}: {source}")]
    File {
        /// Path of the file.
        path: String,
        /// Error of the operating system.
        source: std::io::Error,
    },
}

impl PlotError {
    fn drawing(error: impl std::fmt::Display) -> Self {
        Self::Drawing(error.to_string())
    }
}
