//! The sensor model of the bound, and the bound itself.

use zsim_base::geometry::{Pose, Vector};
use zsim_base::measurement::ImuNoise;
use zsim_base::time::{Span, Stamp};

/// Time between the epochs at which errors are reported.
pub(super) const EPOCH: Span = Span::from_nanos(20_000_000);

/// Prior standard deviations of the sensors' errors.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundModel {
    /// Pose of the IMU in the head.
    pub head_from_imu: Pose,
    /// Noise of the IMU.
    pub imu: ImuNoise,
    /// Scale error (diagonal, 1) and misalignment (off-diagonal, rad) of the gyroscope.
    pub gyro_matrix: (f64, f64),
    /// Scale error (diagonal, 1) and misalignment (off-diagonal, rad) of the accelerometer.
    pub accel_matrix: (f64, f64),
    /// Common offset of all ranges of the run, m.
    pub range_offset_m: f64,
    /// Clock offset, s.
    pub clock_offset_s: f64,
    /// Rate of the clock offset, s/s.
    pub clock_rate: f64,
}

#[cfg(test)]
impl BoundModel {
    /// A model with errors of all kinds.
    pub(super) fn for_tests() -> Self {
        Self {
            head_from_imu: Pose::translation(0.03, 0.0, 0.05),
            imu: ImuNoise {
                gyro_density_rad_per_s_per_sqrt_hz: 1e-3,
                accel_density_m_per_s2_per_sqrt_hz: 1e-2,
                gyro_bias_walk_rad_per_s_per_sqrt_s: 1e-4,
                accel_bias_walk_m_per_s2_per_sqrt_s: 1e-3,
                gyro_turn_on_bias_rad_per_s: 0.01,
                accel_turn_on_bias_m_per_s2: 0.1,
                gyro_scale_error: 0.0,
                gyro_misalignment_rad: 0.0,
                accel_scale_error: 0.0,
                accel_misalignment_rad: 0.0,
                gyro_limit_rad_per_s: 10.0,
                accel_limit_m_per_s2: 50.0,
            },
            gyro_matrix: (0.01, 0.005),
            accel_matrix: (0.01, 0.005),
            range_offset_m: 0.01,
            clock_offset_s: 0.01,
            clock_rate: 1e-4,
        }
    }
}

/// Cramer-Rao bounds: minimum RMS errors and standard deviations of any unbiased estimator.
///
/// With an unknown map, position and heading of the whole trajectory are not observable. All errors are then those after the
/// rigid alignment of the positions that the evaluation uses.
#[derive(Debug, Clone, PartialEq)]
pub struct InformationBound {
    /// Stamps of the epochs, lidar time.
    pub stamps: Vec<Stamp>,
    /// Standard deviation of the head position along each world axis, m.
    pub position_sigma_m: Vec<Vector>,
    /// Standard deviation of the head attitude about each world axis, rad.
    pub attitude_sigma_rad: Vec<Vector>,
    /// RMS position error over the run in the world frame, m.
    pub position_rmse_m: f64,
    /// RMS position error along each world axis, m.
    pub axis_rmse_m: Vector,
    /// RMSE of the position after the rigid alignment that the evaluation uses, m: comparable with the RMSE of an
    /// estimate.
    pub aligned_position_rmse_m: f64,
    /// RMS attitude error over the run in the world frame, rad.
    pub attitude_rmse_rad: f64,
    /// Standard deviation of the clock offset at the end, s.
    pub clock_offset_s: f64,
    /// Standard deviation of the range offset, m.
    pub range_offset_m: f64,
    /// Results that only an unknown map has.
    pub unknown_map: Option<UnknownMap>,
}

/// What is known of the map before the run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MapKnowledge {
    /// All surfaces are known exactly: the bound of localisation.
    #[default]
    Known,
    /// Nothing is known of the surfaces: the bound of SLAM.
    Unknown,
}

/// Results of the bound with an unknown map.
#[derive(Debug, Clone, PartialEq)]
pub struct UnknownMap {
    /// Number of planes that beams hit.
    pub planes: usize,
    /// Fraction of the beams on planes that are one plane in the whole run. There are too many planes to treat the others
    /// so: they count as new planes in each 2 s, which raises the bound.
    pub joint_beam_fraction: f64,
}
