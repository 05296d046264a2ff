use crate::geometry::{Pose, Rotation, Vector};
use serde::{Deserialize, Serialize};

/// How the sensors sit in the head, and how well they measure.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// Pose of the lidar in the head.
    pub head_from_laser: Pose,
    /// Pose of the IMU in the head.
    pub head_from_imu: Pose,
    /// The IMU's noise.
    pub imu: ImuNoise,
    /// The lidar's noise.
    pub lidar: LidarNoise,
}

/// By how much a lidar is not what its calibration says, along the IMU's axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LidarCorrection {
    /// To be added to every range, m.
    pub range_m: f64,
    /// Turn of the lidar about its own place.
    pub turn: Rotation,
    /// Shift of its place, m.
    pub shift: Vector,
}

impl Default for LidarCorrection {
    fn default() -> Self {
        Self { range_m: 0.0, turn: Rotation::identity(), shift: Vector::zeros() }
    }
}

impl LidarCorrection {
    /// The way from the lidar to a point, m, which its calibration takes for `reach`.
    pub fn reach(&self, reach: &Vector) -> Vector {
        self.turn * (reach * (1.0 + self.range_m / reach.norm()))
    }

    /// What the calibration takes for the way to a point that is `reach` from the lidar, m: the inverse of
    /// [`Self::reach`].
    pub fn calibrated(&self, reach: &Vector) -> Vector {
        self.turn.inverse() * (reach * (1.0 - self.range_m / reach.norm()))
    }
}

impl Calibration {
    /// Pose of the lidar in the head, corrected.
    pub fn head_from_corrected_laser(&self, correction: &LidarCorrection) -> Pose {
        let mut imu_from_laser = self.head_from_imu.inverse() * self.head_from_laser;
        imu_from_laser.rotation = correction.turn * imu_from_laser.rotation;
        imu_from_laser.translation.vector += correction.shift;
        self.head_from_imu * imu_from_laser
    }
}

/// Noise of an IMU as Kalibr writes it: densities of white noise, and of the walks of the biases.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImuNoise {
    /// White noise of the gyroscope, rad/s/sqrt(Hz).
    pub gyro_density_rad_per_s_per_sqrt_hz: f64,
    /// White noise of the accelerometer, m/s^2/sqrt(Hz).
    pub accel_density_m_per_s2_per_sqrt_hz: f64,
    /// Walk of the gyroscope's bias, rad/s/sqrt(s).
    pub gyro_bias_walk_rad_per_s_per_sqrt_s: f64,
    /// Walk of the accelerometer's bias, m/s^2/sqrt(s).
    pub accel_bias_walk_m_per_s2_per_sqrt_s: f64,
    /// Standard deviation of the gyroscope's bias when switched on, rad/s.
    pub gyro_turn_on_bias_rad_per_s: f64,
    /// Standard deviation of the accelerometer's bias when switched on, m/s^2.
    pub accel_turn_on_bias_m_per_s2: f64,
    /// Greatest angular velocity on an axis that the gyroscope reports, rad/s.
    pub gyro_limit_rad_per_s: f64,
    /// Greatest specific force on an axis that the accelerometer reports, m/s^2.
    pub accel_limit_m_per_s2: f64,
}

/// Noise of a lidar's range.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LidarNoise {
    /// Standard deviation of a range up to `near_m`, m.
    pub near_sigma_m: f64,
    /// Up to where `near_sigma_m` holds, m.
    pub near_m: f64,
    /// Standard deviation at `far_m`, to which it rises linearly, m.
    pub far_sigma_m: f64,
    /// Where `far_sigma_m` holds, m.
    pub far_m: f64,
}

impl LidarNoise {
    /// Standard deviation of a range of `range_m`, m: constant, then linear, never less than `near_sigma_m`.
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
