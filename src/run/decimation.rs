//! Decimation of curves for plots.

use zsim_base::geometry::{Pose, Trajectory};
use zsim_base::time::Stamp;
use zsim_evaluation::Errors;

/// Maximum number of points of a curve: about a dozen for each pixel of the plot's width.
const MAX_PLOT_POINTS: usize = 50_000;

/// Decimates poses to the maximum number of plot points.
pub(super) fn decimated(stamped: impl ExactSizeIterator<Item = (Stamp, Pose)>) -> Trajectory {
    let stride = stride(stamped.len());
    Trajectory::from_poses(stamped.step_by(stride)).unwrap_or_default()
}

/// Decimates errors to the maximum number of plot points.
pub(super) fn decimated_errors(errors: &Errors) -> Errors {
    errors.decimated(stride(errors.stamps.len()))
}

/// The decimation factor for `count` points.
fn stride(count: usize) -> usize {
    count.div_ceil(MAX_PLOT_POINTS).max(1)
}
