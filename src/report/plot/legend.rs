//! What stands above a chart's axes: its title, and what its series and colours mean.

use super::canvas::{Anchor, At, Canvas};
use super::frame::{SMALL, TEXT};
use super::palette::{INK, Rgb, shade, signed_shade};
use super::{Chart, Mark, PlotError, Series, axis, stroke};
use plotters::prelude::DrawingBackend;

/// From one line of the legend to the next.
const LINE: f64 = 17.0;
/// From the lowest line to the axes.
const ABOVE_AXES: f64 = 13.0;
/// Length of a line in the legend.
const SAMPLE: f64 = 20.0;
/// Room between two entries, and between an entry's sample and its name.
const BETWEEN: f64 = 18.0;
const TO_NAME: f64 = 6.0;
/// Length of the strip of colours.
const STRIP: f64 = 96.0;

/// Title and legend, broken into lines.
pub(super) struct Header<'a> {
    title: &'a str,
    lines: Vec<Vec<Entry<'a>>>,
    /// Whether the title has a line of its own.
    is_apart: bool,
}

/// An entry of the legend, and how wide it is, points.
struct Entry<'a> {
    of: What<'a>,
    width: f64,
}

enum What<'a> {
    Series(&'a Series),
    Colours { least: String, most: String, shade: fn(f64) -> Rgb },
}

impl<'a> Header<'a> {
    /// The header of a chart whose axes are `width` points wide.
    pub fn of<DB: DrawingBackend>(canvas: &Canvas<DB>, chart: &'a Chart, width: f64) -> Result<Self, PlotError> {
        let mut entries = Vec::new();
        for series in chart.series.iter().filter(|series| !series.name.is_empty()) {
            let wide = SAMPLE + TO_NAME + canvas.width_of(&series.name, SMALL)?;
            entries.push(Entry { of: What::Series(series), width: wide });
        }
        if let Some(cells) = &chart.cells {
            entries.push(colours(canvas, cells.range, &cells.unit, shade)?);
        }
        if let Some(dots) = chart.signed_dots.as_ref().filter(|dots| !dots.unit.is_empty()) {
            entries.push(colours(canvas, (-dots.limit, dots.limit), &dots.unit, signed_shade)?);
        }
        let mut lines: Vec<Vec<Entry<'a>>> = Vec::new();
        for entry in entries {
            match lines.last_mut() {
                Some(line) if width_of(line) + BETWEEN + entry.width <= width => line.push(entry),
                _ => lines.push(vec![entry]),
            }
        }
        let title = canvas.width_of(&chart.title, TEXT)?;
        let beside = lines.first().map_or(0.0, |line| BETWEEN + width_of(line));
        Ok(Self { title: &chart.title, lines, is_apart: title > 0.0 && beside > 0.0 && title + beside > width })
    }

    /// How much higher it is than one line.
    pub fn more_height(&self) -> f64 {
        (self.lines.len() + usize::from(self.is_apart)).saturating_sub(1) as f64 * LINE
    }

    /// Draws it above axes from `left` to `right` whose top is at `top`.
    pub fn draw<DB: DrawingBackend>(
        &self,
        canvas: &Canvas<DB>,
        (left, right): (f64, f64),
        top: f64,
    ) -> Result<(), PlotError> {
        let first = top - ABOVE_AXES - self.more_height();
        canvas.text(self.title, (left, first), Anchor::Left, TEXT)?;
        for (index, line) in self.lines.iter().enumerate() {
            let y = first + (index + usize::from(self.is_apart)) as f64 * LINE;
            let mut x = right - width_of(line);
            for entry in line {
                entry.draw(canvas, (x, y))?;
                x += entry.width + BETWEEN;
            }
        }
        Ok(())
    }
}

fn width_of(line: &[Entry<'_>]) -> f64 {
    line.iter().map(|entry| entry.width).sum::<f64>() + BETWEEN * line.len().saturating_sub(1) as f64
}

fn colours<'a, DB: DrawingBackend>(
    canvas: &Canvas<DB>,
    (least, most): (f64, f64),
    unit: &str,
    shade: fn(f64) -> Rgb,
) -> Result<Entry<'a>, PlotError> {
    let (least, most) = (axis::short(least), format!("{} {unit}", axis::short(most)));
    let words = canvas.width_of(&least, SMALL)? + canvas.width_of(&most, SMALL)?;
    Ok(Entry { of: What::Colours { least, most, shade }, width: words + STRIP + 2.0 * TO_NAME })
}

impl Entry<'_> {
    fn draw<DB: DrawingBackend>(&self, canvas: &Canvas<DB>, (x, y): At) -> Result<(), PlotError> {
        match &self.of {
            What::Series(series) => {
                let sample = [(x, y), (x + SAMPLE, y)];
                match series.mark {
                    Mark::Line(width) => canvas.line(&sample, series.colour.rgb(), width.max(1.5))?,
                    Mark::Dashes(width) => stroke::dashes(canvas, &sample, series, width.max(1.5))?,
                    Mark::Dots(_) => canvas.dot((x + SAMPLE / 2.0, y), series.colour.rgb(), 6.0)?,
                }
                canvas.text(&series.name, (x + SAMPLE + TO_NAME, y), Anchor::Left, SMALL)
            }
            What::Colours { least, most, shade } => {
                canvas.text(least, (x, y), Anchor::Left, SMALL)?;
                let start = x + canvas.width_of(least, SMALL)? + TO_NAME;
                let steps = STRIP as u32;
                for k in 0..steps {
                    let at = start + f64::from(k);
                    let share = (f64::from(k) + 0.5) / f64::from(steps);
                    canvas.rectangle((at, y - 5.0), (at + 1.0, y + 5.0), shade(share))?;
                }
                let end = start + STRIP;
                let outline = [(start, y - 5.0), (end, y - 5.0), (end, y + 5.0), (start, y + 5.0), (start, y - 5.0)];
                canvas.line(&outline, INK, 0.5)?;
                canvas.text(most, (end + TO_NAME, y), Anchor::Left, SMALL)
            }
        }
    }
}
