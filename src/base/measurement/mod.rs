//! Sensor measurements, and the sink that receives them.
//!
//! Stamps are from the sensors' own clocks: an [`ImuSample`] has IMU time, a [`LidarScan`] lidar time.

mod calibration;
mod force_unit;
mod imu;
mod lidar;

pub use calibration::{Calibration, ImuNoise, LidarCorrection, LidarNoise};
pub use force_unit::{ForceUnitCheck, ONE_G_RANGE};
pub use imu::{ImuAveraging, ImuSample};
pub use lidar::{LidarReturn, LidarScan, PlanarScan};

use crate::time::Stamp;

/// One message of a recording, from either sensor.
#[derive(Debug, Clone, PartialEq)]
pub enum Measurement {
    /// From the IMU.
    Imu(ImuSample),
    /// From the lidar.
    Lidar(LidarScan),
}

/// Error of a sink, which the sender passes on.
pub type SinkError = Box<dyn std::error::Error + Send + Sync>;

/// Receives measurements in order of arrival.
///
/// `arrival` is true time and never decreases; the stamps inside the measurements are from the sensors' clocks.
pub trait Sink {
    /// Receives an IMU sample.
    ///
    /// # Errors
    /// When the sink cannot store it.
    fn imu(&mut self, arrival: Stamp, sample: &ImuSample) -> Result<(), SinkError>;

    /// Receives a sample of the base's IMU, in the frame of that IMU.
    ///
    /// The default implementation ignores it.
    ///
    /// # Errors
    /// When the sink cannot store it.
    fn base_imu(&mut self, _arrival: Stamp, _sample: &ImuSample) -> Result<(), SinkError> {
        Ok(())
    }

    /// Receives a lidar scan.
    ///
    /// # Errors
    /// When the sink cannot store it.
    fn lidar(&mut self, arrival: Stamp, scan: &LidarScan) -> Result<(), SinkError>;
}
