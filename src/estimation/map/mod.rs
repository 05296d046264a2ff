//! Persistent surfel maps: building, relocalisation and merging.

mod fuse;
mod global_check;
mod limits;
mod localised_pose;
mod relocaliser;

pub(super) use limits::RelocalisationLimits;
pub use localised_pose::LocalisedPose;
pub(super) use relocaliser::Relocaliser;

use super::observed::{ObservedSurfel, ObservedSurfels};
use super::surfel::Patch;
use super::{EstimationError, EstimatorSpec, SurfelSpec};
use nalgebra::Matrix6;
use zsim_base::geometry::{Matrix, Pose, PoseCovariance, Trajectory, Vector, skew};
use zsim_base::surfel_map::{MapSurfel, SurfelMap, SurfelMapError};
use zsim_base::time::{Span, Stamp};

/// Builds a map from the surfels `observed` in an odometry run.
///
/// Each patch is moved from the odometry pose (`open_loop`) to the final pose (`best`) at the same time, both `map_from_head`;
/// patches of the same surface are then fused. `covariances` are pose covariances at some of the stamps.
///
/// # Errors
/// When no surfels were observed.
pub fn map_of(
    observed: &ObservedSurfels,
    open_loop: &Trajectory,
    best: &Trajectory,
    covariances: &[(Stamp, PoseCovariance)],
    spec: &EstimatorSpec,
) -> Result<SurfelMap, EstimationError> {
    let mut surfels: Vec<_> = observed.surfels.iter().collect();
    surfels.sort_by(|a, b| a.tau_s.total_cmp(&b.tau_s));
    let moved = |surfel: &&ObservedSurfel| {
        let stamp = observed.origin + Span::from_seconds(surfel.tau_s);
        let (before, after) = (open_loop.at(stamp)?, best.at(stamp)?);
        let patch = surfel.patch.moved_by(&(after * before.inverse()));
        let arm = patch.centre - after.translation.vector;
        let index = covariances.partition_point(|(at, _)| *at <= stamp).saturating_sub(1);
        let of_pose = covariances.get(index).map_or(0.0, |(_, c)| variance_along(&patch.normal, c, &arm));
        let thin = patch.normal.dot(&(patch.covariance * patch.normal)).max(0.0);
        Some(patch.to_map_surfel((of_pose + thin / patch.points).sqrt()))
    };
    let surfels: Vec<MapSurfel> = surfels.iter().filter_map(moved).collect();
    let SurfelSpec { finest_voxel_m, levels, .. } = spec.registration.surfels(&spec.surfels);
    map_from(finest_voxel_m, levels, surfels)
}

/// Registers the map `other` to `map`, starting at the pose `start`, or anywhere.
///
/// Both maps must be level. `start` is the pose of the origin of `other` in `map`; it must be right to within 1 m
/// horizontally and 20 degrees of heading. Without it that origin is searched in the extent of `map`, with any heading.
///
/// # Errors
/// When no pose matches, or several poses match equally well.
pub fn locate_map(
    map: &SurfelMap,
    other: &SurfelMap,
    start: Option<&Pose>,
    spec: &EstimatorSpec,
) -> Result<LocalisedPose, EstimationError> {
    let surfels = spec.registration.surfels(&spec.surfels);
    let relocaliser = Relocaliser::new(map, &spec.matching, &surfels, &spec.solve);
    let query: Vec<Patch> = other.surfels().iter().map(Patch::from_map_surfel).collect();
    let origin = Vector::zeros();
    let found = match start {
        Some(start) => relocaliser.find_near(&query, &origin, start),
        None => relocaliser.find_anywhere(&query, &origin, &Pose::identity()),
    };
    found.map_err(EstimationError::NotInMap)
}

/// Merges two maps in the frame of the first.
///
/// `map_from_other` is the pose of the second in it. Surfels of the same surface are fused.
///
/// # Errors
/// When the maps have different resolutions.
pub fn merge_maps(map: &SurfelMap, other: &SurfelMap, map_from_other: &Pose) -> Result<SurfelMap, EstimationError> {
    let resolutions = |map: &SurfelMap| (map.finest_voxel_m(), map.levels());
    if resolutions(map) != resolutions(other) {
        let ((a, m), (b, n)) = (resolutions(map), resolutions(other));
        let message = format!(
            "cannot merge: one map has {m} resolutions from {a} m, the other {n} from {b} m; build both with the same settings"
        );
        return Err(EstimationError::Map(message));
    }
    let moved = other.surfels().iter().map(|surfel| {
        let patch = Patch::from_map_surfel(surfel).moved_by(map_from_other);
        patch.to_map_surfel(surfel.sigma_m)
    });
    map_from(map.finest_voxel_m(), map.levels(), map.surfels().iter().copied().chain(moved).collect())
}

fn map_from(finest_voxel_m: f64, levels: usize, surfels: Vec<MapSurfel>) -> Result<SurfelMap, EstimationError> {
    let fused = fuse::fuse(finest_voxel_m, surfels);
    if fused.is_empty() {
        return Err(EstimationError::Map("no surfels to build a map from".to_owned()));
    }
    SurfelMap::new(finest_voxel_m, levels, fused)
        .map_err(|error: SurfelMapError| EstimationError::Map(error.to_string()))
}

/// Variance along `normal` of a point at `arm` (m) from the head, by the head's pose covariance, m^2.
fn variance_along(normal: &Vector, covariance: &PoseCovariance, arm: &Vector) -> f64 {
    let mut by = nalgebra::Matrix3x6::<f64>::zeros();
    by.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
    by.fixed_view_mut::<3, 3>(0, 3).copy_from(&-skew(arm));
    let row = normal.transpose() * by;
    (row * covariance * row.transpose())[(0, 0)].max(0.0)
}

impl Patch {
    /// Transforms the patch by `a_from_b`.
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

    pub(super) fn from_map_surfel(surfel: &MapSurfel) -> Self {
        Self {
            centre: surfel.centre_in_map,
            normal: surfel.normal_in_map,
            points: surfel.points,
            covariance: surfel.covariance_in_map,
            roughness_variance: 0.0,
            level: surfel.level,
        }
    }

    pub(super) fn to_map_surfel(self, sigma_m: f64) -> MapSurfel {
        MapSurfel {
            centre_in_map: self.centre,
            normal_in_map: self.normal.normalize(),
            covariance_in_map: self.covariance + self.normal * self.normal.transpose() * self.roughness_variance,
            points: self.points,
            sigma_m,
            level: self.level,
        }
    }
}

/// Covariance of a common error of the whole map: rotation (rad), then translation (m).
///
/// The translation has the median standard deviation of the surfels; the rotation causes the same displacement at `ARM_M`.
pub(super) fn map_covariance(map: &SurfelMap) -> Matrix6<f64> {
    /// Typical distance of surfaces from the head, m.
    const ARM_M: f64 = 5.0;
    let mut sigmas: Vec<f64> = map.surfels().iter().map(|surfel| surfel.sigma_m).collect();
    sigmas.sort_by(f64::total_cmp);
    let variance = sigmas.get(sigmas.len() / 2).map_or(0.0, |sigma_m| sigma_m * sigma_m);
    let mut diagonal = [variance / (ARM_M * ARM_M); 6];
    diagonal[3..].fill(variance);
    Matrix6::from_diagonal(&diagonal.into())
}
