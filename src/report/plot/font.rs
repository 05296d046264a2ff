//! The font of all plots; it is bundled, so that plots do not depend on installed fonts.

use super::PlotError;
use plotters::style::{FontStyle, register_font};

/// Font sizes, points.
pub(super) const TEXT: f64 = 12.0;
pub(super) const SMALL_TEXT: f64 = 11.0;

/// Room for labels in a font that is wider than the bundled one: a viewer shows an SVG with its own fonts.
pub(super) const WIDER_FONT: f64 = 1.15;

/// Family name of the font; an SVG contains it, and the viewer uses its own sans-serif font.
pub(super) const NAME: &str = "sans-serif";

/// Font size in plotters divided by the em size, SVG backend: it divides the size by this constant.
pub(super) const SVG_SIZE_PER_EM: f64 = 1.24;

/// Font size in plotters divided by the em size, bitmap backend: the size is ascent plus descent, for Roboto
/// (1900 + 500) / 2048 em.
pub(super) const BITMAP_SIZE_PER_EM: f64 = 1.172;

static ROBOTO: &[u8] = include_bytes!("fonts/Roboto-Regular.ttf");

/// Registers the font with plotters; repeated calls have no effect.
pub(super) fn register() -> Result<(), PlotError> {
    register_font(NAME, FontStyle::Normal, ROBOTO)
        .map_err(|_| PlotError::Drawing("the bundled font cannot be read".to_owned()))
}
