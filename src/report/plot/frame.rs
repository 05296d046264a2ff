//! Draws one chart: header, grid, labels and data.

use super::axis::Axis;
use super::canvas::{Anchor, Canvas, CanvasPoint, SMALL_TEXT, TEXT, WIDER_FONT};
use super::legend::Header;
use super::palette::{GRID, INK, shade, signed_shade};
use super::{Chart, Mark, PlotError, Series, SignedDots, Tick};
use plotters::prelude::DrawingBackend;

/// Margins around the axes, points: above for one line of title and legend, below and left for tick labels and axis label.
const TOP: f64 = 30.0;
const BOTTOM: f64 = 46.0;
const LEFT: f64 = 72.0;
const RIGHT: f64 = 18.0;
/// Distance of the vertical label from the edge of the chart, and its room next to custom tick labels, points.
const VERTICAL_LABEL: f64 = 14.0;
const VERTICAL_LABEL_ROOM: f64 = 16.0;
/// Approximate minimum distance between ticks, points.
const TICK_X: f64 = 85.0;
const TICK_Y: f64 = 28.0;
/// Approximate minimum number of ticks, so that the scale of a narrow chart can be read.
const MIN_TICKS: usize = 4;

/// The axes of a chart on the canvas.
struct Frame {
    /// Edge of the chart.
    edge: f64,
    left: f64,
    top: f64,
    width: f64,
    height: f64,
    x: Axis,
    y: Axis,
}

impl Frame {
    fn at(&self, (x, y): (f64, f64)) -> CanvasPoint {
        (self.left + self.x.fraction(x) * self.width, self.top + (1.0 - self.y.fraction(y)) * self.height)
    }

    fn bottom(&self) -> f64 {
        self.top + self.height
    }

    fn right(&self) -> f64 {
        self.left + self.width
    }
}

/// Height of a chart of the given width, points: `wanted`, or for a map the height that its range requires.
pub(super) fn height_of(chart: &Chart, width: f64, wanted: f64) -> f64 {
    if !chart.equal_axes {
        return wanted;
    }
    let [x, y] = ranges(chart);
    let shape = (y.high - y.low) / (x.high - x.low);
    ((width - LEFT - RIGHT) * shape).clamp(150.0, 620.0) + TOP + BOTTOM
}

/// Height of the title and legend above that of a single line, for a chart of this width, points.
pub(super) fn extra_header_height<DB: DrawingBackend>(
    canvas: &Canvas<DB>,
    chart: &Chart,
    width: f64,
) -> Result<f64, PlotError> {
    let left = left_margin(canvas, chart)?;
    Ok(Header::of(canvas, chart, width - left - RIGHT)?.extra_height())
}

/// Draws a chart into the rectangle of `size` at the upper left `corner`; `extra` is the extra height of the headers of
/// its row, so that the axes of a row have one height.
pub(super) fn draw<DB: DrawingBackend>(
    canvas: &Canvas<DB>,
    chart: &Chart,
    corner: CanvasPoint,
    size: (f64, f64),
    extra: f64,
) -> Result<(), PlotError> {
    let left = left_margin(canvas, chart)?;
    let header = Header::of(canvas, chart, size.0 - left - RIGHT)?;
    let frame = frame_of(chart, (corner.0, corner.1 + extra), (size.0, size.1 - extra), left);
    grid(canvas, &frame, chart)?;
    heat_map(canvas, &frame, chart)?;
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

/// Axes that fill the rectangle; on a map, one range is widened until both axes have the same scale.
fn frame_of(chart: &Chart, corner: CanvasPoint, size: (f64, f64), left: f64) -> Frame {
    let [x, y] = ranges(chart);
    let (width, height) = (size.0 - left - RIGHT, size.1 - TOP - BOTTOM);
    let mut frame = Frame { edge: corner.0, left: corner.0 + left, top: corner.1 + TOP, width, height, x, y };
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

/// The left margin, wide enough for custom tick labels and the vertical label, points.
fn left_margin<DB: DrawingBackend>(canvas: &Canvas<DB>, chart: &Chart) -> Result<f64, PlotError> {
    let room = 16.0 + if chart.y_label.is_empty() { 0.0 } else { VERTICAL_LABEL_ROOM };
    chart
        .y_ticks
        .iter()
        .try_fold(LEFT, |margin, tick| Ok(margin.max(WIDER_FONT * canvas.width_of(&tick.label, SMALL_TEXT)? + room)))
}

/// The custom ticks within the range of an axis, or about `wanted` round numbers if there are none.
fn ticks(axis: &Axis, custom: &[Tick], wanted: f64) -> Vec<Tick> {
    if custom.is_empty() {
        return axis.ticks((wanted as usize).max(MIN_TICKS));
    }
    custom.iter().filter(|tick| (axis.low..=axis.high).contains(&tick.at)).cloned().collect()
}

fn grid<DB: DrawingBackend>(canvas: &Canvas<DB>, frame: &Frame, chart: &Chart) -> Result<(), PlotError> {
    for Tick { at, label } in ticks(&frame.x, &chart.x_ticks, frame.width / TICK_X) {
        let (x, _) = frame.at((at, frame.y.low));
        canvas.line(&[(x, frame.top), (x, frame.bottom())], GRID, 0.8)?;
        canvas.line(&[(x, frame.bottom()), (x, frame.bottom() + 4.0)], INK, 0.8)?;
        canvas.text(&label, (x, frame.bottom() + 7.0), Anchor::Below, SMALL_TEXT)?;
    }
    for Tick { at, label } in ticks(&frame.y, &chart.y_ticks, frame.height / TICK_Y) {
        let (_, y) = frame.at((frame.x.low, at));
        canvas.line(&[(frame.left, y), (frame.right(), y)], GRID, 0.8)?;
        canvas.line(&[(frame.left - 4.0, y), (frame.left, y)], INK, 0.8)?;
        canvas.text(&label, (frame.left - 8.0, y), Anchor::Right, SMALL_TEXT)?;
    }
    let axes = [(frame.left, frame.top), (frame.left, frame.bottom()), (frame.right(), frame.bottom())];
    canvas.line(&axes, INK, 0.8)?;
    let (middle, centre) = (frame.left + frame.width / 2.0, frame.top + frame.height / 2.0);
    let size = size_within(canvas, &chart.x_label, frame.width + 2.0 * RIGHT)?;
    canvas.text(&chart.x_label, (middle, frame.bottom() + 25.0), Anchor::Below, size)?;
    let size = size_within(canvas, &chart.y_label, frame.height + 2.0 * TOP.min(BOTTOM))?;
    canvas.text(&chart.y_label, (frame.edge + VERTICAL_LABEL, centre), Anchor::Sideways, size)
}

/// Returns the size of a label that is at most `room` long, points: that of text, or smaller.
fn size_within<DB: DrawingBackend>(canvas: &Canvas<DB>, label: &str, room: f64) -> Result<f64, PlotError> {
    let length = WIDER_FONT * canvas.width_of(label, TEXT)?;
    Ok(TEXT * (room / length).min(1.0))
}

fn heat_map<DB: DrawingBackend>(canvas: &Canvas<DB>, frame: &Frame, chart: &Chart) -> Result<(), PlotError> {
    let Some(cells) = &chart.cells else { return Ok(()) };
    let (min, max) = cells.range;
    cells.cells.iter().filter(|cell| cell.value.is_finite()).try_for_each(|cell| {
        let (upper_left, lower_right) = (frame.at((cell.x.0, cell.y.1)), frame.at((cell.x.1, cell.y.0)));
        canvas.rectangle(upper_left, lower_right, shade((cell.value - min) / (max - min)))
    })
}

fn signed_dots<DB: DrawingBackend>(canvas: &Canvas<DB>, frame: &Frame, chart: &Chart) -> Result<(), PlotError> {
    let Some(SignedDots { limit, size, dots, .. }) = &chart.signed_dots else { return Ok(()) };
    let within = |axis: &Axis, value: f64| (axis.low..=axis.high).contains(&value);
    dots.iter()
        .filter(|dot| within(&frame.x, dot.x) && within(&frame.y, dot.y) && dot.value.is_finite())
        .try_for_each(|dot| canvas.dot(frame.at((dot.x, dot.y)), signed_shade(0.5 + 0.5 * dot.value / limit), *size))
}

fn band<DB: DrawingBackend>(canvas: &Canvas<DB>, frame: &Frame, series: &Series) -> Result<(), PlotError> {
    let upper = series.band.iter().map(|at| (at.x, at.high));
    let lower = series.band.iter().rev().map(|at| (at.x, at.low));
    let outline: Vec<CanvasPoint> =
        upper.chain(lower).filter(|(x, y)| x.is_finite() && y.is_finite()).map(|point| frame.at(point)).collect();
    if outline.len() < 3 { Ok(()) } else { canvas.polygon(&outline, series.colour.rgb(), 0.2) }
}

fn points<DB: DrawingBackend>(canvas: &Canvas<DB>, frame: &Frame, series: &Series) -> Result<(), PlotError> {
    let colour = series.colour.rgb();
    let is_finite = |point: &(f64, f64)| point.0.is_finite() && point.1.is_finite();
    let mut single = series.points.iter().filter(|point| is_finite(point)).map(|point| frame.at(*point));
    let mut paths = series
        .points
        .split(|point| !is_finite(point))
        .map(|section| decimated(&section.iter().map(|point| frame.at(*point)).collect::<Vec<CanvasPoint>>()));
    match series.mark {
        Mark::Dots(size) => single.try_for_each(|at| canvas.dot(at, colour, size)),
        Mark::Crosses(size) => single.try_for_each(|at| canvas.cross(at, colour, size)),
        Mark::Line(width) => paths.try_for_each(|path| canvas.line(&path, colour, width)),
        Mark::Dashes(width) => paths.try_for_each(|path| canvas.dashes(&path, colour, width)),
    }
}

/// Decimates a path without visible change: within each column of half a point, it keeps the first, lowest, highest
/// and last point.
fn decimated(path: &[CanvasPoint]) -> Vec<CanvasPoint> {
    // Width of a column, points.
    const COLUMN: f64 = 0.5;
    let mut kept: Vec<CanvasPoint> = Vec::new();
    let mut rest = path;
    while let Some(first) = rest.first() {
        let count = rest.iter().take_while(|at| (at.0 - first.0).abs() < COLUMN).count();
        let (column, after) = rest.split_at(count);
        let by_height = |a: &&CanvasPoint, b: &&CanvasPoint| a.1.total_cmp(&b.1);
        let ends = [column.iter().min_by(by_height), column.iter().max_by(by_height)];
        let mut keep: Vec<CanvasPoint> =
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
    fn decimation_keeps_every_peak() {
        // 100 000 points over a width of 100 points (pt), with one spike: a few points per column remain, with the spike.
        let spike = |k: usize| if k == 51_234 { -40.0 } else { 10.0 + (k % 7) as f64 };
        let path: Vec<CanvasPoint> = (0..100_000).map(|k| (k as f64 * 1e-3, spike(k))).collect();
        let kept = decimated(&path);
        assert!(kept.len() < 900, "{}", kept.len());
        assert!(kept.iter().any(|at| at.1 == -40.0));
    }
}
