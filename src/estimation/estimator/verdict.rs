//! Reports on windows that have been solved, and warnings that follow from them.

use super::Estimator;
use crate::estimation::window::{Solved, Window};
use crate::estimation::{EstimatorSpec, TimeSpent, Warning, WarningKind, WindowReport};
use crate::time::Stamp;
use std::mem::discriminant;

/// The head is lost when the IMU alone carried it for longer than this, s, and for more than this share of the time.
const LOST: (f64, f64) = (5.0, 0.2);

/// Noise leaves the IMU and the trajectory less apart than this, as a multiple of itself: the trajectory follows it, and
/// is solved with a noise half as much again. Where they are farther apart for as long as that, one of them is wrong.
const CONTRADICTED: f64 = 0.6;

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
        sees_rest: window.sees_rest(),
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

impl Estimator {
    /// Warns where the IMU alone carried the head for too long: what it then tells is no estimate.
    pub(super) fn warn_of_loss(&mut self) {
        let (seconds, of_seconds) = (self.carried_s, self.windows.len() as f64 * self.spec.step_s);
        if let Some(first) = self.windows.first().filter(|_| seconds > LOST.0 && seconds > LOST.1 * of_seconds) {
            self.warnings.push(Warning { stamp: first.stamp, kind: WarningKind::Lost { seconds, of_seconds } });
        }
    }

    /// Warns where the IMU contradicted what the lidar saw by more than noise leaves.
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

    /// Warns of a trouble when it lasts for two windows, or at once of a solution that was not believed; and once only,
    /// until a window is well again or something else is wrong.
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
