//! Files for viewers, next to what they show: layouts of Foxglove, and the head as a robot model.

use std::path::Path;
use zsim_base::files::{FileError, replace_text};
use zsim_head::spring::HeadExport;
use zsim_simulation::Simulation;

/// Layout for `recording.mcap`.
pub(super) const RECORDING_LAYOUT: &str = "recording.foxglove.json";
/// Layout for `result.mcap`.
pub(super) const RESULT_LAYOUT: &str = "result.foxglove.json";
/// The head on its spring, with the frames of the recording.
pub(super) const HEAD_MODEL: &str = "head.urdf";

/// Files for viewers of a recording: their contents.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewerFiles {
    /// Layout of Foxglove.
    pub layout: &'static str,
    /// The head on its spring as URDF. `None` for a head that is not on springs, or that six joints cannot show; viewers show
    /// its frames.
    pub head_model: Option<String>,
}

impl ViewerFiles {
    /// The files for the recording of `simulation`.
    pub fn of(simulation: &Simulation) -> Self {
        let head_model = HeadExport::new(&simulation.inputs().head.spec, simulation.head());
        Self {
            layout: include_str!("layouts/recording.foxglove.json"),
            head_model: head_model.ok().map(|model| model.urdf()),
        }
    }

    /// Writes the files to the folder of a full run.
    pub(super) fn write(&self, folder: &Path) -> Result<(), FileError> {
        replace_text(&folder.join(RECORDING_LAYOUT), self.layout)?;
        self.head_model.as_ref().map_or(Ok(()), |model| replace_text(&folder.join(HEAD_MODEL), model))
    }
}

/// Writes the file for the result of an estimate to `folder`.
pub(super) fn write_for_result(folder: &Path) -> Result<(), FileError> {
    let layout = include_str!("layouts/result.foxglove.json");
    replace_text(&folder.join(RESULT_LAYOUT), layout)
}
