use super::ImuAveraging;
use crate::geometry::{Pose, Rotation, Vector};
use serde::{Deserialize, Serialize};

/// Extrinsics of the sensors in the head, and their noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// Pose of the lidar in the head.
    pub head_from_laser: Pose,
    /// Pose of the IMU in the head.
    pub head_from_imu: Pose,
    /// The IMU's noise.
    pub imu: ImuNoise,
    /// How the IMU derives its samples from the motion.
    pub imu_averaging: ImuAveraging,
    /// The lidar's noise.
    pub lidar: LidarNoise,
}

/// Correction to a lidar's calibration, in the axes of the IMU.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LidarCorrection {
    /// Added to every range, m.
    pub range_m: f64,
    /// Rotation of the lidar about the lidar origin.
    pub rotation: Rotation,
    /// Translation of the lidar, m.
    pub translation: Vector,
}

impl Default for LidarCorrection {
    fn default() -> Self {
        Self { range_m: 0.0, rotation: Rotation::identity(), translation: Vector::zeros() }
    }
}

impl LidarCorrection {
    /// Corrects a vector from the lidar to a point, m, given as the calibration yields it (`reach`).
    pub fn apply(&self, reach: &Vector) -> Vector {
        self.rotation * (reach * (1.0 + self.range_m / reach.norm()))
    }

    /// Inverse of [`Self::apply`].
    ///
    /// The vector, m, that the calibration yields for a point at `reach` from the lidar.
    pub fn remove(&self, reach: &Vector) -> Vector {
        self.rotation.inverse() * (reach * (1.0 - self.range_m / reach.norm()))
    }
}

impl Calibration {
    /// Pose of the lidar in the head, with the correction applied.
    pub fn head_from_corrected_laser(&self, correction: &LidarCorrection) -> Pose {
        let mut imu_from_laser = self.head_from_imu.inverse() * self.head_from_laser;
        imu_from_laser.rotation = correction.rotation * imu_from_laser.rotation;
        imu_from_laser.translation.vector += correction.translation;
        self.head_from_imu * imu_from_laser
    }
}

/// Errors of an IMU: noise in Kalibr's model (densities of white noise and of the random walks of the biases), scale,
/// misalignment and limits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImuNoise {
    /// White noise density of the gyroscope, rad/s/sqrt(Hz).
    pub gyro_density_rad_per_s_per_sqrt_hz: f64,
    /// White noise density of the accelerometer, m/s^2/sqrt(Hz).
    pub accel_density_m_per_s2_per_sqrt_hz: f64,
    /// Random walk of the gyroscope bias, rad/s/sqrt(s).
    pub gyro_bias_walk_rad_per_s_per_sqrt_s: f64,
    /// Random walk of the accelerometer bias, m/s^2/sqrt(s).
    pub accel_bias_walk_m_per_s2_per_sqrt_s: f64,
    /// Standard deviation of the gyroscope bias at power-on, rad/s.
    pub gyro_turn_on_bias_rad_per_s: f64,
    /// Standard deviation of the accelerometer bias at power-on, m/s^2.
    pub accel_turn_on_bias_m_per_s2: f64,
    /// Standard deviation of the scale error of each axis of the gyroscope, as a fraction of the rate.
    pub gyro_scale_error: f64,
    /// Standard deviation of the misalignment of each axis of the gyroscope towards each other axis, rad.
    pub gyro_misalignment_rad: f64,
    /// Standard deviation of the scale error of each axis of the accelerometer, as a fraction of the specific force.
    pub accel_scale_error: f64,
    /// Standard deviation of the misalignment of each axis of the accelerometer towards each other axis, rad.
    pub accel_misalignment_rad: f64,
    /// Measuring range of the gyroscope per axis, rad/s: larger rates saturate.
    pub gyro_limit_rad_per_s: f64,
    /// Measuring range of the accelerometer per axis, m/s^2: larger specific forces saturate.
    pub accel_limit_m_per_s2: f64,
}

/// Range noise of a lidar: constant up to `near_m`, then linear through `far_sigma_m` at `far_m`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LidarNoise {
    /// Standard deviation of ranges up to `near_m`, m.
    pub near_sigma_m: f64,
    /// Range up to which `near_sigma_m` applies, m.
    pub near_m: f64,
    /// Standard deviation at `far_m`, m.
    pub far_sigma_m: f64,
    /// Range at which `far_sigma_m` applies, m.
    pub far_m: f64,
}

impl LidarNoise {
    /// Standard deviation of a range of `range_m`, m: constant, then linear, never below `near_sigma_m`.
    pub fn sigma_m(&self, range_m: f64) -> f64 {
        let beyond = (range_m - self.near_m).max(0.0) / (self.far_m - self.near_m);
        self.near_sigma_m + (self.far_sigma_m - self.near_sigma_m) * beyond
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn range_noise_of_the_utm30lx_rises_from_10_mm_at_10_m_to_30_mm_at_30_m() {
        let noise = LidarNoise { near_sigma_m: 0.010, near_m: 10.0, far_sigma_m: 0.030, far_m: 30.0 };
        assert_eq!(noise.sigma_m(3.0), 0.010);
        assert!((noise.sigma_m(20.0) - 0.020).abs() < 1e-15);
        assert!((noise.sigma_m(30.0) - 0.030).abs() < 1e-15);
    }
}
