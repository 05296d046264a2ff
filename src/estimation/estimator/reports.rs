//! Reports on solved windows.

use super::Estimator;
use crate::spec::SolveSpec;
use crate::window::{Window, WindowSolution};
use crate::{EventKind, WindowReport};
use zsim_base::time::Stamp;

impl Estimator {
    /// Returns the report on the solution of the window that ends at `stamp`.
    ///
    /// `moving`: the head moves, so surfaces should have been matched. `elapsed_s`: run time, s.
    pub(super) fn window_report(
        &self,
        solved: &WindowSolution,
        window: &Window,
        stamp: Stamp,
        moving: bool,
        elapsed_s: f64,
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
            clock_offset_s: window.unknowns.clock.offset_s,
            clock_rate: window.unknowns.clock.rate,
            range_correction_m: window.lidar().range_m,
            imu_matrix: window.imu_matrix(&self.calibration.imu),
            speed_m_per_s: window.speed_m_per_s(),
            moving,
            resting: window.is_resting(),
            sees_rest: window.sees_rest(),
            problem: problem(solved, &self.spec.solve, moving),
            elapsed_s,
            timing: solved.timing,
        }
    }
}

/// The problem of a window, if any; `expected`: whether surfaces should have been matched.
fn problem(solved: &WindowSolution, spec: &SolveSpec, expected: bool) -> Option<EventKind> {
    let matches = solved.matches + solved.view_matches;
    if let Some(reason) = solved.failure {
        Some(EventKind::NotSolved { reason })
    } else if expected && matches < spec.min_matches {
        Some(EventKind::FewMatches { matches })
    } else if expected && solved.conditioning < spec.weak_conditioning {
        Some(EventKind::WeakGeometry { conditioning: solved.conditioning, direction_in_map: solved.weakest })
    } else {
        None
    }
}
