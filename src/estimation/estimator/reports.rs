//! Reports on solved windows.

use crate::estimation::window::{Window, WindowSolution};
use crate::estimation::{EstimatorSpec, Timing, WarningKind, WindowReport};
use crate::time::Stamp;

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
