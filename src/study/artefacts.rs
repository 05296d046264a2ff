//! The plots and the HTML page of a run.

use super::atomic_file::write_text;
use super::estimate::BestEstimate;
use super::open_loop::OpenLoopRun;
use super::register::SampledBeam;
use super::result_files::METRICS;
use super::{Manifest, StudyError};
use crate::evaluation::{Errors, InformationBound};
use crate::geometry::{Pose, Trajectory, Vector};
use crate::report::plot::Figure;
use crate::report::{self, Metrics, Section};
use crate::time::Stamp;
use std::collections::BTreeSet;
use std::path::Path;

/// Cell size of the outline in the top view, m; each occupied cell is one dot.
const CELL_M: f64 = 0.05;
/// Maximum number of points of a curve: about a dozen for each pixel of the plot's width.
const MAX_PLOT_POINTS: usize = 50_000;
/// Half the height of the slice of the cloud, about the head's mean height, that gives the outline, m.
const SLICE_HALF_HEIGHT_M: f64 = 0.4;

/// A plot with a file name and a heading.
pub(super) struct Plot {
    name: &'static str,
    section: Section,
}

/// The plots of an estimate; `open_errors` are the errors of the open loop if a closed loop was computed.
pub(super) fn plots(
    run: &OpenLoopRun,
    best: &BestEstimate,
    (open_errors, bound): (Option<&Errors>, Option<&InformationBound>),
    sample: &[SampledBeam],
) -> Vec<Plot> {
    let comparison = best.comparison;
    let world_from_map = comparison.and_then(|found| found.world_from_map).unwrap_or_else(Pose::identity);
    let estimate = decimated(best.map_from_head.iter().map(|(stamp, pose)| (stamp, world_from_map * pose)));
    let no_truth = Trajectory::new();
    let truth = comparison.map_or(&no_truth, |found| &found.truth);
    let outline = outline(sample, &world_from_map, &estimate);
    let plot = |name, title: &str, figure: Figure| Plot { name, section: Section { title: title.to_owned(), figure } };

    let mut plots = vec![plot("trajectory", "Trajectory", report::trajectory_top_view(truth, &estimate, &outline))];
    if let Some(errors) = comparison.and_then(|found| found.errors.as_ref()).map(|errors| &errors.decimated) {
        plots.push(plot("errors", "Errors over time", report::errors_over_time(errors)));
        if let Some(open) = open_errors {
            let figure = report::open_and_closed_loop_errors(open, errors);
            plots.push(plot("loops", "Position error: open loop and closed loop", figure));
        }
    }
    plots.extend(bound.map(|bound| plot("bound", "Information bound", report::bound_over_time(bound))));
    plots.push(plot("pitch", "Pitch of the head", report::head_pitch(truth, &estimate)));
    let true_offsets = comparison.map_or(&[][..], |found| &found.clock_offsets);
    plots.push(plot("clock", "IMU clock offset", report::clock_offset(true_offsets, &run.clock_offsets)));
    plots
}

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

/// Outline of the walls in the top view: cloud points near the head's mean height, one for each cell.
fn outline(sample: &[SampledBeam], world_from_map: &Pose, estimate: &Trajectory) -> Vec<Vector> {
    let heights = estimate.poses().iter().map(|pose| pose.translation.z);
    let height = heights.sum::<f64>() / estimate.len().max(1) as f64;
    let at_height = sample
        .iter()
        .map(|beam| world_from_map.rotation * beam.in_map.point + world_from_map.translation.vector)
        .filter(|point| (point.z - height).abs() < SLICE_HALF_HEIGHT_M);
    let cells: BTreeSet<(i64, i64)> =
        at_height.map(|point| ((point.x / CELL_M).round() as i64, (point.y / CELL_M).round() as i64)).collect();
    cells.into_iter().map(|(x, y)| Vector::new(x as f64 * CELL_M, y as f64 * CELL_M, height)).collect()
}

/// Writes the plots and the page, then `metrics.json`, which marks the folder as complete.
pub(super) fn write(folder: &Path, metrics: &Metrics, plots: Vec<Plot>, manifest: &Manifest) -> Result<(), StudyError> {
    let pictures = folder.join("plots");
    std::fs::create_dir_all(&pictures).map_err(StudyError::file(&pictures))?;
    for plot in &plots {
        plot.section.figure.save(&pictures, plot.name)?;
    }
    let sections: Vec<Section> = plots.into_iter().map(|plot| plot.section).collect();
    let page = report::page(metrics, &sections, &manifest.to_ron()?)?;
    write_text(folder, &folder.join("report.html"), &page)?;
    write_text(folder, &folder.join(METRICS), &metrics.to_json()?)
}
