//! Where the head is: in a map that was given, or behind a silence in what was seen before it.

use super::consider::Consider;
use super::map::{IN_MAP, Located, Locator, Search, covariance_of};
use super::surfel::Patch;
use super::views::Views;
use super::window::Window;
use super::{EstimationError, EstimatorSpec};
use crate::geometry::{Pose, Rotation, Vector, roll_pitch_yaw};
use crate::surfel_map::SurfelMap;
use nalgebra::Matrix6;

/// Where the head is looked for.
#[derive(Debug)]
pub(super) struct MapLocalisation {
    locator: Locator,
    covariance: Matrix6<f64>,
    /// Where it is about, until it is looked for.
    about: Option<Pose>,
    /// Where it was found at first.
    found: Option<Located>,
}

impl MapLocalisation {
    /// In `map`, where the head begins about at `map_from_head`.
    pub(super) fn about(map: &SurfelMap, map_from_head: Pose, spec: &EstimatorSpec) -> Self {
        let certainty = (spec.solve.match_sigma_m, spec.solve.covariance_inflation);
        let locator = Locator::new(map, (&spec.matching, &spec.surfels), certainty);
        Self { locator, covariance: covariance_of(map), about: Some(map_from_head), found: None }
    }

    /// The map's patches.
    pub(super) fn patches(&self) -> &[Patch] {
        self.locator.patches()
    }

    /// The map's own error.
    pub(super) fn covariance(&self) -> Matrix6<f64> {
        self.covariance
    }

    /// Where the head was found at first.
    pub(super) fn found(&self) -> Option<&Located> {
        self.found.as_ref()
    }

    /// The head is to be looked for again, about at `map_from_head`.
    pub(super) fn look_again(&mut self, map_from_head: Pose) {
        self.about = Some(map_from_head);
    }

    /// Where the frame of `window` is in the map, by what it shows; `None` where nobody asks. One look is taken.
    pub(super) fn find(&mut self, window: &Window, head_from_imu: &Pose) -> Option<Result<Located, EstimationError>> {
        let about = self.about.take()?;
        // The window's frame is level, as the map is: of the attitude that is told the heading counts.
        let begins = window.begins();
        let here_from_head = begins * head_from_imu.inverse();
        let yaw = |rotation: &Rotation| roll_pitch_yaw(rotation).2;
        let turn = yaw(&about.rotation) - yaw(&here_from_head.rotation);
        let rotation = Rotation::from_axis_angle(&Vector::z_axis(), turn);
        let shift = about.translation.vector - rotation * here_from_head.translation.vector;
        let start = Pose::from_parts(shift.into(), rotation);
        let (seen, from) = (window.patches(), begins.translation.vector);
        let mut located = self.locator.find(&seen, (&from, &start), &IN_MAP);
        if let (None, Ok(found)) = (&self.found, &located)
            && let Some(better) = self.locator.better_elsewhere(&seen, &from, found)
        {
            located = Err(not_here(found, &better, &(better.map_from_seen * here_from_head)));
        }
        if let (None, Ok(located)) = (&self.found, &located) {
            self.found = Some(located.clone());
        }
        Some(located.map_err(EstimationError::NotInMap))
    }
}

/// Why the place found near a start is not believed, with the start at which there is a `better` one.
fn not_here(found: &Located, better: &Located, map_from_head: &Pose) -> String {
    let at = map_from_head.translation.vector;
    format!(
        "near the start {:.0} % of what was seen lies on the map, but {:.0} % at {:.1},{:.1},{:.1},{:.0}",
        100.0 * found.share,
        100.0 * better.share,
        at.x,
        at.y,
        at.z,
        roll_pitch_yaw(&map_from_head.rotation).2.to_degrees()
    )
}

/// What had been seen when the IMU fell silent for too long, in which the head is looked for behind the silence.
#[derive(Debug)]
pub(super) struct GapRelocalisation {
    views: Views,
    consider: Consider,
    /// What the window last showed, beside the views.
    last: Vec<Patch>,
    /// When it fell silent, IMU time, s.
    until_s: f64,
}

impl GapRelocalisation {
    pub(super) fn new((views, consider): (Views, Consider), last: Vec<Patch>, until_s: f64) -> Self {
        Self { views, consider, last, until_s }
    }

    /// Where the frame of `window`, which was begun about where the silence had, is in what was seen before: that, and
    /// the views and what is known of them, with the head where it was found; or why it is not found.
    pub(super) fn find(mut self, window: &Window, spec: &EstimatorSpec) -> Result<(Pose, Views, Consider), String> {
        self.last.extend(self.views.patches());
        let certainty = (spec.solve.match_sigma_m, spec.solve.covariance_inflation);
        let locator = Locator::among(self.last, (&spec.matching, &spec.surfels), certainty);
        let begins = window.begins().translation.vector;
        let search = Search::behind_silence(window.begins_s() - self.until_s, spec.solve.match_sigma_m);
        let found = locator.find(&window.patches(), (&begins, &Pose::identity()), &search)?;
        let there = found.map_from_seen.transform_point(&begins.into()).coords;
        self.consider.find_again(there, &window.known_at_start().unwrap_or_default(), &found.covariance);
        Ok((found.map_from_seen, self.views, self.consider))
    }
}
