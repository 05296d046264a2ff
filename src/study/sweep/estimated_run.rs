//! Estimation from a recording of a sweep, and its results.

use super::clock_curve::ClockCurve;
use super::reference_system::{CloudComparison, ReferenceMap};
use super::results::Results;
use super::run_recording::{Estimates, RunRecording};
use super::tree::Journey;
use crate::comparison::{self, Comparison};
use crate::integrity::Integrity;
use crate::sampled_truth::SampledTruth;
use crate::{ProgressMonitor, StudyError};
use std::fs::File;
use std::sync::atomic::AtomicBool;
use zsim_base::geometry::Trajectory;
use zsim_dynamics::HeadModel;
use zsim_evaluation::{Errors, Pairs};
use zsim_report::Metrics;
use zsim_simulation::Simulation;

/// What a run is compared with.
pub(super) struct RunInputs<'a> {
    pub simulation: &'a Simulation,
    pub journey: &'a Journey,
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
    inputs: &RunInputs,
    stop: &AtomicBool,
) -> Result<(Results, Option<ClockCurve>), StudyError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    pool.install(|| {
        let mut watch = ProgressMonitor { stop, report: &mut |_| {} };
        let recording = RunRecording::open(recording, inputs.journey.ignore_manifest)?;
        let estimates = recording.estimate(inputs.journey, inputs.closes_loops, &mut watch)?;
        let mut results = results(&estimates, inputs, &mut watch);
        if inputs.compares_clouds {
            let compared = CloudComparison::new(&recording, &estimates, inputs.simulation, inputs.reference, &watch)?;
            compared.add_to(&mut results);
        }
        let curve = |truth: &SampledTruth| ClockCurve::new(&estimates.open.clock_offsets, &truth.clock_offsets);
        Ok((results, estimates.truth.as_ref().map(curve)))
    })
}

/// The results without those of the cloud.
fn results(estimates: &Estimates, inputs: &RunInputs, watch: &mut ProgressMonitor) -> Results {
    let Estimates { open: run, closed, truth } = estimates;
    let truth = truth.as_ref();
    let mut compare =
        |map_from_head, covariances| truth.map(|truth| Comparison::new(map_from_head, covariances, truth, watch));
    let known = compare(&run.map_from_head, &run.covariances[..]);
    let map_from_head = estimates.map_from_head();
    let closed_loop = closed
        .as_ref()
        .map(|closed| comparison::closed_loop_metrics(closed, compare(map_from_head, &[]).as_ref(), run.acquisition_s));
    let integrity = Integrity::of(run, closed.as_ref(), map_from_head);
    let metrics = Metrics {
        status: Some(integrity.status().name().to_owned()),
        integrity: integrity.metrics(run, map_from_head, Some(&estimates.pairs())),
        open_loop: comparison::open_loop_metrics(run, known.as_ref(), None),
        closed_loop: closed_loop.unwrap_or_default(),
        clock: comparison::clock_metrics(run, truth),
        ..Metrics::default()
    };
    Results {
        metrics,
        rigid_link_rmse_m: truth
            .and_then(|truth| rigid_link_rmse_m(inputs.simulation.head(), &run.map_from_head, truth)),
        slam_bound_m: inputs.slam_bound_m,
        ..Results::default()
    }
}

/// Position error of the base computed with the rigid link, as `zsim base` does; `None` without a true trajectory of it.
fn rigid_link_rmse_m(head: &HeadModel, map_from_head: &Trajectory, truth: &SampledTruth) -> Option<f64> {
    let base = Trajectory::from_poses(head.base_from_rigid_link(map_from_head)).ok()?;
    let pairs = Pairs::of(&base, &truth.bases);
    Some(Errors::after(&pairs, &pairs.world_from_map().ok()?).position_rmse_m())
}
