//! Localisation in a given map, and relocalisation after an IMU gap in the surfaces seen before it.

use super::coasting::Coasting;
use super::local_map::LocalMap;
use super::map::{LocalisedPose, RelocalisationLimits, Relocaliser, map_covariance};
use super::surfel::Patch;
use super::window::Window;
use super::{EstimationError, EstimatorSpec};
use nalgebra::Matrix6;
use zsim_base::geometry::{Pose, Rotation, Vector, roll_pitch_yaw};
use zsim_base::surfel_map::SurfelMap;

/// Localisation of the head in a given map.
#[derive(Debug)]
pub(super) struct MapLocalisation {
    relocaliser: Relocaliser,
    /// Covariance of the map error.
    covariance: Matrix6<f64>,
    /// A pending search.
    pending: Option<Search>,
    /// Why the last search of the whole map failed.
    failure: Option<String>,
    /// Result of the first successful search.
    found: Option<LocalisedPose>,
}

/// Where the head is searched in the map.
#[derive(Debug, Clone, Copy)]
enum Search {
    /// Near this pose, `map_from_head`.
    Near(Pose),
    /// In the whole map, with any heading.
    Anywhere,
}

impl MapLocalisation {
    /// Localisation in `map`, with a pending search near `map_from_head`, or in the whole map.
    pub(super) fn new(map: &SurfelMap, map_from_head: Option<Pose>, spec: &EstimatorSpec) -> Self {
        let relocaliser = Relocaliser::new(map, &spec.matching, &spec.surfels, &spec.solve);
        let pending = Some(map_from_head.map_or(Search::Anywhere, Search::Near));
        Self { relocaliser, covariance: map_covariance(map), pending, failure: None, found: None }
    }

    /// The patches of the map.
    pub(super) fn patches(&self) -> &[Patch] {
        self.relocaliser.patches()
    }

    /// Covariance of the map error: rotation (rad), then translation (m).
    pub(super) fn covariance(&self) -> Matrix6<f64> {
        self.covariance
    }

    /// Result of the first successful search.
    pub(super) fn found(&self) -> Option<&LocalisedPose> {
        self.found.as_ref()
    }

    /// Requests another search, near `map_from_head`.
    pub(super) fn restart_search(&mut self, map_from_head: Pose) {
        self.pending = Some(Search::Near(map_from_head));
    }

    /// Requests another search of the whole map, for a later window, if the last search was one and failed.
    ///
    /// What a window sees may not determine its pose: a level scan of walls has no height, and corridors look alike.
    pub(super) fn search_again(&mut self) -> bool {
        if self.failure.is_some() {
            self.pending = Some(Search::Anywhere);
        }
        self.failure.is_some()
    }

    /// Why the last search of the whole map failed; `None` if there was none, or if it succeeded.
    pub(super) fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }

    /// Performs a pending search: localises the frame of `window` in the map by the patches of the window.
    ///
    /// `None` if no search is pending. The search is no longer pending afterwards, whether it succeeds or fails.
    pub(super) fn find(
        &mut self,
        window: &Window,
        head_from_imu: &Pose,
    ) -> Option<Result<LocalisedPose, EstimationError>> {
        let search = self.pending.take()?;
        let window_start = window.start_pose();
        let here_from_head = window_start * head_from_imu.inverse();
        let (seen, from) = (window.patches(), window_start.translation.vector);
        let located = match search {
            Search::Near(about) => self.find_near(&about, &seen, &from, &here_from_head),
            Search::Anywhere => {
                let located = self.relocaliser.find_anywhere(&seen, &from, &here_from_head);
                self.failure = located.as_ref().err().cloned();
                located
            }
        };
        if let (None, Ok(located)) = (&self.found, &located) {
            self.found = Some(located.clone());
        }
        Some(located.map_err(EstimationError::NotInMap))
    }

    /// Localises the frame of a window near the pose `about`, `map_from_head`, by the surfels `seen` from the point `from`.
    fn find_near(
        &self,
        about: &Pose,
        seen: &[Patch],
        from: &Vector,
        here_from_head: &Pose,
    ) -> Result<LocalisedPose, String> {
        // Window and map frames are both level, so only the heading of the approximate pose is used.
        let yaw = |rotation: &Rotation| roll_pitch_yaw(rotation).2;
        let turn = yaw(&about.rotation) - yaw(&here_from_head.rotation);
        let rotation = Rotation::from_axis_angle(&Vector::z_axis(), turn);
        let shift = about.translation.vector - rotation * here_from_head.translation.vector;
        let found = self.relocaliser.find_near(seen, from, &Pose::from_parts(shift.into(), rotation))?;
        let is_first = self.found.is_none();
        match is_first.then(|| self.relocaliser.find_better_elsewhere(seen, from, &found)).flatten() {
            Some(better) => Err(format!(
                "near the start {:.0} % of the observed surface matches the map, but {}; pass that as --start",
                100.0 * found.inlier_ratio,
                better.at_head(here_from_head)
            )),
            None => Ok(found),
        }
    }
}

/// Relocalisation after an IMU gap in the surfaces seen before it.
#[derive(Debug)]
pub(super) struct GapRelocalisation {
    local_map: LocalMap,
    /// Patches of the last window before the gap, in addition to the views.
    last: Vec<Patch>,
    /// Start of the gap, IMU time, s.
    until_s: f64,
}

impl GapRelocalisation {
    /// Prepares the search: the local map, the last patches, and the start of the gap.
    pub(super) fn new(local_map: LocalMap, last: Vec<Patch>, until_s: f64) -> Self {
        Self { local_map, last, until_s }
    }

    /// Pose in the map of the frame of `window`, which starts near the end of the trajectory before the gap, or where
    /// `coasting` predicts.
    ///
    /// # Errors
    /// The reason why no pose is accepted; the search can be repeated.
    pub(super) fn find(
        &self,
        window: &Window,
        spec: &EstimatorSpec,
        coasting: Option<&Coasting>,
    ) -> Result<LocalisedPose, String> {
        let patches = self.last.iter().chain(self.local_map.views.patches()).copied().collect();
        let relocaliser = Relocaliser::in_patches(patches, &spec.matching, &spec.surfels, &spec.solve);
        let window_start = window.start_pose().translation.vector;
        let sigma_m = spec.solve.match_sigma_m;
        let search = match coasting {
            Some(coasting) => RelocalisationLimits::after_coasting(coasting.position_sigma_m(), sigma_m),
            None => RelocalisationLimits::after_gap(window.start_s() - self.until_s, sigma_m),
        };
        let query = window.patches();
        let found = relocaliser.find(&query, &window_start, &Pose::identity(), &search)?;
        relocaliser.refuse_ambiguous(&query, &window_start, &found, &search)?;
        Ok(found)
    }

    /// The surfaces seen before the gap, with the covariance of the pose `found` for `window`.
    pub(super) fn into_local_map(mut self, window: &Window, found: &LocalisedPose) -> LocalMap {
        let there = found.map_from_query.transform_point(&window.start_pose().translation.vector.into()).coords;
        let known = window.known_at_start().unwrap_or_default();
        self.local_map.consider.relocalise(there, &known, &found.covariance);
        self.local_map
    }
}
