//! The plots of a run, and the files of the report.

use super::RunError;
use super::beams::ProjectedBeam;
use super::comparison::decimated;
use super::page::RunResults;
use super::register::SampledBeam;
use super::result_files::METRICS;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::path::Path;
use zsim_base::files::{FileError, replace_text, subfolder};
use zsim_base::geometry::{Pose, Trajectory, Vector};
use zsim_estimation::ReturnClass;
use zsim_report::Metrics;
use zsim_report::page::RunPage;
use zsim_report::plot::Figure;

/// Cell size of the outline in the top view, m; each occupied cell is one dot.
const CELL_M: f64 = 0.05;
/// Half the height of the slice of the cloud, about the head's mean height, that gives the outline, m.
const SLICE_HALF_HEIGHT_M: f64 = 0.4;

/// A plot with its file name.
type Plot = (&'static str, Figure);

/// The plots of an estimate; returns closer than `min_range_m` are from the carrier.
pub(super) fn plots(results: &RunResults, sample: &[SampledBeam], min_range_m: f64) -> Vec<Plot> {
    let RunResults { loops, best, bound, .. } = *results;
    let comparison = best.comparison;
    let world_from_map = comparison.and_then(|found| found.world_from_map).unwrap_or_else(Pose::identity);
    let estimate = decimated(best.map_from_head.iter().map(|(stamp, pose)| (stamp, world_from_map * pose)));
    let no_truth = Trajectory::new();
    let truth = comparison.map_or(&no_truth, |found| &found.truth);
    let is_wall = |beam: &&SampledBeam| {
        let ProjectedBeam { point, origin } = beam.in_map;
        beam.class == ReturnClass::Static && (point - origin).norm() >= min_range_m
    };
    let outline = outline(sample.iter().filter(is_wall), &world_from_map, &estimate);
    let mut plots = vec![("trajectory", zsim_report::trajectory_views(truth, &estimate, &outline))];
    if let Some(errors) = comparison.and_then(|found| found.errors.as_ref()) {
        plots.push(("errors", zsim_report::errors_over_time(errors)));
        let open = loops.open_errors();
        plots.extend(open.map(|open| ("loops", zsim_report::open_and_closed_loop_errors(open, errors))));
    }
    plots.extend(bound.map(|bound| ("bound", zsim_report::bound_over_time(bound))));
    plots.push(("pitch", zsim_report::head_pitch(truth, &estimate)));
    let true_offsets = results.true_offsets().unwrap_or_default();
    plots.push(("clock", zsim_report::clock_offset(true_offsets, &loops.open.estimate.clock_offsets)));
    plots
}

/// Outline of the walls in the top view: end points of beams near the head's mean height, one for each cell.
fn outline<'a>(
    beams: impl Iterator<Item = &'a SampledBeam>,
    world_from_map: &Pose,
    estimate: &Trajectory,
) -> Vec<Vector> {
    let heights = estimate.poses().iter().map(|pose| pose.translation.z);
    let height = heights.sum::<f64>() / estimate.len().max(1) as f64;
    let at_height = beams
        .map(|beam| world_from_map.rotation * beam.in_map.point + world_from_map.translation.vector)
        .filter(|point| (point.z - height).abs() < SLICE_HALF_HEIGHT_M);
    let cells: BTreeSet<(i64, i64)> =
        at_height.map(|point| ((point.x / CELL_M).round() as i64, (point.y / CELL_M).round() as i64)).collect();
    cells.into_iter().map(|(x, y)| Vector::new(x as f64 * CELL_M, y as f64 * CELL_M, height)).collect()
}

/// Writes the plots and the page, then `metrics.json`.
pub(super) fn write(folder: &Path, plots: &[Plot], page: &RunPage) -> Result<(), RunError> {
    let pictures = subfolder(folder, "plots").map_err(FileError::at(folder))?;
    plots.par_iter().try_for_each(|(name, figure)| figure.save(&pictures, name).map(drop))?;
    replace_text(&folder.join("report.html"), &page.html())?;
    write_metrics(folder, page.metrics)
}

/// Writes `metrics.json`, which marks the folder as complete.
pub(super) fn write_metrics(folder: &Path, metrics: &Metrics) -> Result<(), RunError> {
    Ok(replace_text(&folder.join(METRICS), &metrics.to_json()?)?)
}
