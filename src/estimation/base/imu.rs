//! The IMU on the base.

use zsim_base::geometry::Pose;
use zsim_base::measurement::{ImuAveraging, ImuNoise};

/// Description of the base's IMU.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseImu {
    /// Pose of the IMU in the base frame.
    pub base_from_imu: Pose,
    /// Noise parameters.
    pub noise: ImuNoise,
    /// How it derives its samples from the motion.
    pub averaging: ImuAveraging,
    /// Clock offset, IMU stamp minus fix stamp of the same event, to 1 or 2 ms, s; `None` to search within 1 s.
    pub clock_offset_s: Option<f64>,
}
