//! How serde writes the fields of a page's data that are not written as they are.

use super::encode::{self, TimedPose, base64_f32, seven};
use super::quantise::{self, ViewPoint};
use serde::{Serialize, Serializer};
use zsim_base::geometry::{Pose, Vector};

pub(super) fn numbers<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    base64_f32(values.iter().copied()).serialize(serializer)
}

pub(super) fn pose<S: Serializer>(pose: &Pose, serializer: S) -> Result<S::Ok, S::Error> {
    seven(pose).serialize(serializer)
}

pub(super) fn path<S: Serializer>(poses: &[TimedPose], serializer: S) -> Result<S::Ok, S::Error> {
    encode::path(poses).serialize(serializer)
}

pub(super) fn cloud<S: Serializer>(points: &[ViewPoint], serializer: S) -> Result<S::Ok, S::Error> {
    quantise::cloud(points).serialize(serializer)
}

pub(super) fn triangles<S: Serializer>(triangles: &[[Vector; 3]], serializer: S) -> Result<S::Ok, S::Error> {
    base64_f32(triangles.iter().flatten().flat_map(|corner| corner.iter().copied())).serialize(serializer)
}
