//! Simulations.

use crate::arguments;
use crate::background;
use crate::failure::Failure;
use crate::recording::Recording;
use pyo3::prelude::*;
use std::path::{Path, PathBuf};
use zsim::recording::other_format;
use zsim::run::record;
use zsim::simulation::{Scenario, Simulation};

/// Simulates the scenario, JSON, into the recording `path`, or into a temporary file.
#[pyfunction]
#[pyo3(signature = (scenario, path, overwrite, progress))]
pub fn simulate(
    py: Python<'_>,
    scenario: &str,
    path: Option<PathBuf>,
    overwrite: bool,
    progress: Option<Py<PyAny>>,
) -> Result<Recording, Failure> {
    let scenario: Scenario = arguments::read(scenario)?;
    let folder = match &path {
        Some(_) => None,
        None => Some(tempfile::tempdir().map_err(|error| Failure::other(format!("no temporary folder: {error}")))?),
    };
    let recording = match (path, &folder) {
        (Some(path), _) => path,
        (None, Some(folder)) => folder.path().join("recording.mcap"),
        (None, None) => return Err(Failure::other("no file for the recording")),
    };
    let truth = recording.with_extension("tum");
    if truth == recording {
        return Err(Failure::input("path: the recording needs another ending than .tum, such as .mcap"));
    }
    if let Some(format) = other_format(&recording) {
        let name = recording.display();
        return Err(Failure::input(format!(
            "path={name}: this is the ending of {format}; recordings are MCAP: use .mcap"
        )));
    }
    if let Some(existing) = [&recording, &truth].into_iter().find(|file| file.exists() && !overwrite) {
        let message = format!("{} exists: pass another path, or overwrite=True", existing.display());
        return Err(Failure::input(message));
    }
    // The old files last until the new ones are complete.
    let files = [recording.clone(), truth];
    let replaces = files.iter().any(|file| file.exists());
    let written = if replaces { files.each_ref().map(|file| unfinished(file)) } else { files.clone() };
    let [mcap, tum] = written.clone();
    let recorded = background::run(py, progress.as_ref(), move |progress| {
        let simulation = Simulation::prepare(&scenario)?;
        progress.monitored(|watch| record(&simulation, &mcap, &tum, false, watch))?;
        Ok(())
    });
    for (from, to) in written.iter().zip(&files).rev().filter(|_| replaces) {
        match &recorded {
            Ok(()) => std::fs::rename(from, to)
                .map_err(|error| Failure::other(format!("{} cannot be replaced: {error}", to.display())))?,
            // A fragment that cannot be removed is next to the complete file, under another name.
            Err(_) => drop(std::fs::remove_file(from)),
        }
    }
    recorded?;
    Recording::of(recording, folder)
}

/// Name of a file until it is complete: `run.partial.mcap` for `run.mcap`.
fn unfinished(file: &Path) -> PathBuf {
    let ending = file.extension().map(|ending| format!(".{}", ending.to_string_lossy())).unwrap_or_default();
    file.with_extension(format!("partial{ending}"))
}
