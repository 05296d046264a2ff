//! The steps that process a segment with the window.

use super::Estimator;
use super::phase::Tracking;
use crate::EstimationError;
use crate::intake::Segment;
use crate::observed::ObservedPatch;
use crate::timing::Stopwatch;
use crate::window::{Linearised, Window, WindowSolution};
use zsim_base::time::Stamp;

/// Speed (m/s) or rotation rate (rad/s) above which too few matches are a problem. Below both the IMU is sufficient.
const FAST_MOTION: (f64, f64) = (0.3, 0.5);

/// Time before the start of the window for which final states are kept, s.
const KEPT_BEFORE_WINDOW_S: f64 = 0.2;

impl Estimator {
    /// Processes a segment: extends the window by it, solves the window, and outputs the poses that become final.
    pub(super) fn process(&mut self, tracking: &mut Tracking, segment: Segment) -> Result<(), EstimationError> {
        let mut watch = Stopwatch::start();
        let (stamp, turns_fast) = (self.intake.stamp(segment.end_s), turns_fast(&segment));
        if let Some(recovery) = &mut tracking.recovery {
            recovery.segments.push(segment.clone());
        }
        let extension = tracking.window.extend(&segment.intervals, segment.returns, segment.end_s);
        let (mut solved, linearised) = self.solve(tracking, stamp)?;
        if tracking.is_rejected {
            return Ok(());
        }
        solved.timing += extension;
        let solution_s = watch.lap_s();
        self.record_oldest(&tracking.window);
        watch.lap_s(); // the observed surfels have their own time
        let final_until_s = self.finish_oldest_segment(tracking, linearised.as_ref());
        solved.timing.views_s += watch.lap_s();
        self.report(&tracking.window, &solved, stamp, turns_fast, solution_s);
        self.output_final_poses(tracking, final_until_s);
        Ok(())
    }

    /// Solves the window, and rejects a wrong start; if the solution allows to localise the window, solves it again.
    ///
    /// Returns the solution, and the last linearisation if the solution is accepted.
    fn solve(
        &mut self,
        tracking: &mut Tracking,
        stamp: Stamp,
    ) -> Result<(WindowSolution, Option<Linearised>), EstimationError> {
        let (mut solved, linearised) = tracking.window.solve(&self.local_map.views);
        let mut watch = Stopwatch::start();
        tracking.window.rebuild_newest_surfels();
        solved.timing.surfels_s += watch.lap_s();
        tracking.is_rejected = self.rejects_start(tracking, &solved, stamp);
        if tracking.is_rejected || !self.localise_if_full(tracking)? {
            return Ok((solved, linearised));
        }
        // Solve again, with matches with the map or the old views.
        let (mut again, linearised) = tracking.window.solve(&self.local_map.views);
        again.timing += solved.timing;
        Ok((again, linearised))
    }

    /// Removes the oldest segment if the window is full. Returns the time of the trajectory up to which poses are final, s.
    fn finish_oldest_segment(&mut self, tracking: &mut Tracking, linearised: Option<&Linearised>) -> Option<f64> {
        let Tracking { window, at_end, sensed, .. } = tracking;
        let local_map = &mut self.local_map;
        let end_s = window.nominal.end_s();
        let Some(until_s) = window.next_start_s().filter(|_| window.is_full()) else {
            [*at_end] = linearised.map_or([None], |at| window.sensitivities_at([end_s], at, &local_map.views));
            return None;
        };
        let times_s = [end_s, until_s];
        let sensitivities = linearised.map(|at| window.sensitivities_at(times_s, at, &local_map.views));
        let [by_end, by_start] = sensitivities.unwrap_or([None, None]);
        *at_end = by_end;
        if let Some(by) = by_start {
            local_map.consider.advance(&by);
        }
        let tau_s = window.unknowns.clock.lidar_s(until_s);
        if let (Some(observed), Some(at)) = (&mut self.observed, linearised) {
            sensed.advance(window, at, &local_map.views, until_s, observed);
        }
        self.gauge.advance(&mut local_map.consider, until_s, self.intake.stamp(tau_s));
        let segment = window.remove_oldest(linearised)?;
        local_map.add_segment(&segment, window.matcher());
        Some(until_s)
    }

    /// Adds the report on the window, and its clock offset.
    fn report(&mut self, window: &Window, solved: &WindowSolution, stamp: Stamp, turns_fast: bool, solution_s: f64) {
        self.clock_offsets.push((self.intake.stamp(window.unknowns.clock.at_s), window.unknowns.clock.offset_s));
        let moving = window.speed_m_per_s() > FAST_MOTION.0 || turns_fast;
        let elapsed_s = solution_s + solved.timing.views_s;
        let report = self.window_report(solved, window, stamp, moving, elapsed_s);
        self.diagnostics.record(report);
    }

    /// Outputs the poses up to `final_until_s`, trajectory time, and forgets the states before them.
    fn output_final_poses(&mut self, tracking: &mut Tracking, final_until_s: Option<f64>) {
        let Some(until_s) = final_until_s else { return };
        self.output_poses(tracking, until_s);
        tracking.window.nominal.forget_before(until_s - KEPT_BEFORE_WINDOW_S);
    }

    /// Adds the surfels of the oldest segment to the observed surfels, if the window is full.
    fn record_oldest(&mut self, window: &Window) {
        if window.is_full() {
            self.record_observed(window, Window::observed_in_oldest, Window::oldest_end_s);
        }
    }

    /// Adds the patches returned by `surfels`, up to time `until`, to the observed surfels, if they are recorded.
    pub(super) fn record_observed(
        &mut self,
        window: &Window,
        surfels: fn(&Window) -> Vec<ObservedPatch>,
        until: fn(&Window) -> f64,
    ) {
        if let Some(observed) = &mut self.observed {
            let mut watch = Stopwatch::start();
            observed.extend(self.intake.origin(), surfels(window).into_iter(), window.lidar(), until(window));
            observed.elapsed_s += watch.lap_s();
        }
    }
}

/// Whether the head turns fast during a segment.
fn turns_fast(segment: &Segment) -> bool {
    segment.intervals.iter().any(|(_, i)| i.gyro.norm() > FAST_MOTION.1)
}
