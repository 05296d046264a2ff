//! Header of a chart: title and legend above the axes.

use super::canvas::{Anchor, Canvas, CanvasPoint, SMALL_TEXT, TEXT, WIDER_FONT};
use super::palette::{INK, Rgb, shade, signed_shade};
use super::{Chart, Mark, PlotError, Series, axis};
use plotters::prelude::DrawingBackend;

/// Line spacing of the legend, points.
const LINE_SPACING: f64 = 17.0;
/// Distance from the lowest line to the axes, points.
const ABOVE_AXES: f64 = 13.0;
/// Length of a line sample in the legend, points.
const SAMPLE_LENGTH: f64 = 20.0;
/// Distances between two entries, and between the sample and the name of an entry, points.
const ENTRY_GAP: f64 = 18.0;
/// Least distance between a title and entries in the same line, points.
const TITLE_GAP: f64 = 48.0;
const NAME_GAP: f64 = 6.0;
/// Length of the colour bar, points.
const COLOUR_BAR: f64 = 96.0;

/// Title and legend, wrapped into lines.
pub(super) struct Header<'a> {
    title: Vec<String>,
    lines: Vec<Vec<Entry<'a>>>,
    /// Whether the last line of the title has no legend next to it.
    title_is_separate: bool,
}

/// An entry of the legend with its width, points.
struct Entry<'a> {
    content: EntryContent<'a>,
    width: f64,
}

enum EntryContent<'a> {
    Series(&'a Series),
    ColourBar { min: String, max: String, shade: fn(f64) -> Rgb },
}

impl<'a> Header<'a> {
    /// The header of a chart whose axes are `width` points wide.
    pub fn of<DB: DrawingBackend>(canvas: &Canvas<DB>, chart: &'a Chart, width: f64) -> Result<Self, PlotError> {
        let mut entries = Vec::new();
        for series in chart.series.iter().filter(|series| !series.name.is_empty()) {
            let wide = SAMPLE_LENGTH + NAME_GAP + WIDER_FONT * canvas.width_of(&series.name, SMALL_TEXT)?;
            entries.push(Entry { content: EntryContent::Series(series), width: wide });
        }
        if let Some(cells) = &chart.cells {
            let (low, high) = cells.range;
            let below = if cells.cells.iter().any(|cell| cell.value < low) { "\u{2264} " } else { "" };
            let above = if cells.cells.iter().any(|cell| cell.value > high) { "\u{2265} " } else { "" };
            let ends = (below.to_owned() + &axis::short(low), above.to_owned() + &axis::short(high));
            entries.push(colour_bar(canvas, ends, &cells.unit, shade)?);
        }
        if let Some(dots) = chart.signed_dots.as_ref().filter(|dots| !dots.unit.is_empty()) {
            let ends = (axis::short(-dots.limit), axis::short(dots.limit));
            entries.push(colour_bar(canvas, ends, &dots.unit, signed_shade)?);
        }
        let mut lines: Vec<Vec<Entry<'a>>> = Vec::new();
        for entry in entries {
            match lines.last_mut() {
                Some(line) if width_of(line) + ENTRY_GAP + entry.width <= width => line.push(entry),
                _ => lines.push(vec![entry]),
            }
        }
        let title = wrapped(canvas, &chart.title, width)?;
        let last = title.last().map_or(Ok(0.0), |line| canvas.width_of(line, TEXT))?;
        let legend = lines.first().map_or(0.0, |line| TITLE_GAP + width_of(line));
        let title_is_separate = last > 0.0 && legend > 0.0 && last + legend > width;
        Ok(Self { title, lines, title_is_separate })
    }

    /// Height above that of a single line, points.
    pub fn extra_height(&self) -> f64 {
        (self.lines.len() + self.lines_above_legend()).max(self.title.len()).saturating_sub(1) as f64 * LINE_SPACING
    }

    /// Number of lines of the title above the first line of the legend.
    fn lines_above_legend(&self) -> usize {
        if self.title_is_separate { self.title.len() } else { self.title.len().saturating_sub(1) }
    }

    /// Draws the header above axes that extend from `left` to `right` and up to `top`.
    pub fn draw<DB: DrawingBackend>(
        &self,
        canvas: &Canvas<DB>,
        (left, right): (f64, f64),
        top: f64,
    ) -> Result<(), PlotError> {
        let first = top - ABOVE_AXES - self.extra_height();
        for (index, line) in self.title.iter().enumerate() {
            canvas.text(line, (left, first + index as f64 * LINE_SPACING), Anchor::Left, TEXT)?;
        }
        for (index, line) in self.lines.iter().enumerate() {
            let y = first + (index + self.lines_above_legend()) as f64 * LINE_SPACING;
            let mut x = right - width_of(line);
            for entry in line {
                entry.draw(canvas, (x, y))?;
                x += entry.width + ENTRY_GAP;
            }
        }
        Ok(())
    }
}

/// Breaks a title at its words into lines of at most `width`; a longer word has its own line.
fn wrapped<DB: DrawingBackend>(canvas: &Canvas<DB>, title: &str, width: f64) -> Result<Vec<String>, PlotError> {
    let mut lines: Vec<String> = Vec::new();
    for word in title.split_whitespace() {
        let longer = lines.last().map(|line| format!("{line} {word}"));
        let fits = longer.as_ref().map_or(Ok(false), |line| canvas.width_of(line, TEXT).map(|wide| wide <= width))?;
        match (longer, lines.last_mut()) {
            (Some(longer), Some(line)) if fits => *line = longer,
            _ => lines.push(word.to_owned()),
        }
    }
    Ok(lines)
}

fn width_of(line: &[Entry<'_>]) -> f64 {
    line.iter().map(|entry| entry.width).sum::<f64>() + ENTRY_GAP * line.len().saturating_sub(1) as f64
}

fn colour_bar<'a, DB: DrawingBackend>(
    canvas: &Canvas<DB>,
    (min, max): (String, String),
    unit: &str,
    shade: fn(f64) -> Rgb,
) -> Result<Entry<'a>, PlotError> {
    let max = if unit.is_empty() { max } else { format!("{max} {unit}") };
    let labels = canvas.width_of(&min, SMALL_TEXT)? + canvas.width_of(&max, SMALL_TEXT)?;
    Ok(Entry { content: EntryContent::ColourBar { min, max, shade }, width: labels + COLOUR_BAR + 2.0 * NAME_GAP })
}

impl Entry<'_> {
    fn draw<DB: DrawingBackend>(&self, canvas: &Canvas<DB>, (x, y): CanvasPoint) -> Result<(), PlotError> {
        match &self.content {
            EntryContent::Series(series) => {
                let (sample, colour) = ([(x, y), (x + SAMPLE_LENGTH, y)], series.colour.rgb());
                match series.mark {
                    Mark::Line(width) => canvas.line(&sample, colour, width.max(1.5))?,
                    Mark::Dashes(width) => canvas.dashes(&sample, colour, width.max(1.5))?,
                    Mark::Dots(_) => canvas.dot((x + SAMPLE_LENGTH / 2.0, y), colour, 6.0)?,
                    Mark::Crosses(_) => canvas.cross((x + SAMPLE_LENGTH / 2.0, y), colour, 6.0)?,
                }
                canvas.text(&series.name, (x + SAMPLE_LENGTH + NAME_GAP, y), Anchor::Left, SMALL_TEXT)
            }
            EntryContent::ColourBar { min, max, shade } => {
                canvas.text(min, (x, y), Anchor::Left, SMALL_TEXT)?;
                let start = x + canvas.width_of(min, SMALL_TEXT)? + NAME_GAP;
                let steps = COLOUR_BAR as u32;
                for k in 0..steps {
                    let at = start + f64::from(k);
                    let fraction = (f64::from(k) + 0.5) / f64::from(steps);
                    canvas.rectangle((at, y - 5.0), (at + 1.0, y + 5.0), shade(fraction))?;
                }
                let end = start + COLOUR_BAR;
                let outline = [(start, y - 5.0), (end, y - 5.0), (end, y + 5.0), (start, y + 5.0), (start, y - 5.0)];
                canvas.line(&outline, INK, 0.5)?;
                canvas.text(max, (end + NAME_GAP, y), Anchor::Left, SMALL_TEXT)
            }
        }
    }
}
