//! Rotations, poses, motion of rigid bodies, trajectories, surfaces.
//!
//! # Frames
//!
//! A transform is named for what it does: `world_from_head` takes a point's coordinates in the head to its coordinates
//! in the world, so `point_in_world = world_from_head * point_in_head`, and `world_from_head * head_from_laser`
//! composes. A vector is named for the frame it is written in: `velocity_in_world`. Frames are right-handed (REP-103):
//! in a body x points forward, y left, z up; in the world z points up, against gravity.
//!
//! Positions are metres, angles radians, unless a name says otherwise.

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

/// Covariance of a pose, of its position (m), then of its attitude (rad): a small turn in the axes of the frame that
/// the pose is told in. The order of `geometry_msgs/PoseWithCovariance`.
pub type PoseCovariance = nalgebra::Matrix6<f64>;

/// Standard gravity, m/s^2 (CGPM 1901), along -z of the world.
pub const STANDARD_GRAVITY_M_PER_S2: f64 = 9.806_65;

/// The acceleration of free fall in the world, m/s^2.
pub fn gravity_in_world() -> Vector {
    Vector::new(0.0, 0.0, -STANDARD_GRAVITY_M_PER_S2)
}
