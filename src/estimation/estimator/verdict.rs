//! What is said of a window that has been solved.

use crate::estimation::window::{Solved, Window};
use crate::estimation::{EstimatorSpec, TimeSpent, WarningKind, WindowReport};
use crate::time::Stamp;

/// The report on a window's solution: whether the head moved in it, what was wrong with it, and the time it took.
pub(super) fn report(
    solved: &Solved,
    (stamp, moving): (Stamp, bool),
    window: &Window,
    trouble: Option<WarningKind>,
    (elapsed_s, spent): (f64, TimeSpent),
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
        trouble,
        elapsed_s,
        spent,
    }
}

/// What is to be said about a window, if anything; `expected` tells whether it should have found surfaces.
pub(super) fn trouble(solved: &Solved, spec: &EstimatorSpec, expected: bool) -> Option<WarningKind> {
    let matches = solved.matches + solved.view_matches;
    if let Some(reason) = solved.trouble {
        Some(WarningKind::NotSolved { reason })
    } else if expected && matches < spec.solve.min_matches {
        Some(WarningKind::FewMatches { matches })
    } else if expected && solved.conditioning < spec.solve.weak_conditioning {
        Some(WarningKind::WeakGeometry { conditioning: solved.conditioning, direction_in_map: solved.weakest })
    } else {
        None
    }
}

/// Whether a trouble means that the IMU alone told how the head went on.
pub(super) fn leaves_to_the_imu(trouble: &WarningKind) -> bool {
    match trouble {
        WarningKind::FewMatches { .. } | WarningKind::NotSolved { .. } => true,
        WarningKind::WeakGeometry { conditioning, .. } => *conditioning <= 0.0,
        _ => false,
    }
}
