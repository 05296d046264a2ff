use crate::geometry::Vector;
use crate::time::Stamp;
use serde::{Deserialize, Serialize};

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

/// How an IMU derives a sample from the motion during the sample's interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ImuAveraging {
    /// Instantaneous angular velocity and specific force at the middle of the interval.
    None,
    /// Means of angular velocity and specific force in the axes of the moving body.
    BodyMean,
    /// Rotation vector and velocity increment, divided by the length of the interval: the IMU compensates for coning and
    /// sculling. The axes of the velocity increment are those half-way along the rotation.
    #[default]
    ConingCorrected,
}
