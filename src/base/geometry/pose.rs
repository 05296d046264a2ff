//! Vectors, rotations and poses.

/// A column of three numbers: a point, a direction, a rotation vector.
pub type Vector = nalgebra::Vector3<f64>;
/// A 3 x 3 matrix.
pub type Matrix = nalgebra::Matrix3<f64>;
/// A rotation, stored as a unit quaternion.
pub type Rotation = nalgebra::UnitQuaternion<f64>;
/// A rigid transform: rotation, then translation.
pub type Pose = nalgebra::Isometry3<f64>;

/// Standard gravity, m/s^2 (CGPM 1901), along -z of the world.
pub const STANDARD_GRAVITY_M_PER_S2: f64 = 9.806_65;

/// The gravitational acceleration in the world, m/s^2.
pub fn gravity_in_world() -> Vector {
    Vector::new(0.0, 0.0, -STANDARD_GRAVITY_M_PER_S2)
}
