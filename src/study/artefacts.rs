//! What a run leaves for people: plots and a page.

use super::beside::write_text;
use super::estimate::Best;
use super::open_loop::OpenLoopRun;
use super::register::Judged;
use super::result_files::METRICS;
use super::{Manifest, StudyError};
use crate::evaluation::{Errors, InformationBound};
use crate::geometry::{Pose, Trajectory, Vector};
use crate::report::plot::Figure;
use crate::report::{self, Metrics, Section};
use crate::time::Stamp;
use std::collections::BTreeSet;
use std::path::Path;

/// Side of the cells in which the outline has one dot, m.
const CELL_M: f64 = 0.05;
/// Most instants that a curve is drawn of: some dozen to a pixel.
const DRAWN: usize = 50_000;
/// The outline is cut from the cloud at the head's height, give or take this, m.
const CUT_M: f64 = 0.4;

/// A plot with its file's name and its heading.
pub(super) struct Plot {
    name: &'static str,
    section: Section,
}

/// The plots of an estimate; `open_errors` are those that the open loop had, where loops were closed.
pub(super) fn plots(
    run: &OpenLoopRun,
    best: &Best,
    (open_errors, bound): (Option<&Errors>, Option<&InformationBound>),
    sample: &[Judged],
) -> Vec<Plot> {
    let known = best.known;
    let world_from_map = known.and_then(|known| known.world_from_map).unwrap_or_else(Pose::identity);
    let estimate = drawn(best.map_from_head.iter().map(|(stamp, pose)| (stamp, world_from_map * pose)));
    let nothing = Trajectory::new();
    let truth = known.map_or(&nothing, |known| &known.truth);
    let outline = outline(sample, &world_from_map, &estimate);
    let plot = |name, title: &str, figure: Figure| Plot { name, section: Section { title: title.to_owned(), figure } };

    let mut plots = vec![plot("trajectory", "Trajectory", report::trajectory_from_above(truth, &estimate, &outline))];
    if let Some(errors) = known.and_then(|known| known.errors.as_ref()).map(|errors| &errors.drawn) {
        plots.push(plot("errors", "Errors over time", report::errors_over_time(errors)));
        if let Some(open) = open_errors {
            plots.push(plot("loops", "What closing loops is good for", report::errors_of_both_loops(open, errors)));
        }
    }
    plots.extend(bound.map(|bound| plot("bound", "Information bound", report::bound_over_time(bound))));
    plots.push(plot("pitch", "Pitch of the head", report::head_pitch(truth, &estimate)));
    let true_offsets = known.map_or(&[][..], |known| &known.clock_offsets);
    plots.push(plot("clock", "Clock offset", report::clock_offset(true_offsets, &run.clock_offsets)));
    plots
}

/// What is drawn of the poses of a long run.
pub(super) fn drawn(stamped: impl ExactSizeIterator<Item = (Stamp, Pose)>) -> Trajectory {
    let stride = stride(stamped.len());
    Trajectory::from_poses(stamped.step_by(stride)).unwrap_or_default()
}

/// What is drawn of the errors of a long run.
pub(super) fn drawn_errors(errors: &Errors) -> Errors {
    errors.every(stride(errors.stamps.len()))
}

/// One instant in so many is drawn of `count`.
fn stride(count: usize) -> usize {
    count.div_ceil(DRAWN).max(1)
}

/// What of the cloud lies at the head's height: the walls, from above, one point a cell.
fn outline(sample: &[Judged], world_from_map: &Pose, estimate: &Trajectory) -> Vec<Vector> {
    let heights = estimate.poses().iter().map(|pose| pose.translation.z);
    let height = heights.sum::<f64>() / estimate.len().max(1) as f64;
    let at_height = sample
        .iter()
        .map(|judged| world_from_map.rotation * judged.in_map.point + world_from_map.translation.vector)
        .filter(|point| (point.z - height).abs() < CUT_M);
    let cells: BTreeSet<(i64, i64)> =
        at_height.map(|point| ((point.x / CELL_M).round() as i64, (point.y / CELL_M).round() as i64)).collect();
    cells.into_iter().map(|(x, y)| Vector::new(x as f64 * CELL_M, y as f64 * CELL_M, height)).collect()
}

/// Writes the plots, the page, and at last `metrics.json`: the folder is complete then.
pub(super) fn write(folder: &Path, metrics: &Metrics, plots: Vec<Plot>, manifest: &Manifest) -> Result<(), StudyError> {
    let pictures = folder.join("plots");
    std::fs::create_dir_all(&pictures).map_err(StudyError::file(&pictures))?;
    for plot in &plots {
        plot.section.figure.save(&pictures, plot.name)?;
    }
    let sections: Vec<Section> = plots.into_iter().map(|plot| plot.section).collect();
    let page = report::page(metrics, &sections, &manifest.text()?)?;
    write_text(folder, &folder.join("report.html"), &page)?;
    write_text(folder, &folder.join(METRICS), &metrics.to_json()?)
}
