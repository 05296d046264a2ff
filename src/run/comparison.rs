//! Comparison of an estimate with the truth in the recording.

use super::ProgressMonitor;
use super::closed_loop::ClosedLoopRun;
use super::open_loop::OpenLoopRun;
use super::sampled_truth::SampledTruth;
use zsim_base::geometry::{Pose, PoseCovariance, Trajectory};
use zsim_base::measurement::LidarCorrection;
use zsim_base::time::{Span, Stamp};
use zsim_estimation::EstimatorSpec;
use zsim_evaluation::{
    Errors, EvaluationError, Pairs, clock_error, clock_error_after, consistency, drift, relative_error,
};
use zsim_report::{ClockMetrics, ClosedLoopMetrics, LidarMetrics, LoopMetrics, OpenLoopMetrics, SimulationMetrics};
use zsim_simulation::SimulationSummary;

/// Maximum number of points of a curve in a plot: about a dozen for each pixel of its width.
const MAX_PLOT_POINTS: usize = 50_000;

/// Comparison of an estimate with the truth.
pub(super) struct Comparison {
    /// The true trajectory, `world_from_head`, decimated for plots.
    pub truth: Trajectory,
    /// Rigid alignment of the estimate by all positions; `None` if they do not determine it.
    pub world_from_map: Option<Pose>,
    /// Errors over time after this alignment, decimated for plots.
    pub errors: Option<Errors>,
    /// Errors and consistency, as metrics of an open loop without its other metrics.
    figures: OpenLoopMetrics,
}

impl Comparison {
    /// Compares an estimate at the stamps of `truth`, and its covariances, with the truth.
    ///
    /// Poses and errors are decimated, so that memory stays small in long runs.
    pub(super) fn new(
        map_from_head: &Trajectory,
        covariances: &[(Stamp, PoseCovariance)],
        truth: &SampledTruth,
        watch: &mut ProgressMonitor,
    ) -> Self {
        let pairs = Pairs::of(map_from_head, &truth.heads);
        let world_from_map = or_note(pairs.world_from_map(), watch);
        let errors = world_from_map.map(|world_from_map| Errors::after(&pairs, &world_from_map));
        let (drift, consistency) = (drift(&pairs).ok(), consistency(&pairs, covariances));
        let per_minute = relative_error(&pairs, Span::from_seconds(60.0)).ok();
        let figures = OpenLoopMetrics {
            position_rmse_m: errors.as_ref().map(Errors::position_rmse_m),
            rotation_rmse_deg: errors.as_ref().map(|errors| errors.rotation_rmse_rad().to_degrees()),
            drift_m_per_min: drift.map(|drift| drift.position_m_per_min),
            yaw_drift_deg_per_min: drift.and_then(|drift| drift.yaw_rad_per_min).map(f64::to_degrees),
            end_error_m: drift.map(|drift| drift.end_error_m),
            relative_error_per_minute_m: per_minute.map(|error| error.position_rmse_m),
            position_nees: consistency.map(|found| found.position_nees),
            attitude_nees: consistency.map(|found| found.attitude_nees),
            ..OpenLoopMetrics::default()
        };
        Self {
            truth: decimated(pairs.stamps().iter().copied().zip(pairs.truth().iter().copied())),
            world_from_map,
            errors: errors.map(|errors| errors.decimated(stride(errors.stamps.len()))),
            figures,
        }
    }
}

/// Decimates poses to the maximum number of plot points.
pub(super) fn decimated(stamped: impl ExactSizeIterator<Item = (Stamp, Pose)>) -> Trajectory {
    let stride = stride(stamped.len());
    Trajectory::from_poses(stamped.step_by(stride)).unwrap_or_default()
}

/// The decimation factor for `count` points.
fn stride(count: usize) -> usize {
    count.div_ceil(MAX_PLOT_POINTS).max(1)
}

/// Returns the value, or reports the error as a note.
fn or_note<T>(result: Result<T, EvaluationError>, watch: &mut ProgressMonitor) -> Option<T> {
    result.inspect_err(|error| watch.note(&error.to_string())).ok()
}

/// Metrics of the simulation.
pub(super) fn simulation_metrics(summary: &SimulationSummary) -> SimulationMetrics {
    SimulationMetrics {
        wall_s: Some(summary.wall_s),
        beams: Some(summary.beams),
        returns: Some(summary.returns),
        rays: Some(summary.rays),
        physics_wall_s: Some(summary.physics_wall_s),
        rays_wall_s: Some(summary.rays_wall_s),
    }
}

/// Metrics of the open loop.
pub(super) fn open_loop_metrics(run: &OpenLoopRun, comparison: Option<&Comparison>) -> OpenLoopMetrics {
    OpenLoopMetrics {
        wall_s: Some(run.wall_s),
        fraction_of_acquisition: Some(run.wall_s / run.acquisition_s).filter(|fraction| fraction.is_finite()),
        ..comparison.map(|found| found.figures.clone()).unwrap_or_default()
    }
}

/// Metrics of the closed loop.
pub(super) fn closed_loop_metrics(
    run: &ClosedLoopRun,
    comparison: Option<&Comparison>,
    acquisition_s: f64,
) -> ClosedLoopMetrics {
    let found = comparison.map(|found| found.figures.clone()).unwrap_or_default();
    let report = run.estimate.report;
    ClosedLoopMetrics {
        wall_s: Some(run.wall_s),
        fraction_of_acquisition: Some(run.wall_s / acquisition_s).filter(|fraction| fraction.is_finite()),
        position_rmse_m: found.position_rmse_m,
        rotation_rmse_deg: found.rotation_rmse_deg,
        bound_rmse_m: None,
        position_nees: found.position_nees,
        attitude_nees: found.attitude_nees,
        loops: LoopMetrics {
            proposed: Some(report.loops.proposed as u64),
            verified: Some(report.loops.verified as u64),
            closed: Some(report.loops.closed as u64),
        },
        left: report.rejected_because.map(str::to_owned),
    }
}

/// Computes the position drift of IMU dead reckoning, m/min; `None` if it is not defined.
///
/// The trajectory is on the IMU clock, which differs from the lidar clock by milliseconds; the effect is negligible
/// relative to the drift.
pub(super) fn imu_only_drift_m_per_min(
    run: &OpenLoopRun,
    truth: &SampledTruth,
    watch: &mut ProgressMonitor,
) -> Option<f64> {
    let dead_reckoning = run.dead_reckoning.as_ref().map_err(Clone::clone);
    let pairs = Pairs::of(or_note(dead_reckoning, watch)?, &truth.dead_reckoned_heads);
    drift(&pairs).ok().map(|drift| drift.position_m_per_min)
}

/// Metrics of the clock offset.
pub(super) fn clock_metrics(run: &OpenLoopRun, truth: Option<&SampledTruth>) -> ClockMetrics {
    let (offsets, truth) = (&run.estimate.clock_offsets, truth.map(|truth| &truth.clock_offsets));
    let error = truth.and_then(|truth| clock_error(offsets, truth));
    let error_after = |after_s| truth.and_then(|truth| clock_error_after(offsets, truth, after_s));
    ClockMetrics {
        offset_end_s: offsets.last().map(|(_, offset_s)| *offset_s),
        offset_rmse_s: error.map(|error| error.offset_rmse_s),
        offset_end_error_s: error.map(|error| error.offset_end_error_s),
        error_after_30s_s: error_after(30.0),
        error_after_120s_s: error_after(120.0),
    }
}

/// Metrics of the estimated lidar corrections; `None` for each that was not estimated.
pub(super) fn lidar_metrics(range_m: f64, extrinsics: &LidarCorrection, spec: &EstimatorSpec) -> LidarMetrics {
    let (estimates_extrinsics, estimates_range) = (spec.extrinsics.estimated, spec.surfels.range_offset_sigma_m > 0.0);
    LidarMetrics {
        range_correction_m: estimates_range.then_some(range_m),
        rotation_correction_deg: estimates_extrinsics
            .then(|| (extrinsics.rotation.scaled_axis() * 1_f64.to_degrees()).into()),
        translation_correction_m: estimates_extrinsics.then(|| extrinsics.translation.into()),
    }
}
