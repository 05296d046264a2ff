//! Estimation from a recording of a study, and its results.

use super::clock_curve::ClockCurve;
use super::loops::Loops;
use super::reference_system::{CloudComparison, ReferenceMap};
use super::results::Results;
use super::run_recording::RunRecording;
use super::sampled_truth::SampledTruth;
use super::{ProgressMonitor, RunError, RunInputs};
use std::fs::File;
use std::sync::atomic::AtomicBool;
use zsim_base::geometry::Trajectory;
use zsim_dynamics::HeadModel;
use zsim_evaluation::{Errors, Pairs};
use zsim_simulation::Simulation;

/// What is estimated from a recording, and what the estimate is compared with.
pub(super) struct EstimatedRun<'a> {
    pub simulation: &'a Simulation,
    pub inputs: &'a RunInputs,
    pub closes_loops: bool,
    /// Information bound with an unknown map, m.
    pub slam_bound_m: Option<f64>,
    /// Whether the cloud is compared with the true surfaces.
    pub compares_clouds: bool,
    /// Map of the reference system.
    pub reference: Option<&'a ReferenceMap>,
}

/// Estimates from a recording on one thread; returns the results, and the clock offset over time if the truth is known.
///
/// # Errors
/// If the recording cannot be read, the estimate fails, or the run is stopped.
pub(super) fn estimate(
    recording: File,
    run: &EstimatedRun,
    stop: &AtomicBool,
) -> Result<(Results, Option<ClockCurve>), RunError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    pool.install(|| {
        let mut watch = ProgressMonitor { stop, report: &mut |_| {} };
        let recording = RunRecording::open(recording, run.inputs.ignore_manifest)?;
        let loops = recording.estimate(run.inputs, run.closes_loops, &mut watch)?;
        let mut results = results(&loops, run);
        if run.compares_clouds {
            let compared = CloudComparison::new(&recording, &loops, run.simulation, run.reference, &watch)?;
            compared.add_to(&mut results);
        }
        let curve = |truth: &SampledTruth| ClockCurve::new(&loops.open.estimate.clock_offsets, &truth.clock_offsets);
        Ok((results, loops.truth.as_ref().map(curve)))
    })
}

/// The results without those of the cloud.
fn results(loops: &Loops, run: &EstimatedRun) -> Results {
    let rigid_link = |truth| rigid_link_rmse_m(run.simulation.head(), &loops.open.estimate.trajectory, truth);
    Results {
        metrics: loops.metrics(&loops.integrity(), loops.pairs().as_ref()),
        rigid_link_rmse_m: loops.truth.as_ref().and_then(rigid_link),
        slam_bound_m: run.slam_bound_m,
        ..Results::default()
    }
}

/// Position error of the base computed with the rigid link, as `zsim base` does; `None` without a true trajectory of it.
fn rigid_link_rmse_m(head: &HeadModel, map_from_head: &Trajectory, truth: &SampledTruth) -> Option<f64> {
    let base = Trajectory::from_poses(head.base_from_rigid_link(map_from_head)).ok()?;
    let pairs = Pairs::of(&base, &truth.bases);
    Some(Errors::after(&pairs, &pairs.world_from_map().ok()?).position_rmse_m())
}
