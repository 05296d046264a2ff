//! What sensors say, and the sink that takes it.
//!
//! Stamps here are the sensors' own: an [`ImuSample`] is stamped by the IMU's clock, a [`LidarScan`] by the lidar's.

mod calibration;
mod imu;
mod lidar;

pub use calibration::{Calibration, ImuNoise, LidarCorrection, LidarNoise};
pub use imu::ImuSample;
pub use lidar::{LidarReturn, LidarScan, PlanarScan};

use crate::time::Stamp;

/// One message of a recording, whichever sensor it is from.
#[derive(Debug, Clone, PartialEq)]
pub enum Measurement {
    /// From the IMU.
    Imu(ImuSample),
    /// From the lidar.
    Lidar(LidarScan),
}

/// Why a sink took nothing: the sink's own error, which the sender passes on.
pub type SinkError = Box<dyn std::error::Error + Send + Sync>;

/// Takes measurements in the order in which they arrive.
///
/// `arrival` is true time, never decreasing; the stamps within are what the sensors' clocks said.
pub trait Sink {
    /// Takes an IMU sample.
    ///
    /// # Errors
    /// When the sink cannot keep it.
    fn imu(&mut self, arrival: Stamp, sample: &ImuSample) -> Result<(), SinkError>;

    /// Takes a sample of the base's IMU, in that IMU's frame; a sink that has no use for it lets it pass.
    ///
    /// # Errors
    /// When the sink cannot keep it.
    fn base_imu(&mut self, _arrival: Stamp, _sample: &ImuSample) -> Result<(), SinkError> {
        Ok(())
    }

    /// Takes a lidar scan.
    ///
    /// # Errors
    /// When the sink cannot keep it.
    fn lidar(&mut self, arrival: Stamp, scan: &LidarScan) -> Result<(), SinkError>;
}
