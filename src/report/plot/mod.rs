//! Plots as SVG and PNG.
//!
//! A [`Figure`] is one or more [`Chart`]s below each other, a chart some [`Series`] on a pair of axes. Legends stand
//! above the axes, so that they cover no data; labels carry their units. The axes are drawn here; plotters is the pen.

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

/// Why a figure is not there.
#[derive(Debug, thiserror::Error)]
pub enum PlotError {
    /// The pen refused.
    #[error("a plot cannot be drawn: {0}")]
    Drawing(String),
    /// The file cannot be written.
    #[error("{path} cannot be written: {source}")]
    File {
        /// Which file.
        path: String,
        /// Why.
        source: std::io::Error,
    },
}

impl PlotError {
    fn drawing(error: impl std::fmt::Display) -> Self {
        Self::Drawing(error.to_string())
    }
}
