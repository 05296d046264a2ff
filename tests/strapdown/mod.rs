//! Textbook strapdown integration, as a user of `/imu/data_raw` would write it.

use zsim::geometry::{Kinematics, Pose, Rotation, Vector, gravity_in_world};

/// Pose of the IMU in the world after `readings` at the spacing `dt_s`, each an angular velocity (rad/s) and a specific
/// force (m/s^2) that is compensated for coning and sculling.
pub fn integrate(start: &Kinematics, readings: impl Iterator<Item = (Vector, Vector)>, dt_s: f64) -> Pose {
    let (mut rotation, mut velocity) = (start.world_from_body.rotation, start.velocity_in_world);
    let mut position = start.world_from_body.translation.vector;
    for (rate, force) in readings {
        let turn = rate * dt_s;
        let middle = rotation * Rotation::from_scaled_axis(turn * 0.5);
        let acceleration = middle * force + gravity_in_world();
        position += velocity * dt_s + acceleration * (0.5 * dt_s * dt_s);
        velocity += acceleration * dt_s;
        rotation *= Rotation::from_scaled_axis(turn);
    }
    Pose::from_parts(position.into(), rotation)
}
