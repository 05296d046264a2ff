//! `sensor_msgs/Imu` messages.
//!
//! REP-145: gravity is included; `orientation_covariance[0] = -1` if orientation is not measured.

use crate::RecordingError;
use crate::wire::{DecodeError, Decoder, Encoder, Payload};
use zsim_base::measurement::{ImuNoise, ImuSample};

/// Noise variances in an IMU's messages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variances {
    /// Variance of the angular velocity on each axis, (rad/s)^2.
    pub gyro: f64,
    /// Variance of the specific force on each axis, (m/s^2)^2.
    pub accel: f64,
}

impl Variances {
    /// Variances of white noise in samples at `rate_hz`: a density `s` gives the variance `s^2 rate`.
    pub fn from_noise(noise: &ImuNoise, rate_hz: f64) -> Self {
        Self {
            gyro: noise.gyro_density_rad_per_s_per_sqrt_hz.powi(2) * rate_hz,
            accel: noise.accel_density_m_per_s2_per_sqrt_hz.powi(2) * rate_hz,
        }
    }
}

/// Unit of specific force in an IMU's messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ForceUnit {
    /// m/s^2, as `sensor_msgs/Imu` requires.
    #[default]
    MetresPerSecondSquared,
    /// Standard gravity, as some drivers publish the sensor's own unit.
    StandardGravity,
}

impl ForceUnit {
    /// Size of the unit, m/s^2.
    fn in_m_per_s2(self) -> f64 {
        match self {
            Self::MetresPerSecondSquared => 1.0,
            Self::StandardGravity => STANDARD_GRAVITY_M_PER_S2,
        }
    }
}

/// Standard gravity by definition (3rd CGPM 1901), m/s^2.
const STANDARD_GRAVITY_M_PER_S2: f64 = 9.806_65;

fn diagonal(variance: f64) -> [f64; 9] {
    let v = variance;
    [v, 0.0, 0.0, 0.0, v, 0.0, 0.0, 0.0, v]
}

/// Encodes a sample measured in `frame`.
///
/// # Errors
/// When the stamp does not fit into a message.
pub fn encode(
    out: &mut Encoder<'_>,
    frame: &str,
    sample: &ImuSample,
    variances: &Variances,
) -> Result<(), RecordingError> {
    out.header(sample.stamp, frame)?;
    out.f64s(&[0.0, 0.0, 0.0, 1.0]);
    out.f64s(&[-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    out.vector(&sample.angular_velocity_rad_per_s);
    out.f64s(&diagonal(variances.gyro));
    out.vector(&sample.specific_force_m_per_s2);
    out.f64s(&diagonal(variances.accel));
    Ok(())
}

/// Decodes a sample whose specific force has the given `unit`; the numbers may be infinite or NaN.
///
/// # Errors
/// When the bytes are not an `Imu` message.
pub fn decode(message: Payload<'_>, unit: ForceUnit) -> Result<ImuSample, DecodeError> {
    let mut input = Decoder::new(message)?;
    let (stamp, _) = input.header()?;
    input.f64s::<13>()?;
    let angular_velocity_rad_per_s = input.vector()?;
    input.f64s::<9>()?;
    let specific_force_m_per_s2 = input.vector()? * unit.in_m_per_s2();
    Ok(ImuSample { stamp, angular_velocity_rad_per_s, specific_force_m_per_s2 })
}

/// Whether all numbers of a sample are finite.
pub(crate) fn is_finite(sample: &ImuSample) -> bool {
    let numbers = sample.angular_velocity_rad_per_s.iter().chain(sample.specific_force_m_per_s2.iter());
    numbers.into_iter().all(|x| x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::geometry::Vector;
    use zsim_base::time::Stamp;

    #[test]
    fn orientation_is_marked_unmeasured_and_variances_are_per_sample() {
        let sample = ImuSample {
            stamp: Stamp::from_nanos(1),
            angular_velocity_rad_per_s: Vector::new(1.0, 2.0, 3.0),
            specific_force_m_per_s2: Vector::new(0.0, 0.0, 9.81),
        };
        let mut bytes = Vec::new();
        let variances = Variances { gyro: 2.5e-5, accel: 6.4e-5 };
        encode(&mut Encoder::new(&mut bytes), "imu_link", &sample, &variances).unwrap();
        let mut input = Decoder::new(Payload::cdr(&bytes)).unwrap();
        input.header().unwrap();
        assert_eq!(input.f64s().unwrap(), [0.0, 0.0, 0.0, 1.0]);
        assert_eq!(input.f64().unwrap(), -1.0);
        input.f64s::<11>().unwrap();
        assert_eq!(input.f64s().unwrap(), [2.5e-5, 0.0, 0.0, 0.0, 2.5e-5, 0.0, 0.0, 0.0, 2.5e-5]);
        assert_eq!(decode(Payload::cdr(&bytes), ForceUnit::default()).unwrap(), sample);
    }

    #[test]
    fn a_density_of_5e_4_at_100_hz_is_a_sigma_of_5e_3() {
        // sigma = density sqrt(rate) = 5e-4 * 10.
        let noise = ImuNoise {
            gyro_density_rad_per_s_per_sqrt_hz: 5e-4,
            accel_density_m_per_s2_per_sqrt_hz: 8e-4,
            gyro_bias_walk_rad_per_s_per_sqrt_s: 0.0,
            accel_bias_walk_m_per_s2_per_sqrt_s: 0.0,
            gyro_turn_on_bias_rad_per_s: 0.0,
            accel_turn_on_bias_m_per_s2: 0.0,
            gyro_scale_error: 0.0,
            gyro_misalignment_rad: 0.0,
            accel_scale_error: 0.0,
            accel_misalignment_rad: 0.0,
            gyro_limit_rad_per_s: 1.0,
            accel_limit_m_per_s2: 1.0,
        };
        let variances = Variances::from_noise(&noise, 100.0);
        assert!((variances.gyro.sqrt() - 5e-3).abs() < 1e-15 && (variances.accel.sqrt() - 8e-3).abs() < 1e-15);
    }
}
