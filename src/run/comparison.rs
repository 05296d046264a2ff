//! Comparison of an estimate with the truth in the recording.

use super::ProgressMonitor;
use super::closed_loop::ClosedLoopRun;
use super::decimation::{decimated, decimated_errors};
use super::open_loop::OpenLoopRun;
use super::sampled_truth::SampledTruth;
use zsim_base::geometry::{Pose, PoseCovariance, Trajectory};
use zsim_base::measurement::LidarCorrection;
use zsim_base::time::{Span, Stamp};
use zsim_estimation::EstimatorSpec;
use zsim_evaluation::{
    Consistency, Drift, Errors, EvaluationError, Pairs, RelativeError, clock_error, clock_error_after, consistency,
    drift, relative_error,
};
use zsim_report::{ClockMetrics, ClosedLoopMetrics, LidarMetrics, LoopMetrics, OpenLoopMetrics, SimulationMetrics};
use zsim_simulation::SimulationSummary;

/// Comparison of an estimate with the truth.
pub(super) struct Comparison {
    /// The true trajectory, `world_from_head`, decimated for plots.
    pub truth: Trajectory,
    /// Rigid alignment of the estimate by all positions; `None` if they do not determine it.
    pub world_from_map: Option<Pose>,
    /// Errors after this alignment.
    pub errors: Option<AlignedErrors>,
    drift: Option<Drift>,
    consistency: Option<Consistency>,
    per_minute: Option<RelativeError>,
}

/// Errors after alignment.
pub(super) struct AlignedErrors {
    pub position_rmse_m: f64,
    rotation_rmse_rad: f64,
    /// Errors over time, decimated for plots.
    pub decimated: Errors,
}

impl AlignedErrors {
    fn after(pairs: &Pairs, world_from_map: &Pose) -> Self {
        let errors = Errors::after(pairs, world_from_map);
        let (position_rmse_m, rotation_rmse_rad) = (errors.position_rmse_m(), errors.rotation_rmse_rad());
        Self { position_rmse_m, rotation_rmse_rad, decimated: decimated_errors(&errors) }
    }
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
        let errors = world_from_map.map(|world_from_map| AlignedErrors::after(&pairs, &world_from_map));
        Self {
            truth: decimated(pairs.stamps().iter().copied().zip(pairs.truth().iter().copied())),
            world_from_map,
            errors,
            drift: drift(&pairs).ok(),
            consistency: consistency(&pairs, covariances),
            per_minute: relative_error(&pairs, Span::from_seconds(60.0)).ok(),
        }
    }
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
    let drift = comparison.and_then(|found| found.drift);
    let errors = comparison.and_then(|found| found.errors.as_ref());
    let consistency = comparison.and_then(|found| found.consistency);
    let relative = comparison.and_then(|found| found.per_minute);
    OpenLoopMetrics {
        wall_s: Some(run.wall_s),
        fraction_of_acquisition: Some(run.wall_s / run.acquisition_s).filter(|fraction| fraction.is_finite()),
        fixed_views: None,
        position_rmse_m: errors.map(|errors| errors.position_rmse_m),
        rotation_rmse_deg: errors.map(|errors| errors.rotation_rmse_rad.to_degrees()),
        drift_m_per_min: drift.map(|drift| drift.position_m_per_min),
        yaw_drift_deg_per_min: drift.and_then(|drift| drift.yaw_rad_per_min).map(f64::to_degrees),
        end_error_m: drift.map(|drift| drift.end_error_m),
        relative_error_per_minute_m: relative.map(|error| error.position_rmse_m),
        imu_only_drift_m_per_min: None,
        position_nees: consistency.map(|found| found.position_nees),
        attitude_nees: consistency.map(|found| found.attitude_nees),
    }
}

/// Metrics of the closed loop.
pub(super) fn closed_loop_metrics(
    run: &ClosedLoopRun,
    comparison: Option<&Comparison>,
    acquisition_s: f64,
) -> ClosedLoopMetrics {
    let errors = comparison.and_then(|found| found.errors.as_ref());
    let consistency = comparison.and_then(|found| found.consistency);
    ClosedLoopMetrics {
        wall_s: Some(run.wall_s),
        fraction_of_acquisition: Some(run.wall_s / acquisition_s).filter(|fraction| fraction.is_finite()),
        position_rmse_m: errors.map(|errors| errors.position_rmse_m),
        rotation_rmse_deg: errors.map(|errors| errors.rotation_rmse_rad.to_degrees()),
        bound_rmse_m: None,
        position_nees: consistency.map(|found| found.position_nees),
        attitude_nees: consistency.map(|found| found.attitude_nees),
        loops: LoopMetrics {
            proposed: Some(run.loops.proposed as u64),
            verified: Some(run.loops.verified as u64),
            closed: Some(run.loops.closed as u64),
        },
        left: run.rejected_because.map(str::to_owned),
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
    let error = truth.and_then(|truth| clock_error(&run.clock_offsets, &truth.clock_offsets));
    let error_after =
        |after_s| truth.and_then(|truth| clock_error_after(&run.clock_offsets, &truth.clock_offsets, after_s));
    ClockMetrics {
        offset_end_s: run.clock_offsets.last().map(|(_, offset_s)| *offset_s),
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
