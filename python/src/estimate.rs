//! Estimates from a recording.

use crate::arguments;
use crate::arrays::as_python;
use crate::background;
use crate::failure::Failure;
use crate::trajectory::Trajectory;
use pyo3::prelude::*;
use serde::Deserialize;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use zsim::estimation;
use zsim::recording::{Reader, TopicPreference, read_tum};
use zsim::report::Metrics;
use zsim::run::{CalibrationSpec, EstimateOptions, estimate_recording};

/// Settings of an estimate, JSON.
#[derive(Deserialize)]
struct Settings {
    estimator: String,
    calibration: Option<PathBuf>,
    closed_loop: bool,
    ignore_manifest: bool,
}

/// Trajectories and figures of an estimate.
#[pyclass(frozen, module = "zsim")]
pub struct Estimate {
    metrics: Metrics,
    path: PathBuf,
    /// The folder of results that are deleted with this object.
    _folder: Option<TempDir>,
}

/// Estimates the trajectory from the recording `path` into the folder `out`, or into a temporary one.
#[pyfunction]
#[pyo3(signature = (path, settings, out, progress))]
pub fn estimate(
    py: Python<'_>,
    path: PathBuf,
    settings: &str,
    out: Option<PathBuf>,
    progress: Option<Py<PyAny>>,
) -> Result<Estimate, Failure> {
    let settings: Settings = arguments::read(settings)?;
    let calibration =
        settings.calibration.map_or_else(|| Ok(CalibrationSpec::default()), |file| CalibrationSpec::read(&file))?;
    let options = EstimateOptions {
        calibration,
        closed_loop: settings.closed_loop,
        ignore_manifest: settings.ignore_manifest,
        ..EstimateOptions::with(estimation::load(&settings.estimator)?)
    };
    let (out, folder) = results_folder(out)?;
    let results = out.clone();
    let metrics = background::run(py, progress.as_ref(), move |progress| {
        let reader = Reader::open(&path)?;
        let selection = reader.select(&TopicPreference::default())?;
        let estimated =
            progress.monitored(|watch| estimate_recording(&reader, &selection, &results, &options, watch))?;
        Ok(estimated.metrics)
    })?;
    Ok(Estimate { metrics, path: out, _folder: folder })
}

/// The folder for results, created if needed; it must be empty. Without `out`, a temporary one.
fn results_folder(out: Option<PathBuf>) -> Result<(PathBuf, Option<TempDir>), Failure> {
    let failed = |path: &Path, error: &std::io::Error| Failure::other(format!("{}: {error}", path.display()));
    let Some(out) = out else {
        let folder = tempfile::tempdir().map_err(|error| failed(&std::env::temp_dir(), &error))?;
        return Ok((folder.path().to_owned(), Some(folder)));
    };
    std::fs::create_dir_all(&out).map_err(|error| failed(&out, &error))?;
    let mut entries = std::fs::read_dir(&out).map_err(|error| failed(&out, &error))?;
    match entries.next() {
        Some(_) => Err(Failure::input(format!("{} is not empty: pass another folder", out.display()))),
        None => Ok((out, None)),
    }
}

#[pymethods]
impl Estimate {
    /// The folder with all results, as of `zsim estimate`.
    #[getter]
    fn path(&self) -> &Path {
        &self.path
    }

    /// The verdict: "good", "degraded" or "lost".
    #[getter]
    fn status(&self) -> Option<&str> {
        self.metrics.status.as_deref()
    }

    /// The figures of `metrics.json`.
    #[getter]
    fn metrics<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>, Failure> {
        as_python(py, &self.metrics)
    }

    /// The open-loop trajectory, `map_from_head`, in lidar time.
    #[getter]
    fn open_loop(&self) -> Result<Trajectory, Failure> {
        Ok(Trajectory(read_tum(&self.path.join("open_loop.tum"))?))
    }

    /// The trajectory after the loop closure; None without it.
    #[getter]
    fn closed_loop(&self) -> Result<Option<Trajectory>, Failure> {
        let path = self.path.join("closed_loop.tum");
        path.exists().then(|| Ok(Trajectory(read_tum(&path)?))).transpose()
    }

    fn __repr__(&self) -> String {
        format!("<zsim.Estimate: {}, {}>", self.status().unwrap_or("no verdict"), self.path.display())
    }
}
