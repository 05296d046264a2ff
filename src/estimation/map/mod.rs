//! Maps that last: what a survey saw becomes surfels that are kept, found again, and put together.

mod fuse;
mod locate;
mod search;
mod whole;

pub use locate::Located;
pub(super) use locate::Locator;
pub(super) use search::{IN_MAP, Search};

use super::surfel::Patch;
use super::survey::{Sighting, Survey};
use super::{EstimationError, EstimatorSpec, RegistrationSpec};
use crate::geometry::{Matrix, Pose, PoseCovariance, Trajectory, Vector, skew};
use crate::surfel_map::{MapSurfel, SurfelMap, SurfelMapError};
use crate::time::{Span, Stamp};
use nalgebra::Matrix6;

/// The map that an open loop's `survey` makes: its patches are carried from where the open loop put them to where the
/// final trajectory, at the same stamps, has them (`open_loop` and `best`), and those of one surface are put together.
/// `covariances` are those of some of the poses.
///
/// # Errors
/// When there is nothing in it.
pub fn map_of(
    survey: &Survey,
    (open_loop, best): (&Trajectory, &Trajectory),
    covariances: &[(Stamp, PoseCovariance)],
    spec: &RegistrationSpec,
) -> Result<SurfelMap, EstimationError> {
    let mut seen: Vec<_> = survey.sightings.iter().collect();
    seen.sort_by(|a, b| a.tau_s.total_cmp(&b.tau_s));
    let moved = |sighting: &&Sighting| {
        let stamp = survey.origin + Span::from_seconds(sighting.tau_s);
        let (before, after) = (open_loop.at(stamp)?, best.at(stamp)?);
        let patch = sighting.patch.moved_by(&(after * before.inverse()));
        let arm = patch.centre - after.translation.vector;
        let index = covariances.partition_point(|(at, _)| *at <= stamp).saturating_sub(1);
        let of_pose = covariances.get(index).map_or(0.0, |(_, c)| variance_along(&patch.normal, c, &arm));
        let thin = patch.normal.dot(&(patch.covariance * patch.normal)).max(0.0);
        Some(patch.to_map((of_pose + thin / patch.points).sqrt()))
    };
    let surfels: Vec<MapSurfel> = seen.iter().filter_map(moved).collect();
    map_from(spec.finest_voxel_m, spec.levels, surfels)
}

/// Where in `map` another map is, whose origin is about at `start` in it: within a metre on the level and twenty
/// degrees about the vertical, both maps being level.
///
/// # Errors
/// When it is not found there, or at several places.
pub fn locate_map(
    map: &SurfelMap,
    other: &SurfelMap,
    start: &Pose,
    spec: &EstimatorSpec,
) -> Result<Located, EstimationError> {
    let surfels = spec.registration.surfels(&spec.surfels);
    let certainty = (spec.solve.match_sigma_m, spec.solve.covariance_inflation);
    let locator = Locator::new(map, (&spec.matching, &surfels), certainty);
    let seen: Vec<Patch> = other.surfels().iter().map(Patch::of_map).collect();
    locator.find(&seen, (&Vector::zeros(), start), &IN_MAP).map_err(EstimationError::NotInMap)
}

/// One map of two, in the frame of the first: `map_from_other` puts the second there. What both saw of a surface is put
/// together.
///
/// # Errors
/// When they have not the same resolutions.
pub fn merge_maps(map: &SurfelMap, other: &SurfelMap, map_from_other: &Pose) -> Result<SurfelMap, EstimationError> {
    let resolutions = |map: &SurfelMap| (map.finest_voxel_m(), map.levels());
    if resolutions(map) != resolutions(other) {
        let ((a, m), (b, n)) = (resolutions(map), resolutions(other));
        let message = format!(
            "one has {m} resolutions from {a} m on, the other {n} from {b} m on; maps of one kind can be put together"
        );
        return Err(EstimationError::Map(message));
    }
    let moved = other.surfels().iter().map(|surfel| {
        let patch = Patch::of_map(surfel).moved_by(map_from_other);
        patch.to_map(surfel.sigma_m)
    });
    map_from(map.finest_voxel_m(), map.levels(), map.surfels().iter().copied().chain(moved).collect())
}

fn map_from(finest_voxel_m: f64, levels: usize, surfels: Vec<MapSurfel>) -> Result<SurfelMap, EstimationError> {
    let fused = fuse::fuse(finest_voxel_m, surfels);
    if fused.is_empty() {
        return Err(EstimationError::Map("nothing was seen that makes a map".to_owned()));
    }
    SurfelMap::new(finest_voxel_m, levels, fused)
        .map_err(|error: SurfelMapError| EstimationError::Map(error.to_string()))
}

/// Variance along `normal` of a point `arm` away from a head of this covariance, m^2.
fn variance_along(normal: &Vector, covariance: &PoseCovariance, arm: &Vector) -> f64 {
    let mut by = nalgebra::Matrix3x6::<f64>::zeros();
    by.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
    by.fixed_view_mut::<3, 3>(0, 3).copy_from(&-skew(arm));
    let row = normal.transpose() * by;
    (row * covariance * row.transpose())[(0, 0)].max(0.0)
}

impl Patch {
    /// The patch where `a_from_b` puts it.
    pub(super) fn moved_by(&self, a_from_b: &Pose) -> Self {
        let turn = a_from_b.rotation.to_rotation_matrix().into_inner();
        let covariance: Matrix = turn * self.covariance * turn.transpose();
        Self {
            centre: turn * self.centre + a_from_b.translation.vector,
            normal: turn * self.normal,
            covariance: (covariance + covariance.transpose()) * 0.5,
            ..*self
        }
    }

    pub(super) fn of_map(surfel: &MapSurfel) -> Self {
        Self {
            centre: surfel.centre_in_map,
            normal: surfel.normal_in_map,
            points: surfel.points,
            covariance: surfel.covariance_in_map,
            doubt: 0.0,
            level: surfel.level,
        }
    }

    pub(super) fn to_map(self, sigma_m: f64) -> MapSurfel {
        MapSurfel {
            centre_in_map: self.centre,
            normal_in_map: self.normal.normalize(),
            covariance_in_map: self.covariance + self.normal * self.normal.transpose() * self.doubt,
            points: self.points,
            sigma_m,
            level: self.level,
        }
    }
}

/// A map's own error as one of the whole: a shift as large as its surfels are uncertain in the middle (median), and a
/// turn that makes as much of it at `ARM_M`.
pub(super) fn covariance_of(map: &SurfelMap) -> Matrix6<f64> {
    const ARM_M: f64 = 5.0;
    let mut sigmas: Vec<f64> = map.surfels().iter().map(|surfel| surfel.sigma_m).collect();
    sigmas.sort_by(f64::total_cmp);
    let variance = sigmas.get(sigmas.len() / 2).map_or(0.0, |sigma_m| sigma_m * sigma_m);
    let mut diagonal = [variance / (ARM_M * ARM_M); 6];
    diagonal[3..].fill(variance);
    Matrix6::from_diagonal(&diagonal.into())
}
