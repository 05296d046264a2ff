//! A reference system: a second simulated system in the scene of a run, whose map the map of the run is compared with.

use super::cloud::{Surroundings, in_world};
use super::loops::Loops;
use super::record::{description, record_together};
use super::results::{ReferenceResults, Results};
use super::run_recording::RunRecording;
use super::{ProgressMonitor, ReferenceInputs, RunError, RunInputs};
use zsim_base::files::FileError;
use zsim_base::geometry::{Pose, Surface, Vector};
use zsim_estimation::{EstimatorSpec, Status};
use zsim_evaluation::{CloudErrors, Errors, Pairs, ReferenceCloud, align_poses};
use zsim_recording::Writer;
use zsim_simulation::{Simulation, carrier_of};

/// Maximum number of points of the reference cloud.
const MAX_REFERENCE_POINTS: usize = 500_000;
/// Maximum number of points of the compared cloud.
const MAX_POINTS: usize = 100_000;
/// Maximum distance from a point to a surface, m.
const REACH_M: f64 = 1.0;
/// Weight of a rotation in the alignment with the truth: equivalent shift per angle, m. A reference at rest has
/// no path that determines the rotation.
const TURN_LEVER_M: f64 = 0.3;

/// Map of a reference system; it has no surfaces if the estimate of that system is lost.
pub(super) struct ReferenceMap {
    inputs: ReferenceInputs,
    /// Settings with which it was estimated.
    estimator: EstimatorSpec,
    cloud: ReferenceCloud,
    /// Position error of the reference system, m.
    rmse_m: f64,
}

impl ReferenceMap {
    /// Simulates, records and estimates the reference system `inputs` of a run.
    ///
    /// # Errors
    /// If its specs do not make a simulation, if the recording cannot be written, or if the estimate fails.
    pub(super) fn of(inputs: &ReferenceInputs, run: &RunInputs, watch: &mut ProgressMonitor) -> Result<Self, RunError> {
        let mut simulated = run.simulation.clone();
        (simulated.head, simulated.motion, simulated.lidar) =
            (inputs.head.clone(), inputs.motion.clone(), inputs.lidar.clone());
        (simulated.faults, simulated.base_imu) = (None, None);
        let simulation = Simulation::build(simulated)?;
        let file = tempfile::tempfile().map_err(FileError::at(&std::env::temp_dir()))?;
        let written = file.try_clone().map_err(FileError::at(&std::env::temp_dir()))?;
        let writer = Writer::new(written, description(&simulation, false)?)?;
        record_together(std::slice::from_ref(&simulation), vec![writer], watch)?;
        let recording = RunRecording::open(file, false)?;
        let loops = recording.estimate(&run.estimator.spec, true, watch)?;
        let aligned = AlignedCloud::new(&recording, &loops, &simulation, MAX_REFERENCE_POINTS, watch)?;
        // A lost reference has no surfaces to compare with.
        let is_known = loops.integrity().status() != Status::Lost;
        let points = aligned.estimated.into_iter().filter(|_| is_known).map(|(point, _)| point);
        let estimator = run.estimator.spec.clone();
        Ok(Self { inputs: inputs.clone(), estimator, cloud: ReferenceCloud::new(points), rmse_m: aligned.rmse_m })
    }

    /// Whether the map is that of these specs, estimated with the settings of `run`.
    pub(super) fn is_of(&self, inputs: &ReferenceInputs, run: &RunInputs) -> bool {
        self.inputs == *inputs && self.estimator == run.estimator.spec
    }
}

/// A point in the world and the position of the sensor, m.
type SeenPoint = (Vector, Option<Vector>);

/// Points on static surfaces, aligned with the truth.
struct AlignedCloud {
    /// Projected by the estimate.
    estimated: Vec<SeenPoint>,
    /// The same beams projected by the truth.
    by_truth: Vec<SeenPoint>,
    /// Position error of the estimate after the same alignment, m.
    rmse_m: f64,
}

impl AlignedCloud {
    fn new(
        recording: &RunRecording,
        loops: &Loops,
        simulation: &Simulation,
        limit: usize,
        watch: &ProgressMonitor,
    ) -> Result<Self, RunError> {
        let pairs: Pairs = loops.pairs().unwrap_or_default();
        let world_from_map = align_poses(pairs.truth(), pairs.estimate(), TURN_LEVER_M)?;
        let carrier = carrier_of(&simulation.inputs().head.spec);
        let surroundings = Surroundings { world: simulation.world(), carrier: &carrier };
        let beams = recording.static_beams(loops, surroundings, limit, || watch.check_stop())?;
        Ok(Self {
            estimated: beams.iter().map(|(in_map, _)| in_world(in_map, &world_from_map)).collect(),
            by_truth: beams.iter().map(|(_, by_truth)| in_world(by_truth, &Pose::identity())).collect(),
            rmse_m: Errors::after(&pairs, &world_from_map).position_rmse_m(),
        })
    }
}

/// Adds the distances of the cloud of an estimate to the true surfaces, and to the map of a reference system if there is one.
///
/// # Errors
/// If the recording cannot be read, if it cannot be aligned with the truth, or if the run is stopped.
pub(super) fn compare_clouds(
    recording: &RunRecording,
    loops: &Loops,
    simulation: &Simulation,
    reference: Option<&ReferenceMap>,
    watch: &ProgressMonitor,
    results: &mut Results,
) -> Result<(), RunError> {
    let aligned = AlignedCloud::new(recording, loops, simulation, MAX_POINTS, watch)?;
    let summary =
        |surface: &dyn Surface, points: &[SeenPoint]| CloudErrors::to_surface(surface, points, REACH_M).summary();
    let to_reference = reference.and_then(|reference| summary(&reference.cloud, &aligned.estimated));
    let to_truth = summary(simulation.world(), &aligned.estimated);
    let cloud = &mut results.metrics.cloud;
    (cloud.sigma_m, cloud.bias_m) = (to_truth.map(|cloud| cloud.sigma_m), to_truth.map(|cloud| cloud.bias_m));
    cloud.sigma_by_truth_m = summary(simulation.world(), &aligned.by_truth).map(|cloud| cloud.sigma_m);
    results.reference = ReferenceResults {
        sigma_m: to_reference.map(|cloud| cloud.sigma_m),
        bias_m: to_reference.map(|cloud| cloud.bias_m),
        rmse_m: reference.map(|reference| reference.rmse_m),
    };
    Ok(())
}
