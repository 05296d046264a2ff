//! Estimation from a recording of a sweep, and the measures of the estimate.

use super::Measure;
use super::clock_curve::ClockCurve;
use super::reference_system::{CloudComparison, ReferenceMap};
use super::run_recording::{Estimates, RunRecording};
use super::tree::Journey;
use crate::comparison::{self, Comparison};
use crate::integrity::{Integrity, path_length_m};
use crate::sampled_truth::SampledTruth;
use crate::{ProgressMonitor, StudyError};
use std::fs::File;
use std::sync::atomic::AtomicBool;
use zsim_base::geometry::Trajectory;
use zsim_dynamics::HeadModel;
use zsim_estimation::Status;
use zsim_evaluation::{Errors, Pairs, clock_error_after};
use zsim_report::{ClockMetrics, IntegrityMetrics, OpenLoopMetrics};
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

/// Metrics of an estimate.
pub(super) struct EstimateMetrics {
    open_loop: OpenLoopMetrics,
    clock: ClockMetrics,
    /// The clock offset over time; `None` without truth.
    pub clock_curve: Option<ClockCurve>,
    /// Errors of the clock offset after 30 s and 120 s, s.
    clock_errors_s: [Option<f64>; 2],
    rigid_link_rmse_m: Option<f64>,
    closed_position_rmse_m: Option<f64>,
    closed_loop_time_ratio: Option<f64>,
    slam_bound_m: Option<f64>,
    status: Status,
    integrity: IntegrityMetrics,
    path_length_m: f64,
    cloud: Option<CloudComparison>,
}

impl EstimateMetrics {
    pub(super) fn figure(&self, measure: Measure) -> Option<f64> {
        let figure = match measure {
            Measure::PositionRmseM => self.open_loop.position_rmse_m,
            Measure::RotationRmseDeg => self.open_loop.rotation_rmse_deg,
            Measure::DriftMPerMin => self.open_loop.drift_m_per_min,
            Measure::YawDriftDegPerMin => self.open_loop.yaw_drift_deg_per_min,
            Measure::ClockRmseS => self.clock.offset_rmse_s,
            Measure::ClockError30S => self.clock_errors_s[0],
            Measure::ClockError120S => self.clock_errors_s[1],
            Measure::RigidLinkRmseM => self.rigid_link_rmse_m,
            Measure::ClosedPositionRmseM => self.closed_position_rmse_m,
            Measure::OpenLoopTimeRatio => self.open_loop.fraction_of_acquisition,
            Measure::ClosedLoopTimeRatio => self.closed_loop_time_ratio,
            Measure::ErrorOverSlamBound => {
                self.closed_position_rmse_m.zip(self.slam_bound_m).map(|(error_m, bound_m)| error_m / bound_m)
            }
            Measure::Status => Some(f64::from(self.status as u8)),
            Measure::AlignedRmseM => self.integrity.aligned_rmse_m,
            Measure::LargestErrorM => self.integrity.largest_error_m,
            Measure::BoundM99 => self.integrity.bound_m_99,
            Measure::WithinBound => self.integrity.within_bound,
            Measure::BoundOverError => self.integrity.bound_over_error,
            Measure::WayM => Some(self.path_length_m),
            Measure::DriftOverPath => self.open_loop.end_error_m.map(|error_m| error_m / self.path_length_m),
            _ => self.cloud.as_ref().and_then(|cloud| cloud.figure(measure)),
        };
        figure.filter(|figure| figure.is_finite())
    }
}

/// Estimates from a recording on one thread, and evaluates the result.
pub(super) fn estimate(recording: File, inputs: &RunInputs, stop: &AtomicBool) -> Result<EstimateMetrics, StudyError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    pool.install(|| {
        let mut watch = ProgressMonitor { stop, report: &mut |_| {} };
        let recording = RunRecording::open(recording, inputs.journey.ignore_manifest)?;
        let estimates = recording.estimate(inputs.journey, inputs.closes_loops, &mut watch)?;
        let compare = || CloudComparison::new(&recording, &estimates, inputs.simulation, inputs.reference, &watch);
        let cloud = inputs.compares_clouds.then(compare).transpose()?;
        Ok(EstimateMetrics { cloud, ..metrics(&estimates, inputs, &mut watch) })
    })
}

/// The metrics of the trajectories.
fn metrics(estimates: &Estimates, inputs: &RunInputs, watch: &mut ProgressMonitor) -> EstimateMetrics {
    let Estimates { open: run, closed, truth } = estimates;
    let truth = truth.as_ref();
    let mut compare =
        |map_from_head, covariances| truth.map(|truth| Comparison::new(map_from_head, covariances, truth, watch));
    let known = compare(&run.map_from_head, &run.covariances[..]);
    let map_from_head = estimates.map_from_head();
    let closed_errors = closed.as_ref().and_then(|_| compare(map_from_head, &[]));
    let integrity = Integrity::of(run, closed.as_ref(), map_from_head);
    EstimateMetrics {
        open_loop: comparison::open_loop_metrics(run, known.as_ref(), None),
        clock: comparison::clock_metrics(run, truth),
        clock_curve: truth.map(|truth| ClockCurve::new(&run.clock_offsets, &truth.clock_offsets)),
        clock_errors_s: [30.0, 120.0].map(|after_s| {
            truth.and_then(|truth| clock_error_after(&run.clock_offsets, &truth.clock_offsets, after_s))
        }),
        rigid_link_rmse_m: truth
            .and_then(|truth| rigid_link_rmse_m(inputs.simulation.head(), &run.map_from_head, truth)),
        closed_position_rmse_m: closed_errors.and_then(|known| known.errors).map(|errors| errors.position_rmse_m),
        closed_loop_time_ratio: closed.as_ref().map(|closed| closed.wall_s / run.acquisition_s),
        slam_bound_m: inputs.slam_bound_m,
        status: integrity.status(),
        integrity: integrity.metrics(run, Some(&estimates.pairs())),
        path_length_m: path_length_m(map_from_head),
        cloud: None,
    }
}

/// Position error of the base computed with the rigid link, as `zsim base` does; `None` without a true trajectory of it.
fn rigid_link_rmse_m(head: &HeadModel, map_from_head: &Trajectory, truth: &SampledTruth) -> Option<f64> {
    let base = Trajectory::from_poses(head.base_from_rigid_link(map_from_head)).ok()?;
    let pairs = Pairs::of(&base, &truth.bases);
    Some(Errors::after(&pairs, &pairs.world_from_map().ok()?).position_rmse_m())
}
