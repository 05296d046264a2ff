//! The inputs of the bound with an unknown map.

use super::super::epoch::Epoch;
use super::super::model::{BoundModel, EPOCH};
use super::division::Segment;
use super::joint_planes::JointPlanes;
use super::sightings::Sightings;
use nalgebra::{Matrix3, Vector3};

/// Maximum number of planes that are unknowns of the whole run. Bounds time and memory.
const MAX_JOINT_PLANES: usize = 3000;

/// What is known of the map before the run.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct MapPrior {
    /// Standard deviations of offset, m, and slopes, rad, of a plane.
    pub plane: Vector3<f64>,
    /// Standard deviations of position, m, and heading, rad, of the first pose.
    pub first_pose: Option<(f64, f64)>,
    /// Maximum number of planes that are unknowns of the whole run.
    pub max_joint_planes: usize,
}

impl MapPrior {
    /// Planes unknown, first pose the reference.
    pub(in super::super) const UNKNOWN: Self = Self {
        plane: Vector3::new(100.0, 10.0, 10.0),
        first_pose: Some((1e-6, 1e-6)),
        max_joint_planes: MAX_JOINT_PLANES,
    };

    pub(super) fn plane_information(&self) -> Matrix3<f64> {
        Matrix3::from_diagonal(&self.plane.map(|sigma| 1.0 / (sigma * sigma)))
    }
}

/// All that determines the bound.
pub(super) struct Problem<'a> {
    pub model: BoundModel,
    pub epochs: &'a [Epoch],
    pub sightings: &'a Sightings,
    pub segments: Vec<Segment>,
    /// The kept epochs of all segments.
    pub kept: Vec<usize>,
    pub joint: JointPlanes,
    pub prior: MapPrior,
}

impl Problem<'_> {
    pub(super) fn since_start_s(&self, epoch: usize) -> f64 {
        epoch as f64 * EPOCH.seconds()
    }
}
