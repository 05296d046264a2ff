//! Reports on solved windows, and the warnings derived from them.

use super::Estimator;
use crate::estimation::window::{Window, WindowSolution};
use crate::estimation::{EstimatorSpec, Timing, Warning, WarningKind, WindowReport};
use crate::time::Stamp;
use std::mem::discriminant;

/// Tracking counts as lost after more dead reckoning than this, s, and than this fraction of the run.
const TRACKING_LOST: (f64, f64) = (5.0, 0.2);

/// Contradiction between IMU and lidar above which one of them is wrong, as a multiple of the IMU noise.
///
/// Noise causes less: the trajectory follows the IMU, and `noise_inflation` enlarges the assumed noise by half.
const CONTRADICTION_THRESHOLD: f64 = 0.6;

/// The report on the solution of a window.
pub(super) fn report(
    solved: &WindowSolution,
    (stamp, moving): (Stamp, bool),
    window: &Window,
    problem: Option<WarningKind>,
    (elapsed_s, timing): (f64, Timing),
) -> WindowReport {
    WindowReport {
        stamp,
        surfels: solved.surfels,
        matches: solved.matches,
        view_matches: solved.view_matches,
        views: solved.views,
        residual_rms_m: solved.residual_rms_m,
        iterations: solved.iterations,
        last_correction_m: solved.last_correction_m,
        conditioning: solved.conditioning,
        imu_contradiction: window.imu_contradiction(),
        clock_offset_s: window.clock.offset_s,
        clock_rate: window.clock.rate,
        range_correction_m: window.lidar().range_m,
        imu_matrix: window.imu_matrix(),
        speed_m_per_s: window.speed_m_per_s(),
        moving,
        resting: window.is_resting(),
        sees_rest: window.sees_rest(),
        problem,
        elapsed_s,
        timing,
    }
}

/// The problem of a window, if any; `expected`: whether surfaces should have been matched.
pub(super) fn problem(solved: &WindowSolution, spec: &EstimatorSpec, expected: bool) -> Option<WarningKind> {
    let matches = solved.matches + solved.view_matches;
    if let Some(reason) = solved.failure {
        Some(WarningKind::NotSolved { reason })
    } else if expected && matches < spec.solve.min_matches {
        Some(WarningKind::FewMatches { matches })
    } else if expected && solved.conditioning < spec.solve.weak_conditioning {
        Some(WarningKind::WeakGeometry { conditioning: solved.conditioning, direction_in_map: solved.weakest })
    } else {
        None
    }
}

/// Whether a problem means that the window is dead reckoning with the IMU.
pub(super) fn is_dead_reckoning(problem: &WarningKind) -> bool {
    match problem {
        WarningKind::FewMatches { .. } | WarningKind::NotSolved { .. } => true,
        WarningKind::WeakGeometry { conditioning, .. } => *conditioning <= 0.0,
        _ => false,
    }
}

impl Estimator {
    /// Warns if tracking was lost for a large part of the run.
    pub(super) fn warn_of_loss(&mut self) {
        let (seconds, of_seconds) = (self.dead_reckoning_s, self.windows.len() as f64 * self.spec.step_s);
        if let Some(first) =
            self.windows.first().filter(|_| seconds > TRACKING_LOST.0 && seconds > TRACKING_LOST.1 * of_seconds)
        {
            self.warnings.push(Warning { stamp: first.stamp, kind: WarningKind::Lost { seconds, of_seconds } });
        }
    }

    /// Warns if IMU and lidar contradict each other by more than noise explains.
    pub(super) fn warn_of_contradiction(&mut self) {
        let all = self.windows.iter().map(|window| window.imu_contradiction);
        let mut times: Vec<f64> = all.filter(|times| *times > CONTRADICTION_THRESHOLD).collect();
        let [seconds, of_seconds] = [times.len(), self.windows.len()].map(|count| count as f64 * self.spec.step_s);
        if seconds > TRACKING_LOST.0 && seconds > TRACKING_LOST.1 * of_seconds {
            times.sort_unstable_by(f64::total_cmp);
            let kind = WarningKind::Contradicted { times: times[times.len() / 2], seconds, of_seconds };
            self.warnings.extend(self.windows.first().map(|first| Warning { stamp: first.stamp, kind }));
        }
    }

    /// Warns of a problem of two consecutive windows, or immediately of a rejected solution.
    ///
    /// The warning is repeated only after a window without a problem or with another one.
    pub(super) fn warn_of_problem(&mut self, problem: Option<WarningKind>, end_s: f64) {
        let before =
            self.problem.take().filter(|(kind, _)| Some(discriminant(kind)) == problem.as_ref().map(discriminant));
        let Some(kind) = problem else { return };
        let was_reported = before.as_ref().is_some_and(|(_, reported)| *reported);
        let report = !was_reported && (before.is_some() || matches!(kind, WarningKind::NotSolved { .. }));
        if report {
            self.warnings.push(Warning { stamp: self.intake.stamp(end_s), kind: kind.clone() });
        }
        self.problem = Some((kind, was_reported || report));
    }
}
