//! Inertial measurement units: the ideal sample, and the errors.

mod errors;
mod filter;
mod ideal;
mod sampler;
mod spec;
mod triad_model;

pub use errors::ImuErrors;
pub use ideal::{InertialReading, coning_corrected, ideal_reading};
pub use sampler::ImuSampler;
pub use spec::{AccelSpec, GaussMarkovSpec, GyroSpec, ImuSpec, OutputFilterSpec, WarmUpSpec};

use triad_model::TriadModel;
use zsim_base::measurement::{ImuAveraging, ImuNoise};
use zsim_base::spec::{Kind, NamedSpec, Source, SpecError, parse_named};

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
    /// If the rate is out of range, stamps are late or early by more than 1 s, a resolution exceeds the limit, or the output
    /// filter or the warm-up is inconsistent with other keys.
    pub fn new(spec: &ImuSpec, source: &Source) -> Result<Self, SpecError> {
        spec.check(source)?;
        let (gyro, accel) = spec.triads();
        Ok(Self { gyro, accel, spec: spec.clone() })
    }

    /// The spec from which it was built.
    pub fn spec(&self) -> &ImuSpec {
        &self.spec
    }

    /// Sample period, s.
    pub fn period_s(&self) -> f64 {
        1.0 / self.spec.rate_hz
    }

    /// Delay of the stamp after the middle of the sample's interval, s on the IMU clock.
    pub fn stamp_delay_s(&self) -> f64 {
        self.spec.stamp_delay_ms * 1e-3
    }

    /// Delay of the stamp after the time that the sample describes, s on the IMU clock.
    ///
    /// Without an output filter that is the middle of the interval. With one it is the time of a slow signal that has the
    /// value of the sample.
    pub fn delay_s(&self) -> f64 {
        let filter = self.spec.output_filter.as_ref();
        let of_filter = filter.map_or(0.0, |spec| {
            let step_s = self.step_s();
            (0.5 + filter::delay_steps(spec, step_s)) * step_s - 0.5 * self.period_s()
        });
        self.stamp_delay_s() + of_filter
    }

    /// Interval of the readings inside: the step of the output filter, or the sample period, s.
    pub fn step_s(&self) -> f64 {
        let filter = self.spec.output_filter.as_ref();
        let steps = filter.map_or(1, |spec| filter::steps_per_sample(spec, self.spec.rate_hz));
        self.period_s() / steps as f64
    }

    /// How a sample is derived from the motion during its interval.
    pub fn averaging(&self) -> ImuAveraging {
        self.spec.averaging
    }

    /// Noise model for an estimator; its bias walks include the other changes of the biases during a run.
    pub fn noise(&self) -> ImuNoise {
        ImuNoise {
            gyro_density_rad_per_s_per_sqrt_hz: self.gyro.density,
            accel_density_m_per_s2_per_sqrt_hz: self.accel.density,
            gyro_bias_walk_rad_per_s_per_sqrt_s: self.gyro.expected_walk(),
            accel_bias_walk_m_per_s2_per_sqrt_s: self.accel.expected_walk(),
            gyro_turn_on_bias_rad_per_s: self.gyro.turn_on,
            accel_turn_on_bias_m_per_s2: self.accel.turn_on,
            gyro_scale_error: self.gyro.scale,
            gyro_misalignment_rad: self.gyro.misalignment,
            accel_scale_error: self.accel.scale,
            accel_misalignment_rad: self.accel.misalignment,
            gyro_limit_rad_per_s: self.gyro.limit,
            accel_limit_m_per_s2: self.accel.limit,
        }
    }
}

impl NamedSpec for ImuSpec {
    const KIND: Kind = Kind::Imu;
    type Error = SpecError;

    fn parse(source: &Source) -> Result<Self, SpecError> {
        parse_named(source)
    }

    fn check_model(&self, source: &Source) -> Result<Vec<String>, SpecError> {
        Imu::new(self, source).map(|_| Vec::new())
    }
}
