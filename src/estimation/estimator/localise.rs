//! Localisation of the window in the given map, or after a gap in the surfaces seen before it.

use super::Estimator;
use super::phase::Tracking;
use crate::estimation::consider::ConsiderCovariance;
use crate::estimation::localisation::GapRelocalisation;
use crate::estimation::views::Views;
use crate::estimation::window::Window;
use crate::estimation::{EstimationError, WarningKind};

impl Estimator {
    /// Localises a full window, if a search is pending; returns whether the window moved.
    pub(super) fn localise_if_full(&mut self, tracking: &mut Tracking) -> Result<bool, EstimationError> {
        if !tracking.window.is_full() {
            return Ok(false);
        }
        if let Some(recovery) = &tracking.recovery {
            tracking.window.align_gravity_with(&recovery.before);
        }
        self.localise(tracking)
    }

    /// Performs the pending searches; returns whether one of them succeeded.
    pub(super) fn localise(&mut self, tracking: &mut Tracking) -> Result<bool, EstimationError> {
        let relocalisation = tracking.recovery.take().and_then(|recovery| recovery.relocalisation);
        let in_map = self.localise_in_map(&mut tracking.window)?;
        Ok(in_map || relocalisation.is_some_and(|search| self.relocalise(&mut tracking.window, search)))
    }

    /// Localises the window in the given map, if a search is pending; returns whether it succeeded.
    fn localise_in_map(&mut self, window: &mut Window) -> Result<bool, EstimationError> {
        let Some(map_localisation) = &mut self.map_localisation else { return Ok(false) };
        let found = match map_localisation.find(window, &self.calibration.head_from_imu) {
            Some(Ok(found)) => found,
            Some(Err(_)) if map_localisation.found().is_some() => {
                self.diagnostics.warn(self.intake.stamp(window.nominal.end_s()), WarningKind::LostInMap);
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
    fn relocalise(&mut self, window: &mut Window, search: GapRelocalisation) -> bool {
        let stamp = self.intake.stamp(window.nominal.end_s());
        let (map_from_here, local_map) = match search.find(window, &self.spec) {
            Ok(found) => found,
            Err(why) => {
                self.diagnostics.warn(stamp, WarningKind::NotRelocalised { why });
                return false;
            }
        };
        let distance_m = (local_map.consider.pivot() - self.local_map.consider.pivot()).norm();
        self.diagnostics.warn(stamp, WarningKind::Relocalised { distance_m });
        window.move_by(&map_from_here);
        self.local_map = local_map;
        true
    }
}
