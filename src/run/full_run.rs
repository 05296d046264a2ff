//! The full run: simulation, recording, estimation, evaluation and report.

use super::cloud::{Origin, Surroundings};
use super::estimate::estimate_in;
use super::result_files::{ViewerFiles, full_run_files, remove};
use super::{EstimateOptions, EstimateResult, Manifest, ProgressMonitor, RunError, record};
use std::path::Path;
use zsim_recording::{Reader, TopicPreference};
use zsim_simulation::Simulation;

/// Simulates, records, estimates, evaluates and reports, with all files in the existing `folder`.
///
/// The estimator reads only the recording, as for any other recording. Only the estimated trajectory grows in memory with
/// the length of the run. Files of an earlier run are removed first, and `metrics.json` is written last, as by
/// [`estimate_recording`](super::estimate_recording).
///
/// # Errors
/// When a stage fails or the run is stopped; the files of the completed stages are in the folder.
pub fn simulate_and_estimate(
    simulation: &Simulation,
    options: &EstimateOptions,
    folder: &Path,
    watch: &mut ProgressMonitor,
) -> Result<EstimateResult, RunError> {
    remove(folder, &full_run_files())?;
    let manifest = Manifest::of(simulation).with_estimator(&options.estimator);
    manifest.write(&folder.join("manifest.ron"))?;

    let recording = folder.join("recording.mcap");
    ViewerFiles::of(simulation).write(folder)?;
    let summary = record(simulation, &recording, &folder.join("truth.tum"), false, watch)?;

    // The estimator gets its input only from the file. The truth in it is read only for the evaluation.
    let reader = Reader::open(&recording)?;
    let selection = reader.select(&TopicPreference::default())?;
    let surroundings = Some(Surroundings { world: simulation.world(), carrier: simulation.carrier() });
    let origin = Origin { manifest: &manifest, sensors: manifest.sensors(), surroundings, simulation: Some(&summary) };
    estimate_in(&reader, &selection, folder, options, &origin, watch)
}
