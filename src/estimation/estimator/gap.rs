//! The end of a window at a gap or at the end of the data, and the restart after a gap.

use super::Estimator;
use super::phase::{GapRecovery, Gathering, Phase, Tracking};
use crate::EstimationError;
use crate::coasting::Coasting;
use crate::local_map::LocalMap;
use crate::localisation::GapRelocalisation;
use crate::window::Window;

impl Estimator {
    /// Discards what a gap makes useless: the window, whose content becomes final, or the gathered segments.
    ///
    /// `coasting`: the IMU data of a lidar gap. They predict the motion only from a window that the gap ends.
    pub(super) fn restart_after_gap(
        &mut self,
        phase: &mut Phase,
        coasting: Option<Coasting>,
    ) -> Result<(), EstimationError> {
        match phase {
            Phase::Gathering(gathering) => {
                gathering.segments.clear();
                gathering.recovery.iter_mut().for_each(|recovery| recovery.coasting = None);
            }
            Phase::Tracking(tracking) => {
                let recovery = if let Some(mut unplaced) = self.localise_at_end(tracking)? {
                    unplaced.segments.clear();
                    unplaced.coasting = None;
                    unplaced
                } else {
                    self.output_window(tracking);
                    Box::new(GapRecovery { coasting, ..self.prepare_recovery(&tracking.window) })
                };
                *phase = Phase::Gathering(Gathering { segments: Vec::new(), recovery: Some(recovery) });
            }
        }
        Ok(())
    }

    /// Outputs the content of the whole window, which is final.
    pub(super) fn output_window(&mut self, tracking: &mut Tracking) {
        let window = &tracking.window;
        let end_s = window.nominal.end_s().min(window.unknowns.clock.trajectory_s(self.end_tau_s()));
        if let Some(end) = tracking.at_end.take() {
            self.local_map.consider.propagate_to(&end);
        }
        self.output_poses(tracking, end_s);
        if let Some(observed) = &mut self.observed {
            tracking.sensed.settle(&tracking.window, end_s, observed);
        }
        self.record_observed(&tracking.window, Window::observed_in_all, Window::end_s);
    }

    /// Saves the state before a gap and prepares the search for the head after it.
    ///
    /// The pose relative to the old views is unknown after the gap. Accidental matches with them would be wrong, so the
    /// local map has no views until the search succeeds.
    fn prepare_recovery(&mut self, window: &Window) -> GapRecovery {
        let empty = LocalMap::without_views(&self.spec, self.local_map.consider.clone());
        let mut old_map = std::mem::replace(&mut self.local_map, empty);
        let (before, windows) = (window.state_before_gap(), self.diagnostics.windows.len());
        if let Some(map_localisation) = &mut self.map_localisation {
            self.poses.last().into_iter().for_each(|last| map_localisation.restart_search(last.map_from_head));
            return GapRecovery::new(before, None, windows);
        }
        old_map.add_segment(&window.seen_segment(self.spec.views.length_s), window.matcher());
        let relocalisation = GapRelocalisation::new(old_map, window.patches(), window.nominal.end_s());
        GapRecovery::new(before, Some(relocalisation), windows)
    }

    /// End of the newest window, lidar time, s.
    fn end_tau_s(&self) -> f64 {
        self.diagnostics.windows.last().map_or(0.0, |report| report.stamp.seconds_since(self.intake.origin()))
    }
}
