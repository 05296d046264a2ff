use crate::geometry::Vector;
use crate::time::Stamp;

/// One sample of an inertial measurement unit, in the IMU's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImuSample {
    /// Time on the IMU's clock.
    pub stamp: Stamp,
    /// Angular velocity, rad/s.
    pub angular_velocity_rad_per_s: Vector,
    /// Specific force (gravity included: +9.81 along z when level and at rest, REP-145), m/s^2.
    pub specific_force_m_per_s2: Vector,
}
