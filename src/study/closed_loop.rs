//! The closed loop over what the open loop saw.

use super::open_loop::OpenLoopRun;
use crate::estimation::{EstimatorSpec, LoopReport, Travelled, register};
use crate::geometry::Trajectory;
use crate::measurement::{Calibration, LidarCorrection};
use std::time::Instant;

/// What the global registration made of an open loop.
pub(super) struct ClosedLoopRun {
    /// The estimate, at the open loop's stamps.
    pub map_from_head: Trajectory,
    /// What was learnt of the lidar beyond its calibration.
    pub lidar: LidarCorrection,
    /// The open loop's trajectory told anew by how the lidar was found to sit, where that was estimated.
    pub open_loop_told_anew: Option<Trajectory>,
    /// Places recognised.
    pub loops: LoopReport,
    /// Why the open loop stayed, where it did.
    pub left: Option<&'static str>,
    /// What it has to say, a sentence each.
    pub remarks: Vec<String>,
    /// Time it took, that of the survey included, s.
    pub wall_s: f64,
}

/// Registers the whole of what `run` saw.
pub(super) fn run_closed_loop(
    run: &OpenLoopRun,
    calibration: &Calibration,
    estimator: &EstimatorSpec,
) -> ClosedLoopRun {
    let started = Instant::now();
    let OpenLoopRun { map_from_head, covariances, lidar, survey, .. } = run;
    let closed = register(Travelled { map_from_head, covariances, lidar, survey }, calibration, estimator);
    let (loops, left) = (closed.report.loops, closed.report.left);
    let stayed = left.map(|why| format!("the global registration left the open loop as it was: {why}"));
    let bent = (loops.closed > 0)
        .then(|| format!("the open loop had drifted out of reach; it was bent to {} recognised places", loops.closed));
    ClosedLoopRun {
        map_from_head: closed.trajectory,
        lidar: closed.lidar,
        open_loop_told_anew: closed.open_loop_told_anew,
        loops,
        left,
        remarks: bent.into_iter().chain(stayed).collect(),
        wall_s: started.elapsed().as_secs_f64() + run.survey.took_s(),
    }
}
