//! Reports on the windows, and the warnings derived from them.

use crate::integrity::MAX_CONTRADICTION;
use crate::{Event, EventKind, WindowReport};
use std::mem::discriminant;
use zsim_base::time::Stamp;

/// Tracking counts as lost after more dead reckoning than this, s, and than this fraction of the run.
const TRACKING_LOST: (f64, f64) = (5.0, 0.2);

/// The reports on all windows, and all warnings.
#[derive(Debug)]
pub(super) struct Diagnostics {
    /// Duration of the segment that each window adds, s.
    step_s: f64,
    pub(super) windows: Vec<WindowReport>,
    pub(super) warnings: Vec<Event>,
    /// The problem of the newest window.
    problem: Option<Problem>,
}

/// A problem of a window.
#[derive(Debug)]
struct Problem {
    kind: EventKind,
    was_reported: bool,
}

impl Diagnostics {
    /// Without windows; each will add `step_s`.
    pub(super) fn new(step_s: f64) -> Self {
        Self { step_s, windows: Vec::new(), warnings: Vec::new(), problem: None }
    }

    /// Forgets the windows after the first `count`; the warnings remain.
    pub(super) fn forget_windows_after(&mut self, count: usize) {
        self.windows.truncate(count);
        self.problem = None;
    }

    /// Adds a warning.
    pub(super) fn warn(&mut self, stamp: Stamp, kind: EventKind) {
        self.warnings.push(Event::at(stamp, kind));
    }

    /// Adds the report on a window, and warns of its problem.
    pub(super) fn record(&mut self, report: WindowReport) {
        self.warn_of_problem(report.problem.clone(), report.stamp);
        self.windows.push(report);
    }

    /// Adds the warnings that concern the whole run.
    pub(super) fn finish(&mut self) {
        self.warn_of_loss();
        self.warn_of_contradiction();
    }

    /// Warns if tracking was lost for a large part of the run.
    fn warn_of_loss(&mut self) {
        let dead_reckoning =
            self.windows.iter().filter(|window| window.problem.as_ref().is_some_and(is_dead_reckoning));
        let [seconds, of_seconds] =
            [dead_reckoning.count(), self.windows.len()].map(|count| count as f64 * self.step_s);
        if let Some(first) =
            self.windows.first().filter(|_| seconds > TRACKING_LOST.0 && seconds > TRACKING_LOST.1 * of_seconds)
        {
            self.warnings.push(Event::at(first.stamp, EventKind::Lost { seconds, of_seconds }));
        }
    }

    /// Warns if IMU and lidar contradict each other by more than noise explains.
    fn warn_of_contradiction(&mut self) {
        let all = self.windows.iter().map(|window| window.imu_contradiction);
        let mut times: Vec<f64> = all.filter(|times| *times > MAX_CONTRADICTION).collect();
        let [seconds, of_seconds] = [times.len(), self.windows.len()].map(|count| count as f64 * self.step_s);
        if seconds > TRACKING_LOST.0 && seconds > TRACKING_LOST.1 * of_seconds {
            times.sort_unstable_by(f64::total_cmp);
            let kind = EventKind::Contradicted { times: times[times.len() / 2], seconds, of_seconds };
            self.warnings.extend(self.windows.first().map(|first| Event::at(first.stamp, kind)));
        }
    }

    /// Warns of a problem of two consecutive windows, or immediately of a rejected solution.
    ///
    /// The warning is repeated only after a window without a problem or with another one.
    fn warn_of_problem(&mut self, problem: Option<EventKind>, stamp: Stamp) {
        let previous = self.problem.take();
        let Some(kind) = problem else { return };
        let before = previous.filter(|before| discriminant(&before.kind) == discriminant(&kind));
        let was_reported = before.as_ref().is_some_and(|before| before.was_reported);
        let report = !was_reported && (before.is_some() || matches!(kind, EventKind::NotSolved { .. }));
        if report {
            self.warn(stamp, kind.clone());
        }
        self.problem = Some(Problem { kind, was_reported: was_reported || report });
    }
}

/// Conditioning below which a direction is not observed.
///
/// Against the information of ten thousand matches it is that of a tenth of a match, which may be false.
const UNOBSERVED: f64 = 1e-5;

/// Whether a window with this problem is dead reckoning with the IMU, along one direction at least.
fn is_dead_reckoning(problem: &EventKind) -> bool {
    let is_unobserved = matches!(problem, EventKind::WeakGeometry { conditioning, .. } if *conditioning < UNOBSERVED);
    problem.is_untracked() || is_unobserved
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::geometry::Vector;

    #[test]
    fn a_trace_of_information_about_a_direction_is_dead_reckoning() {
        let along_a_corridor = |conditioning| EventKind::WeakGeometry { conditioning, direction_in_map: Vector::x() };
        // Conditionings of windows in a corridor without any face along it, and of windows on stairs.
        for (conditioning, expected) in [(0.0, true), (3e-6, true), (2e-5, false), (4e-4, false)] {
            assert_eq!(is_dead_reckoning(&along_a_corridor(conditioning)), expected, "{conditioning}");
        }
    }
}
