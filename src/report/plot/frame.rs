//! One chart on a canvas: title, legend, grid, labels, and the data within.

use super::axis::Axis;
use super::canvas::{Anchor, At, Canvas};
use super::legend::Header;
use super::palette::{GRID, INK, shade, signed_shade};
use super::stroke::dashes;
use super::{Chart, Mark, PlotError, Series, SignedDots};
use plotters::prelude::DrawingBackend;

/// Sizes of letters, points.
pub(super) const TEXT: f64 = 12.0;
pub(super) const SMALL: f64 = 11.0;
/// Room for one line of title and legend, below the axis for numbers and label, and left and right of it.
const TOP: f64 = 30.0;
const BOTTOM: f64 = 46.0;
const LEFT: f64 = 68.0;
const RIGHT: f64 = 18.0;
/// Points from one tick to the next, at least about.
const TICK_X: f64 = 85.0;
const TICK_Y: f64 = 28.0;
/// However narrow a chart is, its scale is told by about so many.
const LEAST_TICKS: usize = 4;

/// Where a chart's axes stand on the sheet.
struct Frame {
    left: f64,
    top: f64,
    width: f64,
    height: f64,
    x: Axis,
    y: Axis,
}

impl Frame {
    fn at(&self, (x, y): (f64, f64)) -> At {
        (self.left + self.x.fraction(x) * self.width, self.top + (1.0 - self.y.fraction(y)) * self.height)
    }

    fn bottom(&self) -> f64 {
        self.top + self.height
    }

    fn right(&self) -> f64 {
        self.left + self.width
    }
}

/// Height of a chart that is `width` wide: that of the map for a map, else `wanted`.
pub(super) fn height_of(chart: &Chart, width: f64, wanted: f64) -> f64 {
    if !chart.equal_axes {
        return wanted;
    }
    let [x, y] = ranges(chart);
    let shape = (y.high - y.low) / (x.high - x.low);
    ((width - LEFT - RIGHT) * shape).clamp(150.0, 620.0) + TOP + BOTTOM
}

/// Draws a chart into the rectangle at `corner`.
pub(super) fn draw<DB: DrawingBackend>(
    canvas: &Canvas<DB>,
    chart: &Chart,
    corner: At,
    size: (f64, f64),
) -> Result<(), PlotError> {
    let left = left_of(canvas, chart)?;
    let header = Header::of(canvas, chart, size.0 - left - RIGHT)?;
    let more = header.more_height();
    let frame = place(chart, (corner.0, corner.1 + more), (size.0, size.1 - more), left);
    grid(canvas, &frame, chart)?;
    cells(canvas, &frame, chart)?;
    for series in &chart.series {
        band(canvas, &frame, series)?;
    }
    for series in &chart.series {
        points(canvas, &frame, series)?;
    }
    signed_dots(canvas, &frame, chart)?;
    header.draw(canvas, (frame.left, frame.right()), frame.top)
}

fn ranges(chart: &Chart) -> [Axis; 2] {
    if let Some([x, y]) = chart.range {
        return [x, y].map(|(low, high)| Axis { low, high });
    }
    let [x, mut y] = chart.extent();
    if chart.from_zero {
        y = (y.0.min(0.0), y.1.max(0.0));
    }
    let mut y_axis = Axis::over(y, 0.06);
    if chart.from_zero && y.0 == 0.0 {
        y_axis.low = 0.0;
    }
    let x_axis = if chart.equal_axes { Axis::over(x, 0.04) } else { Axis::over(x, 0.0).to_round_ends() };
    [x_axis, y_axis]
}

/// Axes that fill their rectangle; for a map, the shorter axis is made longer until a metre is as long on both.
fn place(chart: &Chart, corner: At, size: (f64, f64), left: f64) -> Frame {
    let [x, y] = ranges(chart);
    let (width, height) = (size.0 - left - RIGHT, size.1 - TOP - BOTTOM);
    let mut frame = Frame { left: corner.0 + left, top: corner.1 + TOP, width, height, x, y };
    if chart.equal_axes {
        let per_point = ((x.high - x.low) / width).max((y.high - y.low) / height);
        let widened = |axis: Axis, points: f64| {
            let (middle, half) = ((axis.low + axis.high) / 2.0, per_point * points / 2.0);
            Axis { low: middle - half, high: middle + half }
        };
        (frame.x, frame.y) = (widened(x, width), widened(y, height));
    }
    frame
}

/// Room left of the axes: words need more than numbers.
fn left_of<DB: DrawingBackend>(canvas: &Canvas<DB>, chart: &Chart) -> Result<f64, PlotError> {
    chart.y_marks.iter().try_fold(LEFT, |room, (_, words)| Ok(room.max(canvas.width_of(words, SMALL)? + 16.0)))
}

/// The marks that a chart asks for, where they are on its axis; else about `wanted` round numbers.
fn marks(axis: &Axis, asked: &[(f64, String)], wanted: f64) -> Vec<(f64, String)> {
    if asked.is_empty() {
        return axis.ticks((wanted as usize).max(LEAST_TICKS));
    }
    asked.iter().filter(|(value, _)| (axis.low..=axis.high).contains(value)).cloned().collect()
}

fn grid<DB: DrawingBackend>(canvas: &Canvas<DB>, frame: &Frame, chart: &Chart) -> Result<(), PlotError> {
    for (value, label) in marks(&frame.x, &chart.x_marks, frame.width / TICK_X) {
        let (x, _) = frame.at((value, frame.y.low));
        canvas.line(&[(x, frame.top), (x, frame.bottom())], GRID, 0.8)?;
        canvas.line(&[(x, frame.bottom()), (x, frame.bottom() + 4.0)], INK, 0.8)?;
        canvas.text(&label, (x, frame.bottom() + 7.0), Anchor::Below, SMALL)?;
    }
    for (value, label) in marks(&frame.y, &chart.y_marks, frame.height / TICK_Y) {
        let (_, y) = frame.at((frame.x.low, value));
        canvas.line(&[(frame.left, y), (frame.right(), y)], GRID, 0.8)?;
        canvas.line(&[(frame.left - 4.0, y), (frame.left, y)], INK, 0.8)?;
        canvas.text(&label, (frame.left - 8.0, y), Anchor::Right, SMALL)?;
    }
    let axes = [(frame.left, frame.top), (frame.left, frame.bottom()), (frame.right(), frame.bottom())];
    canvas.line(&axes, INK, 0.8)?;
    canvas.text(&chart.x_label, (frame.left + frame.width / 2.0, frame.bottom() + 25.0), Anchor::Below, TEXT)?;
    canvas.text(&chart.y_label, (frame.left - LEFT + 14.0, frame.top + frame.height / 2.0), Anchor::Sideways, TEXT)
}

fn cells<DB: DrawingBackend>(canvas: &Canvas<DB>, frame: &Frame, chart: &Chart) -> Result<(), PlotError> {
    let Some(cells) = &chart.cells else { return Ok(()) };
    let (least, most) = cells.range;
    cells.cells.iter().filter(|cell| cell.value.is_finite()).try_for_each(|cell| {
        let (upper_left, lower_right) = (frame.at((cell.x.0, cell.y.1)), frame.at((cell.x.1, cell.y.0)));
        canvas.rectangle(upper_left, lower_right, shade((cell.value - least) / (most - least)))
    })
}

fn signed_dots<DB: DrawingBackend>(canvas: &Canvas<DB>, frame: &Frame, chart: &Chart) -> Result<(), PlotError> {
    let Some(SignedDots { limit, size, dots, .. }) = &chart.signed_dots else { return Ok(()) };
    let within = |axis: &Axis, value: f64| (axis.low..=axis.high).contains(&value);
    dots.iter()
        .filter(|(x, y, amount)| within(&frame.x, *x) && within(&frame.y, *y) && amount.is_finite())
        .try_for_each(|(x, y, amount)| canvas.dot(frame.at((*x, *y)), signed_shade(0.5 + 0.5 * amount / limit), *size))
}

fn band<DB: DrawingBackend>(canvas: &Canvas<DB>, frame: &Frame, series: &Series) -> Result<(), PlotError> {
    let upper = series.band.iter().map(|(x, _, high)| (*x, *high));
    let lower = series.band.iter().rev().map(|(x, low, _)| (*x, *low));
    let outline: Vec<At> =
        upper.chain(lower).filter(|(x, y)| x.is_finite() && y.is_finite()).map(|point| frame.at(point)).collect();
    if outline.len() < 3 { Ok(()) } else { canvas.area_between(&outline, series.colour.rgb(), 0.2) }
}

fn points<DB: DrawingBackend>(canvas: &Canvas<DB>, frame: &Frame, series: &Series) -> Result<(), PlotError> {
    let colour = series.colour.rgb();
    let is_finite = |point: &(f64, f64)| point.0.is_finite() && point.1.is_finite();
    if let Mark::Dots(size) = series.mark {
        return series.points.iter().filter(|p| is_finite(p)).try_for_each(|p| canvas.dot(frame.at(*p), colour, size));
    }
    for stretch in series.points.split(|point| !is_finite(point)) {
        let path = thinned(&stretch.iter().map(|point| frame.at(*point)).collect::<Vec<At>>());
        match series.mark {
            Mark::Dashes(width) => dashes(canvas, &path, series, width)?,
            Mark::Line(width) | Mark::Dots(width) => canvas.line(&path, colour, width)?,
        }
    }
    Ok(())
}

/// The path without what a print would not show: of all points within half a point's width, first, least, greatest,
/// last.
fn thinned(path: &[At]) -> Vec<At> {
    const COLUMN: f64 = 0.5;
    let mut kept: Vec<At> = Vec::new();
    let mut rest = path;
    while let Some(first) = rest.first() {
        let count = rest.iter().take_while(|at| (at.0 - first.0).abs() < COLUMN).count();
        let (column, after) = rest.split_at(count);
        let by_height = |a: &&At, b: &&At| a.1.total_cmp(&b.1);
        let ends = [column.iter().min_by(by_height), column.iter().max_by(by_height)];
        let mut keep: Vec<At> =
            [column.first(), ends[0], ends[1], column.last()].into_iter().flatten().copied().collect();
        keep.dedup();
        kept.extend(keep);
        rest = after;
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_every_peak() {
        // 100 000 points over 100 points' width, one spike: a few points a column remain, the spike among them.
        let spike = |k: usize| if k == 51_234 { -40.0 } else { 10.0 + (k % 7) as f64 };
        let path: Vec<At> = (0..100_000).map(|k| (k as f64 * 1e-3, spike(k))).collect();
        let kept = thinned(&path);
        assert!(kept.len() < 900, "{}", kept.len());
        assert!(kept.iter().any(|at| at.1 == -40.0));
    }
}
