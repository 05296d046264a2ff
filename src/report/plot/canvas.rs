//! Drawing primitives on an SVG or bitmap backend, in points from the top left corner.
//!
//! The font of all plots is bundled, so that plots do not depend on installed fonts.

use super::palette::{INK, Rgb};
use plotters::coord::Shift;
use plotters::prelude::{DrawingArea, DrawingBackend, IntoFont, PathElement, Polygon, RGBColor, Rectangle, Text};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontTransform, IntoTextStyle, ShapeStyle};
use plotters::style::{FontStyle, register_font};
use zsim_base::printable::printable_name;

/// Font sizes, points.
pub(super) const TEXT: f64 = 12.0;
pub(super) const SMALL_TEXT: f64 = 11.0;

/// Room for labels in a font that is wider than the bundled one: a viewer shows an SVG with its own fonts.
pub(super) const WIDER_FONT: f64 = 1.15;

/// Family name of the font; an SVG contains it, and the viewer uses its own sans-serif font.
const NAME: &str = "sans-serif";

/// Font size in plotters divided by the em size, SVG backend: it divides the size by this constant.
const SVG_SIZE_PER_EM: f64 = 1.24;

/// Font size in plotters divided by the em size, bitmap backend: the size is ascent plus descent, for Roboto
/// (1900 + 500) / 2048 em.
const BITMAP_SIZE_PER_EM: f64 = 1.172;

static ROBOTO: &[u8] = include_bytes!("fonts/Roboto-Regular.ttf");

/// Registers the font with plotters; repeated calls have no effect.
pub(super) fn register_fonts() -> Result<(), PlotError> {
    register_font(NAME, FontStyle::Normal, ROBOTO)
        .map_err(|_| PlotError::Drawing("the bundled font cannot be read".to_owned()))
}

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
    pub(super) fn drawing(error: impl std::fmt::Display) -> Self {
        Self::Drawing(error.to_string())
    }
}

/// A position on the canvas, points, y downwards.
pub(super) type CanvasPoint = (f64, f64);

/// Alignment of a text relative to its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    /// Starts at the position, vertically centred.
    Left,
    /// Ends at the position, vertically centred.
    Right,
    /// Horizontally centred below the position.
    Below,
    /// Centred on the position, rotated by 90 degrees anticlockwise.
    Sideways,
}

/// Output of lines and text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pen {
    /// As vector elements (SVG).
    Vector,
    /// As pixels. The wide lines of plotters have gaps at sharp corners, so lines are rasterised here.
    Pixels,
}

/// Vertical offset of SVG text relative to bitmap text in plotters, in ems; bitmap text is shifted to match.
const SVG_TEXT_OFFSET: f64 = 0.17;

/// A canvas with `scale` backend units per point; the backends have integer coordinates.
pub(super) struct Canvas<'a, DB: DrawingBackend> {
    pub(super) area: &'a DrawingArea<DB, Shift>,
    pub(super) scale: f64,
    pub(super) pen: Pen,
}

impl<DB: DrawingBackend> Canvas<'_, DB> {
    fn unit(&self, at: CanvasPoint) -> (i32, i32) {
        ((at.0 * self.scale).round() as i32, (at.1 * self.scale).round() as i32)
    }

    fn stroke(&self, colour: Rgb, width: f64) -> ShapeStyle {
        rgb(colour).stroke_width((width * self.scale).round().max(1.0) as u32)
    }

    pub(super) fn clear(&self) -> Result<(), PlotError> {
        self.area.fill(&RGBColor(255, 255, 255)).map_err(PlotError::drawing)
    }

    pub(super) fn line(&self, points: &[CanvasPoint], colour: Rgb, width: f64) -> Result<(), PlotError> {
        let mut units: Vec<(i32, i32)> = points.iter().map(|at| self.unit(*at)).collect();
        units.dedup();
        if units.len() < 2 {
            return Ok(());
        }
        match self.pen {
            Pen::Vector => {
                self.area.draw(&PathElement::new(units, self.stroke(colour, width))).map_err(PlotError::drawing)
            }
            Pen::Pixels => units.windows(2).try_for_each(|ends| self.segment(ends[0], ends[1], colour, width)),
        }
    }

    /// Draws a dashed path; `width` is the line width, points.
    pub(super) fn dashes(&self, path: &[CanvasPoint], colour: Rgb, width: f64) -> Result<(), PlotError> {
        // Lengths, points.
        const DASH: f64 = 5.0;
        const GAP: f64 = 3.0;
        let mut along = 0.0;
        let mut dash = Vec::new();
        for pair in path.windows(2) {
            let ((x0, y0), (x1, y1)) = (pair[0], pair[1]);
            let length = (x1 - x0).hypot(y1 - y0);
            let mut done = 0.0;
            while done < length {
                let phase = along % (DASH + GAP);
                let drawing = phase < DASH;
                let step = (if drawing { DASH } else { DASH + GAP } - phase).min(length - done).max(1e-6);
                let at = |s: f64| (x0 + (x1 - x0) * s / length, y0 + (y1 - y0) * s / length);
                if drawing {
                    dash.extend([at(done), at(done + step)]);
                } else if !dash.is_empty() {
                    self.line(&std::mem::take(&mut dash), colour, width)?;
                }
                done += step;
                along += step;
            }
        }
        self.line(&dash, colour, width)
    }

    /// Draws all pixels within half the width of the segment from `a` to `b`; the round ends join the segments.
    fn segment(&self, a: (i32, i32), b: (i32, i32), colour: Rgb, width: f64) -> Result<(), PlotError> {
        let reach = (width * self.scale / 2.0).max(0.5);
        let margin = reach.ceil() as i32;
        let (along, colour) = ((f64::from(b.0 - a.0), f64::from(b.1 - a.1)), rgb(colour));
        let length2 = along.0 * along.0 + along.1 * along.1;
        let distance2 = |x: i32, y: i32| {
            let to = (f64::from(x - a.0), f64::from(y - a.1));
            let u = ((to.0 * along.0 + to.1 * along.1) / length2).clamp(0.0, 1.0);
            (to.0 - u * along.0).powi(2) + (to.1 - u * along.1).powi(2)
        };
        for y in a.1.min(b.1) - margin..=a.1.max(b.1) + margin {
            // Visit only the columns near the part of the segment that crosses this row.
            let at_row = |edge: f64| match b.1 - a.1 {
                0 => edge,
                rise => f64::from(a.0) + along.0 * ((edge - f64::from(a.1)) / f64::from(rise)).clamp(0.0, 1.0),
            };
            let (top, bottom) = (f64::from(y) - reach, f64::from(y) + reach);
            let (x0, x1) = match b.1 == a.1 {
                true => (f64::from(a.0.min(b.0)), f64::from(a.0.max(b.0))),
                false => (at_row(top).min(at_row(bottom)), at_row(top).max(at_row(bottom))),
            };
            for x in x0.floor() as i32 - margin..=x1.ceil() as i32 + margin {
                if distance2(x, y) <= reach * reach {
                    self.area.draw_pixel((x, y), &colour).map_err(PlotError::drawing)?;
                }
            }
        }
        Ok(())
    }

    pub(super) fn polygon(&self, outline: &[CanvasPoint], colour: Rgb, opacity: f64) -> Result<(), PlotError> {
        let units: Vec<(i32, i32)> = outline.iter().map(|at| self.unit(*at)).collect();
        self.area.draw(&Polygon::new(units, rgb(colour).mix(opacity).filled())).map_err(PlotError::drawing)
    }

    /// Draws a filled rectangle from the upper left to the lower right corner.
    pub(super) fn rectangle(&self, from: CanvasPoint, to: CanvasPoint, colour: Rgb) -> Result<(), PlotError> {
        let filled = Rectangle::new([self.unit(from), self.unit(to)], rgb(colour).filled());
        self.area.draw(&filled).map_err(PlotError::drawing)
    }

    /// Draws a square dot centred on `at`; at small sizes it looks like a disc.
    pub(super) fn dot(&self, at: CanvasPoint, colour: Rgb, size: f64) -> Result<(), PlotError> {
        let corner = self.unit((at.0 - size / 2.0, at.1 - size / 2.0));
        let side = (size * self.scale).round().max(1.0) as i32;
        let square = Rectangle::new([corner, (corner.0 + side, corner.1 + side)], rgb(colour).filled());
        self.area.draw(&square).map_err(PlotError::drawing)
    }

    /// Draws a diagonal cross centred on `at`.
    pub(super) fn cross(&self, at: CanvasPoint, colour: Rgb, size: f64) -> Result<(), PlotError> {
        // Line width, points.
        const WIDTH: f64 = 2.0;
        let (x, y, half) = (at.0, at.1, size / 2.0);
        self.line(&[(x - half, y - half), (x + half, y + half)], colour, WIDTH)?;
        self.line(&[(x - half, y + half), (x + half, y - half)], colour, WIDTH)
    }

    pub(super) fn text(&self, text: &str, at: CanvasPoint, anchor: Anchor, size: f64) -> Result<(), PlotError> {
        let (h, v) = match anchor {
            Anchor::Left => (HPos::Left, VPos::Center),
            Anchor::Right => (HPos::Right, VPos::Center),
            Anchor::Below => (HPos::Center, VPos::Top),
            Anchor::Sideways => (HPos::Center, VPos::Center),
        };
        let (em, offset) = match self.pen {
            Pen::Vector => (SVG_SIZE_PER_EM, 0.0),
            Pen::Pixels => (BITMAP_SIZE_PER_EM, SVG_TEXT_OFFSET * size),
        };
        let at = if anchor == Anchor::Sideways { (at.0 + offset, at.1) } else { (at.0, at.1 + offset) };
        let upright = (NAME, size * em * self.scale).into_font();
        let font = if anchor == Anchor::Sideways { upright.transform(FontTransform::Rotate270) } else { upright };
        let ink = rgb(INK);
        let style = font.into_text_style(self.area).color(&ink).pos(Pos::new(h, v));
        // A control character would make the SVG invalid XML.
        self.area.draw(&Text::new(printable_name(text), self.unit(at), style)).map_err(PlotError::drawing)
    }

    /// The width of a text, points.
    pub(super) fn width_of(&self, text: &str, size: f64) -> Result<f64, PlotError> {
        let font = (NAME, size * BITMAP_SIZE_PER_EM * self.scale).into_font();
        let (width, _) = font.box_size(&printable_name(text)).map_err(|error| PlotError::Drawing(error.to_string()))?;
        Ok(f64::from(width) / self.scale)
    }
}

fn rgb((r, g, b): Rgb) -> RGBColor {
    RGBColor(r, g, b)
}
