//! The whole journey.

use super::cloud::Surroundings;
use super::estimate::{Origin, estimate_in};
use super::result_files::{journey_files, remove};
use super::{EstimateOptions, Manifest, Outcome, StudyError, Watch, record};
use crate::recording::Reader;
use crate::simulation::Simulation;
use std::path::Path;

/// From spring to trajectory error: simulates, records, estimates, judges, reports, all in `folder`, which exists.
///
/// The estimator sees what the recording's file says, as of anybody's recording, and nothing else. Nothing is held in
/// memory that grows with the run but the estimated trajectory. Files of an earlier run are removed first, and
/// `metrics.json` is written last, as by [`estimate_recording`](super::estimate_recording).
///
/// # Errors
/// When a part fails, or somebody stops it; what came before is in the folder.
pub fn journey(
    simulation: &Simulation,
    wishes: &EstimateOptions,
    folder: &Path,
    watch: &mut Watch,
) -> Result<Outcome, StudyError> {
    remove(folder, &journey_files())?;
    let manifest = Manifest::of(simulation).with_estimator(&wishes.estimator);
    manifest.write(&folder.join("manifest.ron"))?;

    // The world, the head on its spring, the sensors: what they say goes to a file.
    let recording = folder.join("recording.mcap");
    let summary = record(simulation, &recording, &folder.join("truth.tum"), false, watch)?;

    // From here on there is only the file: estimate, register, judge by the truth that is kept apart in it, report.
    let reader = Reader::open(&recording)?;
    let surroundings = Some(Surroundings { world: simulation.world(), carrier: simulation.carrier() });
    let origin = Origin { manifest: &manifest, surroundings, simulation: Some(&summary) };
    estimate_in(&reader, folder, wishes, &origin, watch)
}
