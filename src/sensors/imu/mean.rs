use crate::geometry::{Kinematics, Rotation, Vector, gravity_in_world};

/// How a frame turned and what force held it, on average over an interval: what an IMU says, in its own frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanMotion {
    /// Angular velocity, rad/s.
    pub angular_velocity_rad_per_s: Vector,
    /// Specific force, gravity included, m/s^2.
    pub specific_force_m_per_s2: Vector,
}

/// What an ideal IMU says of the interval from `start` to `end`, `dt_s` later: the rotation and velocity it went
/// through, divided by the time, as a strapdown unit that integrates at a high rate inside (coning and sculling
/// included) has them.
///
/// The angular velocity is `log(R_start^T R_end) / dt`. The specific force is `R_mid^T ((v_end - v_start) / dt - g)`,
/// with `R_mid` half-way along that rotation. So a user who turns by `exp(angular_velocity dt)` and accelerates by
/// `R_mid specific_force + g` retraces attitude and velocity exactly, whatever happened in between.
pub fn mean_motion(start: &Kinematics, end: &Kinematics, dt_s: f64) -> MeanMotion {
    let from = start.world_from_body.rotation;
    let turn = (from.inverse() * end.world_from_body.rotation).scaled_axis();
    let middle = from * Rotation::from_scaled_axis(turn * 0.5);
    let acceleration = (end.velocity_in_world - start.velocity_in_world) / dt_s;
    MeanMotion {
        angular_velocity_rad_per_s: turn / dt_s,
        specific_force_m_per_s2: middle.inverse() * (acceleration - gravity_in_world()),
    }
}
