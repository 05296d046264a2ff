//! Files for viewers, next to what they show: layouts of Foxglove, and the head as a robot model.

use super::StudyError;
use super::atomic_file::write_text;
use super::spring::HeadExport;
use crate::simulation::Simulation;
use std::path::Path;

/// Layout for `recording.mcap`.
pub(super) const RECORDING_LAYOUT: &str = "recording.foxglove.json";
/// Layout for `result.mcap`.
pub(super) const RESULT_LAYOUT: &str = "result.foxglove.json";
/// The head on its spring, with the frames of the recording.
pub(super) const HEAD_MODEL: &str = "head.urdf";

/// Writes the files for the recording of `simulation` to `folder`.
pub(super) fn write_for_recording(folder: &Path, simulation: &Simulation) -> Result<(), StudyError> {
    let layout = include_str!("../../examples/viewers/recording.foxglove.json");
    write_text(folder, &folder.join(RECORDING_LAYOUT), layout)?;
    // A head that is not on springs, or that six joints cannot show, has no such model; viewers show its frames.
    match HeadExport::new(&simulation.inputs().head.spec, simulation.head()) {
        Ok(model) => write_text(folder, &folder.join(HEAD_MODEL), &model.urdf()),
        Err(_) => Ok(()),
    }
}

/// Writes the file for the result of an estimate to `folder`.
pub(super) fn write_for_result(folder: &Path) -> Result<(), StudyError> {
    let layout = include_str!("../../examples/viewers/result.foxglove.json");
    write_text(folder, &folder.join(RESULT_LAYOUT), layout)
}
