//! The closed loop: global registration of the open-loop estimate.

use super::open_loop::OpenLoopRun;
use std::time::Instant;
use zsim_base::measurement::Calibration;
use zsim_estimation::{ClosedLoop, EstimationError, EstimatorSpec, RegistrationInput, register};

/// Result of the global registration.
pub(super) struct ClosedLoopRun {
    /// The estimate, at the open loop's stamps.
    pub estimate: ClosedLoop,
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
    let OpenLoopRun { estimate, covariances, .. } = run;
    let (map_from_head, lidar, observed) = (&estimate.trajectory, &estimate.lidar, &estimate.observed);
    let closed = register(RegistrationInput { map_from_head, covariances, lidar, observed }, calibration, estimator)?;
    let (loops, rejected_because) = (closed.report.loops, closed.report.rejected_because);
    let rejected = rejected_because
        .map(|why| format!("global registration not applied ({why}); the result is the open-loop trajectory"));
    let closed_loops = (loops.closed > 0 && rejected_because.is_none()).then(|| {
        format!("the open loop drifted beyond the matching distance; loop closures that corrected it: {}", loops.closed)
    });
    Ok(ClosedLoopRun {
        estimate: closed,
        notes: closed_loops.into_iter().chain(rejected).collect(),
        wall_s: started.elapsed().as_secs_f64() + observed.elapsed_s(),
    })
}
