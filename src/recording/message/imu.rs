//! `sensor_msgs/Imu` (REP-145: gravity included, `orientation_covariance[0] = -1` where orientation is not measured).

use crate::measurement::{ImuNoise, ImuSample};
use crate::recording::RecordingError;
use crate::recording::cdr::{DecodeError, Decoder, Encoder};

/// Variances that an IMU's messages state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variances {
    /// Of the angular velocity on each axis, (rad/s)^2.
    pub gyro: f64,
    /// Of the specific force on each axis, (m/s^2)^2.
    pub accel: f64,
}

impl Variances {
    /// The white noise of a sample at `rate_hz`: a density `s` gives the variance `s^2 rate`.
    pub fn of(noise: &ImuNoise, rate_hz: f64) -> Self {
        Self {
            gyro: noise.gyro_density_rad_per_s_per_sqrt_hz.powi(2) * rate_hz,
            accel: noise.accel_density_m_per_s2_per_sqrt_hz.powi(2) * rate_hz,
        }
    }
}

fn diagonal(variance: f64) -> [f64; 9] {
    let v = variance;
    [v, 0.0, 0.0, 0.0, v, 0.0, 0.0, 0.0, v]
}

/// Writes a sample measured in `frame`.
///
/// # Errors
/// When the stamp does not fit a message.
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

/// Reads a sample, whatever its numbers are.
///
/// # Errors
/// When the bytes are not an `Imu` message.
pub fn decode(message: &[u8]) -> Result<ImuSample, DecodeError> {
    let mut input = Decoder::new(message)?;
    let (stamp, _) = input.header()?;
    input.f64s::<13>()?;
    let angular_velocity_rad_per_s = input.vector()?;
    input.f64s::<9>()?;
    let specific_force_m_per_s2 = input.vector()?;
    Ok(ImuSample { stamp, angular_velocity_rad_per_s, specific_force_m_per_s2 })
}
