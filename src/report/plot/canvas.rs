//! A sheet to draw on, in points from its top left corner, whatever is below: SVG or pixels.

use super::palette::{INK, Rgb};
use super::{PlotError, font};
use plotters::coord::Shift;
use plotters::prelude::{DrawingArea, DrawingBackend, IntoFont, PathElement, Polygon, RGBColor, Rectangle, Text};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontTransform, IntoTextStyle, ShapeStyle};

/// A place on the sheet, in points, y downwards.
pub(super) type At = (f64, f64);

/// How a text stands about its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    /// Begins at it, at middle height.
    Left,
    /// Ends at it, at middle height.
    Right,
    /// Centred below it.
    Below,
    /// Centred on it, turned to be read from the right.
    Sideways,
}

/// A sheet whose points are `scale` units of the backend long: backends draw at whole units only.
pub(super) struct Canvas<'a, DB: DrawingBackend> {
    pub(super) area: &'a DrawingArea<DB, Shift>,
    pub(super) scale: f64,
}

impl<DB: DrawingBackend> Canvas<'_, DB> {
    fn unit(&self, at: At) -> (i32, i32) {
        ((at.0 * self.scale).round() as i32, (at.1 * self.scale).round() as i32)
    }

    fn stroke(&self, colour: Rgb, width: f64) -> ShapeStyle {
        rgb(colour).stroke_width((width * self.scale).round().max(1.0) as u32)
    }

    pub(super) fn clear(&self) -> Result<(), PlotError> {
        self.area.fill(&RGBColor(255, 255, 255)).map_err(PlotError::drawing)
    }

    pub(super) fn line(&self, points: &[At], colour: Rgb, width: f64) -> Result<(), PlotError> {
        let mut units: Vec<(i32, i32)> = points.iter().map(|at| self.unit(*at)).collect();
        units.dedup();
        if units.len() < 2 {
            return Ok(());
        }
        self.area.draw(&PathElement::new(units, self.stroke(colour, width))).map_err(PlotError::drawing)
    }

    pub(super) fn area_between(&self, outline: &[At], colour: Rgb, opacity: f64) -> Result<(), PlotError> {
        let units: Vec<(i32, i32)> = outline.iter().map(|at| self.unit(*at)).collect();
        self.area.draw(&Polygon::new(units, rgb(colour).mix(opacity).filled())).map_err(PlotError::drawing)
    }

    /// A square dot of this size about `at`: for many small ones, which no one tells from discs.
    pub(super) fn dot(&self, at: At, colour: Rgb, size: f64) -> Result<(), PlotError> {
        let corner = self.unit((at.0 - size / 2.0, at.1 - size / 2.0));
        let side = (size * self.scale).round().max(1.0) as i32;
        let square = Rectangle::new([corner, (corner.0 + side, corner.1 + side)], rgb(colour).filled());
        self.area.draw(&square).map_err(PlotError::drawing)
    }

    pub(super) fn text(&self, text: &str, at: At, anchor: Anchor, size: f64) -> Result<(), PlotError> {
        let (h, v) = match anchor {
            Anchor::Left => (HPos::Left, VPos::Center),
            Anchor::Right => (HPos::Right, VPos::Center),
            Anchor::Below => (HPos::Center, VPos::Top),
            Anchor::Sideways => (HPos::Center, VPos::Center),
        };
        let upright = (font::NAME, size * font::SIZE_OF_EM * self.scale).into_font();
        let font = if anchor == Anchor::Sideways { upright.transform(FontTransform::Rotate270) } else { upright };
        let ink = rgb(INK);
        let style = font.into_text_style(self.area).color(&ink).pos(Pos::new(h, v));
        self.area.draw(&Text::new(text.to_owned(), self.unit(at), style)).map_err(PlotError::drawing)
    }

    /// Width of a text, points.
    pub(super) fn width_of(&self, text: &str, size: f64) -> Result<f64, PlotError> {
        let font = (font::NAME, size * font::SIZE_OF_EM * self.scale).into_font();
        let (width, _) = font.box_size(text).map_err(|error| PlotError::Drawing(error.to_string()))?;
        Ok(f64::from(width) / self.scale)
    }
}

fn rgb((r, g, b): Rgb) -> RGBColor {
    RGBColor(r, g, b)
}
