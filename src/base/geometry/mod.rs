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
mod pose;
mod rotation;
mod route;
mod smooth;
mod surface;
mod trajectory;

pub use kinematics::Kinematics;
pub use pose::{Matrix, Pose, Rotation, STANDARD_GRAVITY_M_PER_S2, Vector, gravity_in_world};
pub use rotation::{from_roll_pitch_yaw, left_jacobian, right_jacobian, roll_pitch_yaw, skew};
pub use route::Route;
pub use smooth::SmoothCursor;
pub use surface::{Surface, SurfacePoint};
pub use trajectory::{Trajectory, TrajectoryError};

/// Covariance of a pose: position (m), then attitude (rad).
///
/// The attitude error is a small rotation in the axes of the parent frame of the pose. The order is that of
/// `geometry_msgs/PoseWithCovariance`.
pub type PoseCovariance = nalgebra::Matrix6<f64>;
