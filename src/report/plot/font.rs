//! The one font of all plots, bundled, so that no machine's fonts matter.

use super::PlotError;
use plotters::style::{FontStyle, register_font};

/// The name it goes by; an SVG says it, so that a viewer takes its own font of this kind.
pub(super) const NAME: &str = "sans-serif";

/// What plotters calls a font's size, by the size of an em: its SVG backend divides by this.
pub(super) const SIZE_OF_EM_IN_SVG: f64 = 1.24;

/// The same for pixels, where a size is that from the ascent to the descent: in Roboto (1900 + 500) / 2048 of an em.
pub(super) const SIZE_OF_EM_IN_PIXELS: f64 = 1.172;

static ROBOTO: &[u8] = include_bytes!("../../../assets/fonts/Roboto-Regular.ttf");

/// Makes the font known to plotters. To call it twice does no harm.
pub(super) fn register() -> Result<(), PlotError> {
    register_font(NAME, FontStyle::Normal, ROBOTO).map_err(|_| PlotError::Drawing("the font is damaged".to_owned()))
}
