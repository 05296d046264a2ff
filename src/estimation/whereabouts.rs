//! A map in which the head is, and whether it was found there.

use super::map::{Located, Locator, covariance_of};
use super::surfel::Patch;
use super::window::Window;
use super::{EstimationError, EstimatorSpec};
use crate::geometry::{Pose, Rotation, Vector, roll_pitch_yaw};
use crate::surfel_map::SurfelMap;
use nalgebra::Matrix6;

/// Where the head is looked for.
#[derive(Debug)]
pub(super) struct Whereabouts {
    locator: Locator,
    covariance: Matrix6<f64>,
    /// Where it is about, until it is looked for.
    about: Option<Pose>,
    /// Where it was found at first.
    found: Option<Located>,
}

impl Whereabouts {
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
        let located = self.locator.find(&window.patches(), &begins.translation.vector, &start);
        if let (None, Ok(located)) = (&self.found, &located) {
            self.found = Some(located.clone());
        }
        Some(located)
    }
}
