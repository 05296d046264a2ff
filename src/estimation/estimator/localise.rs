//! Localisation of the window in the given map, or after a gap in the surfaces seen before it.

use super::Estimator;
use super::phase::{GapRecovery, Tracking};
use crate::consider::ConsiderCovariance;
use crate::localisation::MapLocalisation;
use crate::views::Views;
use crate::window::Window;
use crate::{EstimationError, EventKind};

impl Estimator {
    /// Localises a full window, if a search is pending; returns whether the window moved.
    pub(super) fn localise_if_full(&mut self, tracking: &mut Tracking) -> Result<bool, EstimationError> {
        if !tracking.window.is_full() {
            return Ok(false);
        }
        if let Some(recovery) = &tracking.recovery {
            tracking.window.align_gravity_with(&recovery.before);
        }
        self.localise(tracking, true)
    }

    /// Performs the pending searches; returns whether one of them succeeded.
    ///
    /// If `may_search_again`, the window is rejected instead of an error if a later one may be found in the whole map.
    fn localise(&mut self, tracking: &mut Tracking, may_search_again: bool) -> Result<bool, EstimationError> {
        let in_map = match self.localise_in_map(&mut tracking.window) {
            Err(_) if may_search_again && self.map_localisation.as_mut().is_some_and(MapLocalisation::search_again) => {
                tracking.is_rejected = true;
                return Ok(false);
            }
            in_map => in_map?,
        };
        Ok(self.relocalise(tracking) || in_map)
    }

    /// Performs the pending searches with a window that ends at a gap or with the data.
    ///
    /// Returns what is known from before the previous gap if the window is too short to be relocalised after it. None of its
    /// poses has been output, and none can be.
    pub(super) fn localise_at_end(
        &mut self,
        tracking: &mut Tracking,
    ) -> Result<Option<Box<GapRecovery>>, EstimationError> {
        self.localise(tracking, false)?;
        let unplaced = tracking.recovery.take().filter(|recovery| recovery.relocalisation.is_some());
        if unplaced.is_some() {
            let (start_s, end_s) = (tracking.window.start_s(), tracking.window.nominal.end_s());
            let stamp = self.intake.stamp(start_s);
            self.diagnostics.warn(stamp, EventKind::TooShortToRelocalise { seconds: end_s - start_s });
        }
        Ok(unplaced)
    }

    /// Localises the window in the given map, if a search is pending; returns whether it succeeded.
    fn localise_in_map(&mut self, window: &mut Window) -> Result<bool, EstimationError> {
        let Some(map_localisation) = &mut self.map_localisation else { return Ok(false) };
        let found = match map_localisation.find(window, &self.calibration.head_from_imu) {
            Some(Ok(found)) => found,
            Some(Err(_)) if map_localisation.found().is_some() => {
                self.diagnostics.warn(self.intake.stamp(window.nominal.end_s()), EventKind::LostInMap);
                return Ok(false);
            }
            Some(Err(error)) => return Err(error),
            None => return Ok(false),
        };
        window.move_by(&found.map_from_query);
        let position = window.start_pose().translation.vector;
        let views = Views::new(&self.spec.views, self.spec.fixed_views);
        self.local_map.views = views.with_map(map_localisation.patches(), window.matcher(), position);
        let known = window.known_at_start().unwrap_or_default();
        self.local_map.consider =
            ConsiderCovariance::localised(position, &known, &found.covariance, &map_localisation.covariance());
        Ok(true)
    }

    /// Relocalises the window in the surfaces seen before a gap; returns whether it succeeded.
    ///
    /// After a failure the search remains pending only if the window is not full.
    fn relocalise(&mut self, tracking: &mut Tracking) -> bool {
        let Some(mut recovery) = tracking.recovery.take() else { return false };
        let Some(search) = recovery.relocalisation.take() else { return false };
        let window = &mut tracking.window;
        let stamp = self.intake.stamp(window.start_s());
        match search.find(window, &self.spec, recovery.coasting.as_ref()) {
            Ok(found) => {
                let local_map = search.into_local_map(window, &found);
                let distance_m = (local_map.consider.pivot() - self.local_map.consider.pivot()).norm();
                let ambiguity_m = found.ambiguity_m;
                self.diagnostics.warn(stamp, EventKind::Relocalised { distance_m, ambiguity_m });
                window.move_by(&found.map_from_query);
                self.local_map = local_map;
                true
            }
            Err(_) if !window.is_full() => {
                recovery.relocalisation = Some(search);
                tracking.recovery = Some(recovery);
                false
            }
            Err(why) => {
                self.diagnostics.warn(stamp, EventKind::NotRelocalised { why });
                false
            }
        }
    }
}
