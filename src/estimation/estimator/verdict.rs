//! Reports on windows that have been solved, and warnings that follow from them.

use super::Estimator;
use crate::estimation::window::{Solved, Window};
use crate::estimation::{EstimatorSpec, TimeSpent, Warning, WarningKind, WindowReport};
use crate::time::Stamp;
use std::mem::discriminant;

/// The head is lost when it depends on the IMU only for longer than this, s, and for more than this fraction of the
/// time.
const LOST: (f64, f64) = (5.0, 0.2);

/// Noise produces a contradiction between IMU and trajectory below this multiple of the noise: the trajectory follows
/// the IMU, and the noise is assumed half as large again. A larger contradiction over a window means that one of them
/// is in error.
const CONTRADICTED: f64 = 0.6;

/// The report on a window's solution: whether the head moved, the problem found, and the time used.
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
        sees_rest: window.sees_rest(),
        trouble,
        elapsed_s,
        spent,
    }
}

/// The problem of a window, if any; `expected`: whether surfaces should have been matched.
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

/// Whether a problem means that only the IMU determined the motion.
pub(super) fn leaves_to_the_imu(trouble: &WarningKind) -> bool {
    match trouble {
        WarningKind::FewMatches { .. } | WarningKind::NotSolved { .. } => true,
        WarningKind::WeakGeometry { conditioning, .. } => *conditioning <= 0.0,
        _ => false,
    }
}

impl Estimator {
    /// Warns where the IMU was the only constraint for too long: the trajectory is then no estimate.
    pub(super) fn warn_of_loss(&mut self) {
        let (seconds, of_seconds) = (self.carried_s, self.windows.len() as f64 * self.spec.step_s);
        if let Some(first) = self.windows.first().filter(|_| seconds > LOST.0 && seconds > LOST.1 * of_seconds) {
            self.warnings.push(Warning { stamp: first.stamp, kind: WarningKind::Lost { seconds, of_seconds } });
        }
    }

    /// Warns where IMU and lidar contradict each other by more than noise explains.
    pub(super) fn warn_of_contradiction(&mut self) {
        let all = self.windows.iter().map(|window| window.imu_contradiction);
        let mut times: Vec<f64> = all.filter(|times| *times > CONTRADICTED).collect();
        let [seconds, of_seconds] = [times.len(), self.windows.len()].map(|count| count as f64 * self.spec.step_s);
        if seconds > LOST.0 && seconds > LOST.1 * of_seconds {
            times.sort_unstable_by(f64::total_cmp);
            let kind = WarningKind::Contradicted { times: times[times.len() / 2], seconds, of_seconds };
            self.warnings.extend(self.windows.first().map(|first| Warning { stamp: first.stamp, kind }));
        }
    }

    /// Warns of a problem when it lasts for two windows, or at once of a rejected solution; and only once,
    /// until a window has no problem or another one.
    pub(super) fn say(&mut self, trouble: Option<WarningKind>, end_s: f64) {
        let before =
            self.trouble.take().filter(|(kind, _)| Some(discriminant(kind)) == trouble.as_ref().map(discriminant));
        let Some(kind) = trouble else { return };
        let was_said = before.as_ref().is_some_and(|(_, said)| *said);
        let says = !was_said && (before.is_some() || matches!(kind, WarningKind::NotSolved { .. }));
        if says {
            self.warnings.push(Warning { stamp: self.intake.stamp(end_s), kind: kind.clone() });
        }
        self.trouble = Some((kind, was_said || says));
    }
}
