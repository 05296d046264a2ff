//! Warnings derived from the reports on solved windows.

use super::Estimator;
use crate::estimation::{Warning, WarningKind};
use std::mem::discriminant;

/// Contradiction between IMU and lidar above which one of them is wrong, as a multiple of the IMU noise.
///
/// Noise causes less: the trajectory follows the IMU, and `noise_inflation` enlarges the assumed noise by half.
const CONTRADICTION_THRESHOLD: f64 = 0.6;

/// Tracking counts as lost after more dead reckoning than this, s, and than this fraction of the run.
const TRACKING_LOST: (f64, f64) = (5.0, 0.2);

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
