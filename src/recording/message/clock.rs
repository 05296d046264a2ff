//! `sensor_msgs/TimeReference`: time on a sensor's clock at a true time.

use crate::RecordingError;
use crate::wire::{DecodeError, Decoder, Encoder, Payload};
use zsim_base::time::Stamp;

/// Reading of a sensor's clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClockReading<'a> {
    /// True time.
    pub now: Stamp,
    /// Time on the sensor's clock.
    pub clock_time: Stamp,
    /// Sensor of the clock: `lidar` or `imu`.
    pub source: &'a str,
}

/// Encodes a reading of the clock of the sensor in `frame`.
///
/// # Errors
/// When a stamp does not fit into a message.
pub fn encode(out: &mut Encoder<'_>, frame: &str, reading: &ClockReading<'_>) -> Result<(), RecordingError> {
    out.header(reading.now, frame)?;
    out.time(reading.clock_time)?;
    out.string(reading.source)
}

/// Decodes a reading.
///
/// # Errors
/// When the bytes are not a `TimeReference` message.
pub fn decode(message: Payload<'_>) -> Result<ClockReading<'_>, DecodeError> {
    let mut input = Decoder::new(message)?;
    let (now, _) = input.header()?;
    let clock_time = input.time()?;
    Ok(ClockReading { now, clock_time, source: input.string()? })
}
