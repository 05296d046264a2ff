//! Pose of observed surfels in a map, and distances between poses.

use nalgebra::{Matrix6, Vector6};
use zsim_base::geometry::{Pose, Rotation, Vector, roll_pitch_yaw};

/// Pose of a query found in a map.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalisedPose {
    /// Pose of the query frame in the map.
    pub map_from_query: Pose,
    /// Fraction of the finest query surfels that match the map.
    pub inlier_ratio: f64,
    /// Number of the finest query surfels that match the map.
    pub(crate) matched: usize,
    /// Fraction of matches among the surfels with a neighbour in the map.
    pub(crate) agreement: f64,
    /// Root mean square distance of the matches along the normals, m.
    pub residual_rms_m: f64,
    /// Covariance of a rotation about the viewpoint (rad) and a translation (m), in map axes.
    pub(crate) covariance: Matrix6<f64>,
    /// Distance that the true position may be from this one because another pose matches too, m.
    pub(crate) ambiguity_m: f64,
}

/// Poses with at least this fraction of the best score may be the true one.
const LIKELY_SCORE: f64 = 0.1;

impl LocalisedPose {
    /// How much matches, with the pose of the head as an argument of `--start`.
    pub(crate) fn at_head(&self, query_from_head: &Pose) -> String {
        let map_from_head = self.map_from_query * query_from_head;
        let at = map_from_head.translation.vector;
        let yaw_deg = roll_pitch_yaw(&map_from_head.rotation).2.to_degrees();
        let percent = 100.0 * self.inlier_ratio;
        format!("{percent:.0} % at x,y,z,yaw = {:.1},{:.1},{:.1},{yaw_deg:.0}", at.x, at.y, at.z)
    }

    /// The largest standard deviation of the position over all directions, m.
    pub(super) fn position_sigma_m(&self) -> f64 {
        self.covariance.fixed_view::<3, 3>(3, 3).into_owned().symmetric_eigenvalues().max().max(0.0).sqrt()
    }

    /// Adds to the covariance the spread of poses that match too, weighted by their scores, and records the largest
    /// distance of those with at least [`LIKELY_SCORE`] of the best score.
    pub(super) fn with_alternatives(&self, scored: &[&(f64, LocalisedPose)], from: &Vector) -> Self {
        let best = scored.iter().map(|(score, _)| *score).fold(0.0, f64::max);
        let likely = scored.iter().filter(|(score, _)| *score > LIKELY_SCORE * best);
        let distance = |found: &LocalisedPose| pose_distance(&found.map_from_query, &self.map_from_query, from).0;
        let ambiguity_m = likely.map(|(_, found)| distance(found)).fold(self.ambiguity_m, f64::max);
        let sum: f64 = scored.iter().map(|(score, _)| score).sum();
        let mut covariance = self.covariance;
        for (score, other) in scored {
            let turn = (other.map_from_query.rotation * self.map_from_query.rotation.inverse()).scaled_axis();
            let position = |located: &LocalisedPose| located.map_from_query.transform_point(&(*from).into()).coords;
            let shift = position(other) - position(self);
            let by = Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z);
            covariance += by * by.transpose() * (score / sum);
        }
        Self { covariance, ambiguity_m, ..self.clone() }
    }
}

/// Distance of the viewpoint between two poses, m, and their angle, rad.
pub(super) fn pose_distance(a: &Pose, b: &Pose, from: &Vector) -> (f64, f64) {
    let position = |pose: &Pose| pose.transform_point(&(*from).into()).coords;
    ((position(a) - position(b)).norm(), a.rotation.angle_to(&b.rotation))
}

/// Pose rotated about the vertical through the viewpoint and translated.
pub(super) fn offset_pose(map_from_query: &Pose, from: &Vector, yaw: f64, by: Vector) -> Pose {
    let pivot = map_from_query.transform_point(&(*from).into()).coords;
    apply_step(map_from_query, &pivot, &Vector6::new(0.0, 0.0, yaw, by.x, by.y, by.z))
}

/// Pose rotated about `pivot` and translated.
pub(super) fn apply_step(pose: &Pose, pivot: &Vector, step: &Vector6<f64>) -> Pose {
    let turn = Rotation::from_scaled_axis(step.fixed_rows::<3>(0).into_owned());
    let shift: Vector = step.fixed_rows::<3>(3).into_owned();
    let translation = pivot + shift + turn * (pose.translation.vector - pivot);
    Pose::from_parts(translation.into(), turn * pose.rotation)
}
