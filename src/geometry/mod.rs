//! Rotations, poses, kinematics of rigid bodies, trajectories, routes and surfaces.
//!
//! # Frames
//!
//! The name of a transform gives the two frames: `world_from_head` maps coordinates in the head to coordinates in the
//! world, so `point_in_world = world_from_head * point_in_head`, and `world_from_head * head_from_laser` composes. The
//! name of a vector gives the frame of the coordinates: `velocity_in_world`. Frames are right-handed (REP-103): in a
//! body x points forward, y left, z up; in the world z points up, against gravity.
//!
//! Positions are in metres and angles in radians, unless a name states another unit.

mod kinematics;
mod rotation;
mod route;
mod smooth;
mod surface;
mod trajectory;

pub use kinematics::Kinematics;
pub use rotation::{from_roll_pitch_yaw, left_jacobian, right_jacobian, roll_pitch_yaw, skew};
pub use route::Route;
pub use smooth::SmoothCursor;
pub use surface::{Surface, SurfacePoint};
pub use trajectory::{Trajectory, TrajectoryError};

/// A column of three numbers: a point, a direction, a rotation vector.
pub type Vector = nalgebra::Vector3<f64>;
/// A 3 x 3 matrix.
pub type Matrix = nalgebra::Matrix3<f64>;
/// A rotation, stored as a unit quaternion.
pub type Rotation = nalgebra::UnitQuaternion<f64>;
/// A rigid transform: rotation, then translation.
pub type Pose = nalgebra::Isometry3<f64>;

/// Covariance of a pose: position (m), then attitude (rad).
///
/// The attitude error is a small rotation in the axes of the parent frame of the pose. The order is that of
/// `geometry_msgs/PoseWithCovariance`.
pub type PoseCovariance = nalgebra::Matrix6<f64>;

/// Standard gravity, m/s^2 (CGPM 1901), along -z of the world.
pub const STANDARD_GRAVITY_M_PER_S2: f64 = 9.806_65;

/// The gravitational acceleration in the world, m/s^2.
pub fn gravity_in_world() -> Vector {
    Vector::new(0.0, 0.0, -STANDARD_GRAVITY_M_PER_S2)
}
