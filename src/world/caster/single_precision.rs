//! Vectors in single precision, as the ray search uses them.

use zsim_base::geometry::Vector;

/// A vector in single precision.
pub(super) type Vec3 = parry3d::math::Vector;

/// Rounds a vector to single precision.
pub(super) fn single(v: &Vector) -> Vec3 {
    Vec3::new(v.x as f32, v.y as f32, v.z as f32)
}

/// A slightly larger reach, so that the double-precision distance decides.
#[inline(always)]
pub(super) fn single_reach(reach: f64) -> f32 {
    (reach * (1.0 + 1e-6)) as f32
}
