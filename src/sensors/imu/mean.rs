use crate::geometry::{Kinematics, Rotation, Vector, gravity_in_world};

/// Mean angular velocity and specific force over an interval, in the IMU frame: the content of an IMU sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanMotion {
    /// Angular velocity, rad/s.
    pub angular_velocity_rad_per_s: Vector,
    /// Specific force, gravity included, m/s^2.
    pub specific_force_m_per_s2: Vector,
}

/// The sample of an ideal IMU over the interval from `start` to `end`, of length `dt_s`.
///
/// It is the change of attitude and velocity over the interval, divided by the length, as a strapdown unit reports it
/// that integrates at a high rate inside (coning and sculling included).
///
/// The angular velocity is `log(R_start^T R_end) / dt`. The specific force is `R_mid^T ((v_end - v_start) / dt - g)`,
/// with `R_mid` half-way along that rotation. Integration by `exp(angular_velocity dt)` and `R_mid specific_force + g`
/// therefore reproduces attitude and velocity exactly, for any motion within the interval.
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
