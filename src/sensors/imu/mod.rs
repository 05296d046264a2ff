//! Inertial measurement units: what an ideal one says, and what errors make of it.

mod errors;
mod mean;
mod spec;

pub use errors::ImuErrors;
pub use mean::{MeanMotion, mean_motion};
pub use spec::{AccelSpec, GaussMarkovSpec, GyroSpec, ImuSpec};

use crate::geometry::STANDARD_GRAVITY_M_PER_S2;
use crate::measurement::ImuNoise;
use crate::spec::{Source, SpecError};
use errors::TriadModel;

/// An inertial measurement unit.
#[derive(Debug, Clone)]
pub struct Imu {
    gyro: TriadModel,
    accel: TriadModel,
    spec: ImuSpec,
}

impl Imu {
    /// The IMU that `spec`, from `source`, describes.
    ///
    /// # Errors
    /// When its rate is that of no IMU, its stamps are late or early by more than a second, or a resolution exceeds its
    /// limit.
    pub fn new(spec: &ImuSpec, source: &Source) -> Result<Self, SpecError> {
        spec.check(source)?;
        Ok(Self { gyro: spec.gyro.model(), accel: spec.accel.model(), spec: spec.clone() })
    }

    /// The spec it was built from.
    pub fn spec(&self) -> &ImuSpec {
        &self.spec
    }

    /// Time from one sample to the next, over which a sample is averaged, s.
    pub fn period_s(&self) -> f64 {
        1.0 / self.spec.rate_hz
    }

    /// How much later than the middle of its interval a sample is stamped, s on the IMU's clock.
    pub fn delay_s(&self) -> f64 {
        self.spec.stamp_delay_ms * 1e-3
    }

    /// Its noise, for an estimator.
    pub fn noise(&self) -> ImuNoise {
        ImuNoise {
            gyro_density_rad_per_s_per_sqrt_hz: self.gyro.density,
            accel_density_m_per_s2_per_sqrt_hz: self.accel.density,
            gyro_bias_walk_rad_per_s_per_sqrt_s: self.gyro.walk,
            accel_bias_walk_m_per_s2_per_sqrt_s: self.accel.walk,
            gyro_turn_on_bias_rad_per_s: self.gyro.turn_on,
            accel_turn_on_bias_m_per_s2: self.accel.turn_on,
            gyro_limit_rad_per_s: self.gyro.limit,
            accel_limit_m_per_s2: self.accel.limit,
        }
    }
}

/// Metres per second squared in a thousandth of standard gravity.
const MILLI_G: f64 = STANDARD_GRAVITY_M_PER_S2 * 1e-3;
