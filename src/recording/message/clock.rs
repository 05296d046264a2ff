//! `sensor_msgs/TimeReference`: what a sensor's clock said at a true time.

use crate::recording::RecordingError;
use crate::recording::wire::{DecodeError, Decoder, Encoder, Payload};
use crate::time::Stamp;

/// A sensor's clock beside true time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reading<'a> {
    /// True time.
    pub now: Stamp,
    /// What the clock says.
    pub says: Stamp,
    /// Whose clock: `lidar` or `imu`.
    pub source: &'a str,
}

/// Writes a reading of the clock of the sensor in `frame`.
///
/// # Errors
/// When a stamp does not fit a message.
pub fn encode(out: &mut Encoder<'_>, frame: &str, reading: &Reading<'_>) -> Result<(), RecordingError> {
    out.header(reading.now, frame)?;
    out.time(reading.says)?;
    out.string(reading.source)
}

/// Reads a reading.
///
/// # Errors
/// When the bytes are not a `TimeReference` message.
pub fn decode(message: Payload<'_>) -> Result<Reading<'_>, DecodeError> {
    let mut input = Decoder::new(message)?;
    let (now, _) = input.header()?;
    let says = input.time()?;
    Ok(Reading { now, says, source: input.string()? })
}
