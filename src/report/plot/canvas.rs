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

/// What a backend does with a line and a letter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pen {
    /// Keeps them as they are (SVG).
    Vector,
    /// Sets pixels. plotters' wide lines break at sharp turns, so here a line is the pixels within half its width.
    Pixels,
}

/// How far below where plotters sets it a letter stands in an SVG, in ems.
const LETTER_DROP: f64 = 0.17;

/// A sheet whose points are `scale` units of the backend long: backends draw at whole units only.
pub(super) struct Canvas<'a, DB: DrawingBackend> {
    pub(super) area: &'a DrawingArea<DB, Shift>,
    pub(super) scale: f64,
    pub(super) pen: Pen,
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
        match self.pen {
            Pen::Vector => {
                self.area.draw(&PathElement::new(units, self.stroke(colour, width))).map_err(PlotError::drawing)
            }
            Pen::Pixels => units.windows(2).try_for_each(|ends| self.segment(ends[0], ends[1], colour, width)),
        }
    }

    /// Sets every pixel within half the width of the segment from `a` to `b`: round ends join one to the next.
    fn segment(&self, a: (i32, i32), b: (i32, i32), colour: Rgb, width: f64) -> Result<(), PlotError> {
        let reach = (width * self.scale / 2.0).max(0.5);
        let margin = reach.ceil() as i32;
        let (along, colour) = ((f64::from(b.0 - a.0), f64::from(b.1 - a.1)), rgb(colour));
        let length2 = along.0 * along.0 + along.1 * along.1;
        let distance = |x: i32, y: i32| {
            let to = (f64::from(x - a.0), f64::from(y - a.1));
            let u = ((to.0 * along.0 + to.1 * along.1) / length2).clamp(0.0, 1.0);
            (to.0 - u * along.0).hypot(to.1 - u * along.1)
        };
        for y in a.1.min(b.1) - margin..=a.1.max(b.1) + margin {
            // Only where the segment passes this row: its pixels within the reach, and no more.
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
                if distance(x, y) <= reach {
                    self.area.draw_pixel((x, y), &colour).map_err(PlotError::drawing)?;
                }
            }
        }
        Ok(())
    }

    pub(super) fn area_between(&self, outline: &[At], colour: Rgb, opacity: f64) -> Result<(), PlotError> {
        let units: Vec<(i32, i32)> = outline.iter().map(|at| self.unit(*at)).collect();
        self.area.draw(&Polygon::new(units, rgb(colour).mix(opacity).filled())).map_err(PlotError::drawing)
    }

    /// A filled rectangle from its upper left to its lower right corner.
    pub(super) fn rectangle(&self, from: At, to: At, colour: Rgb) -> Result<(), PlotError> {
        let filled = Rectangle::new([self.unit(from), self.unit(to)], rgb(colour).filled());
        self.area.draw(&filled).map_err(PlotError::drawing)
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
        let (em, drop) = match self.pen {
            Pen::Vector => (font::SIZE_OF_EM_IN_SVG, 0.0),
            Pen::Pixels => (font::SIZE_OF_EM_IN_PIXELS, LETTER_DROP * size),
        };
        let at = if anchor == Anchor::Sideways { (at.0 + drop, at.1) } else { (at.0, at.1 + drop) };
        let upright = (font::NAME, size * em * self.scale).into_font();
        let font = if anchor == Anchor::Sideways { upright.transform(FontTransform::Rotate270) } else { upright };
        let ink = rgb(INK);
        let style = font.into_text_style(self.area).color(&ink).pos(Pos::new(h, v));
        self.area.draw(&Text::new(text.to_owned(), self.unit(at), style)).map_err(PlotError::drawing)
    }

    /// Width of a text, points.
    pub(super) fn width_of(&self, text: &str, size: f64) -> Result<f64, PlotError> {
        let font = (font::NAME, size * font::SIZE_OF_EM_IN_PIXELS * self.scale).into_font();
        let (width, _) = font.box_size(text).map_err(|error| PlotError::Drawing(error.to_string()))?;
        Ok(f64::from(width) / self.scale)
    }
}

fn rgb((r, g, b): Rgb) -> RGBColor {
    RGBColor(r, g, b)
}
