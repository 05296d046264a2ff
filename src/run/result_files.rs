//! The files of a result folder.

use super::RunError;
use std::io::ErrorKind;
use std::path::Path;
use zsim_base::files::{FileError, PARTIAL_PREFIX, inside, replace_text};
use zsim_head::spring::HeadExport;
use zsim_simulation::Simulation;

/// Written last and removed first: a folder that has it is complete, and all its files are of one run.
pub const METRICS: &str = "metrics.json";

/// Plots of an estimate, each as SVG and PNG in `plots/`.
const PLOTS: [&str; 6] = ["trajectory", "errors", "loops", "bound", "pitch", "clock"];

/// The files that an estimate may write to its folder, `metrics.json` first.
pub fn estimate_files() -> Vec<String> {
    let names = [
        METRICS,
        "report.html",
        "manifest.ron",
        "open_loop.tum",
        "closed_loop.tum",
        "map.ply",
        "result.mcap",
        RESULT_LAYOUT,
        "cloud.ply",
        "cloud.las",
        "integrity.csv",
        "windows.csv",
    ];
    let plots = PLOTS.iter().flat_map(|name| ["svg", "png"].map(|ending| format!("plots/{name}.{ending}")));
    names.map(str::to_owned).into_iter().chain(plots).collect()
}

/// The files that a simulation with its estimate may write to its folder, `metrics.json` first.
pub fn full_run_files() -> Vec<String> {
    let recording = ["recording.mcap", "truth.tum", RECORDING_LAYOUT, HEAD_MODEL].map(str::to_owned);
    estimate_files().into_iter().chain(recording).collect()
}

/// Removes files of an earlier run from `folder`, in this order, and the partial files of one that was killed; other
/// files stay.
pub(super) fn remove(folder: &Path, names: &[String]) -> Result<(), RunError> {
    for name in names {
        let path = inside(folder, name).map_err(FileError::at(folder))?;
        match std::fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(FileError::at(&path)(error).into()),
            _ => {}
        }
    }
    for entry in std::fs::read_dir(folder).map_err(FileError::at(folder))?.flatten() {
        let is_partial = entry.file_name().to_string_lossy().starts_with(PARTIAL_PREFIX);
        if is_partial && entry.file_type().is_ok_and(|kind| kind.is_file()) {
            std::fs::remove_file(entry.path()).map_err(FileError::at(&entry.path()))?;
        }
    }
    Ok(())
}

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
