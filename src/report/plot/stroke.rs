//! Dashed lines.

use super::canvas::{Canvas, CanvasPoint};
use super::{PlotError, Series};
use plotters::prelude::DrawingBackend;

/// Draws a dashed path; `width` is the line width, points.
pub(super) fn dashes<DB: DrawingBackend>(
    canvas: &Canvas<DB>,
    path: &[CanvasPoint],
    series: &Series,
    width: f64,
) -> Result<(), PlotError> {
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
                canvas.line(&std::mem::take(&mut dash), series.colour.rgb(), width)?;
            }
            done += step;
            along += step;
        }
    }
    canvas.line(&dash, series.colour.rgb(), width)
}
