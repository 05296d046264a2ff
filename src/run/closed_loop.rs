//! The closed loop: global registration of the open-loop estimate.

use super::open_loop::OpenLoopRun;
use std::time::Instant;
use zsim_base::geometry::{PoseCovariance, Trajectory};
use zsim_base::measurement::{Calibration, LidarCorrection};
use zsim_base::time::Stamp;
use zsim_estimation::{EstimationError, EstimatorSpec, LoopReport, RegistrationInput, register};

/// Result of the global registration.
pub(super) struct ClosedLoopRun {
    /// The estimate, at the open loop's stamps.
    pub map_from_head: Trajectory,
    /// Covariances of the poses, at the stamps of the open loop's.
    pub covariances: Vec<(Stamp, PoseCovariance)>,
    /// Estimated correction of the lidar calibration.
    pub lidar: LidarCorrection,
    /// The open-loop trajectory with the estimated lidar extrinsics, if these were estimated.
    pub open_loop_recalibrated: Option<Trajectory>,
    /// Loop closures.
    pub loops: LoopReport,
    /// The reason why the registration was not applied; `None` if it was.
    pub rejected_because: Option<&'static str>,
    /// Messages to the user.
    pub notes: Vec<String>,
    /// Wall-clock time, including that of building the observed surfels, s.
    pub wall_s: f64,
}

/// Runs the global registration over the surfels observed in `run`.
pub(super) fn run_closed_loop(
    run: &OpenLoopRun,
    calibration: &Calibration,
    estimator: &EstimatorSpec,
) -> Result<ClosedLoopRun, EstimationError> {
    let started = Instant::now();
    let OpenLoopRun { map_from_head, covariances, lidar, observed, .. } = run;
    let closed = register(RegistrationInput { map_from_head, covariances, lidar, observed }, calibration, estimator)?;
    let (loops, rejected_because) = (closed.report.loops, closed.report.rejected_because);
    let rejected = rejected_because
        .map(|why| format!("global registration not applied ({why}); the result is the open-loop trajectory"));
    let closed_loops = (loops.closed > 0 && rejected_because.is_none()).then(|| {
        format!("the open loop drifted beyond the matching distance; loop closures that corrected it: {}", loops.closed)
    });
    Ok(ClosedLoopRun {
        map_from_head: closed.trajectory,
        covariances: closed.covariances,
        lidar: closed.lidar,
        open_loop_recalibrated: closed.open_loop_recalibrated,
        loops,
        rejected_because,
        notes: closed_loops.into_iter().chain(rejected).collect(),
        wall_s: started.elapsed().as_secs_f64() + run.observed.elapsed_s(),
    })
}
