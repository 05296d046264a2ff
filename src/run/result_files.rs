//! The files of a result folder.

use super::RunError;
use super::viewer_files::{HEAD_MODEL, RECORDING_LAYOUT, RESULT_LAYOUT};
use std::io::ErrorKind;
use std::path::Path;
use zsim_base::files::FileError;
use zsim_base::files::PARTIAL_PREFIX;
use zsim_base::files::inside;

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
