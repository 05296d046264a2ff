//! `livox_ros_driver/CustomMsg` and `livox_ros_driver2/CustomMsg`: points in firing order.

use crate::message::no_returns::RangeLimits;
use crate::message::point_times::RawCloud;
use crate::wire::{DecodeError, Decoder, Payload};
use zsim_base::measurement::LidarReturn;
use zsim_base::time::Span;

/// Bytes of a point: a time, three coordinates, reflectivity, tag and line.
const POINT_BYTES: usize = 4 + 12 + 3;

/// Decodes the returns of a scan.
///
/// Points at the origin, or at `no_return_range_m` or farther, are beams without a return. Times are nanoseconds after
/// `timebase`, which is the header's stamp on the sensor's clock.
///
/// # Errors
/// When the bytes are not a `CustomMsg`.
pub fn decode(message: Payload<'_>, no_return_range_m: Option<f32>) -> Result<RawCloud, DecodeError> {
    let mut input = Decoder::new(message)?;
    let (stamp, _) = input.header()?;
    input.u64()?;
    input.u32()?;
    for _ in 0..4 {
        input.u8()?;
    }
    let count = input.u32()? as usize;
    if count > message.bytes.len() / POINT_BYTES {
        return Err(DecodeError::Short);
    }
    let limits = RangeLimits::new(0.0, 0.0, no_return_range_m);
    let mut raw = RawCloud { stamp, is_short: true, ..RawCloud::default() };
    raw.returns.reserve(count);
    for _ in 0..count {
        let time = f64::from(input.u32()?);
        let point_in_laser = nalgebra::Vector3::new(input.f32()?, input.f32()?, input.f32()?);
        let intensity = f32::from(input.u8()?);
        input.u8()?;
        input.u8()?;
        if limits.is_return(point_in_laser.norm()) {
            raw.returns.push(LidarReturn { offset: Span::ZERO, point_in_laser, intensity });
            raw.times.push(time);
        }
    }
    Ok(raw)
}
