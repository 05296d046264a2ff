//! `livox_ros_driver/CustomMsg` and `livox_ros_driver2/CustomMsg`: points in firing order.

use crate::message::no_returns::RangeLimits;
use crate::message::scan::sort_by_firing_time;
use crate::wire::{DecodeError, Decoder, Payload};
use zsim_base::measurement::{LidarReturn, LidarScan};
use zsim_base::time::Span;

/// Bytes of a point: a time, three coordinates, reflectivity, tag and line.
const POINT_BYTES: usize = 4 + 12 + 3;

/// Maximum time of a point after the message's stamp, ns: larger values are damage.
const MAX_OFFSET_NS: u32 = 2_000_000_000;

/// Decodes the returns of a scan.
///
/// Points at the origin, or at `no_return_range_m` or farther, are beams without a return. Times are nanoseconds after
/// `timebase`, which is the header's stamp on the sensor's clock.
///
/// # Errors
/// When the bytes are not a `CustomMsg`, or a point's time is more than 2 s after the stamp.
pub fn decode(message: Payload<'_>, no_return_range_m: Option<f32>) -> Result<LidarScan, DecodeError> {
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
    let mut returns = Vec::with_capacity(count);
    for _ in 0..count {
        let offset_ns = input.u32()?;
        let point_in_laser = nalgebra::Vector3::new(input.f32()?, input.f32()?, input.f32()?);
        let intensity = f32::from(input.u8()?);
        input.u8()?;
        input.u8()?;
        if offset_ns > MAX_OFFSET_NS {
            return Err(DecodeError::Contradiction("a point's offset_time is more than 2 s"));
        }
        if limits.is_return(point_in_laser.norm()) {
            returns.push(LidarReturn { offset: Span::from_nanos(i64::from(offset_ns)), point_in_laser, intensity });
        }
    }
    let stamped_after = sort_by_firing_time(&mut returns);
    Ok(LidarScan { stamp: stamp - stamped_after, stamped_after, returns, planar: None })
}
