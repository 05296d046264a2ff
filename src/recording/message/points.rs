//! `sensor_msgs/PointCloud2`: points with driver-specific fields.

mod fields;
mod layout;
mod time_field;

use crate::RecordingError;
use crate::message::no_returns::{NoReturnDetector, RangeLimits};
use crate::message::point_times::RawCloud;
use crate::wire::{DecodeError, Encoder, Payload};
use fields::{FLOAT32, Field, UINT32};
use layout::Cloud;
pub use time_field::TIME_NAMES;
use zsim_base::measurement::{LidarReturn, LidarScan};
use zsim_base::time::{Span, Stamp};

/// Bytes of a point written by [`encode`]: x, y, z, intensity, t.
const POINT_STEP: usize = 20;

/// Maximum number of points for which memory is reserved in advance.
const MAX_PREALLOCATED: usize = 1 << 20;

/// Encodes the returns of the lidar in `frame`.
///
/// x, y, z and intensity are 32-bit floats, t is nanoseconds after the stamp.
///
/// # Errors
/// When a stamp, a firing time or the number of points does not fit into a message.
pub fn encode(out: &mut Encoder<'_>, frame: &str, scan: &LidarScan) -> Result<(), RecordingError> {
    out.header(scan.stamp, frame)?;
    encode_layout(out, scan.returns.len(), &["x", "y", "z", "intensity"], Some("t"))?;
    for (bytes, point) in out.room(scan.returns.len() * POINT_STEP).chunks_exact_mut(POINT_STEP).zip(&scan.returns) {
        let offset = u32::try_from(point.offset.nanos()).map_err(|_| RecordingError::Unwritable {
            what: "the time of a point in its scan",
            value: format!("{} ns", point.offset.nanos()),
            limit: "the format is limited to 0 to 4.29 s",
        })?;
        let p = &point.point_in_laser;
        let words = [p.x.to_bits(), p.y.to_bits(), p.z.to_bits(), point.intensity.to_bits(), offset];
        for (word, value) in bytes.chunks_exact_mut(4).zip(words) {
            word.copy_from_slice(&value.to_le_bytes());
        }
    }
    out.byte(1);
    Ok(())
}

/// Encodes a cloud of `points`, each a row of 32-bit floats with the given `names`, in `frame`.
///
/// # Errors
/// When the stamp or the number of points does not fit into a message.
pub fn encode_floats<const N: usize>(
    out: &mut Encoder<'_>,
    frame: &str,
    stamp: Stamp,
    names: [&str; N],
    points: impl ExactSizeIterator<Item = [f32; N]>,
) -> Result<(), RecordingError> {
    out.header(stamp, frame)?;
    encode_layout(out, points.len(), &names, None)?;
    for (bytes, point) in out.room(points.len() * 4 * N).chunks_exact_mut(4 * N).zip(points) {
        for (word, value) in bytes.chunks_exact_mut(4).zip(point) {
            word.copy_from_slice(&value.to_le_bytes());
        }
    }
    out.byte(1);
    Ok(())
}

/// Encodes the part of a `PointCloud2` from `height` to the length of `data`.
///
/// Each point consists of the 32-bit `floats`, then the optional 32-bit `integer`.
fn encode_layout(
    out: &mut Encoder<'_>,
    count: usize,
    floats: &[&str],
    integer: Option<&str>,
) -> Result<(), RecordingError> {
    out.u32(1);
    out.length(count)?;
    let named = floats.iter().map(|name| (*name, FLOAT32)).chain(integer.map(|name| (name, UINT32)));
    let fields = floats.len() + usize::from(integer.is_some());
    out.length(fields)?;
    for ((name, kind), offset) in named.zip((0_u32..).step_by(4)) {
        out.string(name)?;
        out.u32(offset);
        out.byte(kind);
        out.u32(1);
    }
    let point_step = 4 * fields;
    out.byte(0);
    out.length(point_step)?;
    out.length(count * point_step)?;
    out.length(count * point_step)
}

/// Decodes a cloud's returns, with their times as written.
///
/// Points that are not finite, at the origin, or at `no_return_range_m` or farther are beams without a return. The time field
/// is that of the name number `source`; without it, the first that is not the same in all points, else the first.
///
/// # Errors
/// When the bytes are not a `PointCloud2` with x, y and z.
pub fn decode(
    message: Payload<'_>,
    source: Option<usize>,
    no_return_range_m: Option<f32>,
) -> Result<RawCloud, DecodeError> {
    let cloud = Cloud::decode(message)?;
    let mut raw = RawCloud { stamp: cloud.stamp, ..RawCloud::default() };
    if cloud.is_empty() {
        // A cloud without points may also lack fields.
        return Ok(raw);
    }
    let [x, y, z] = cloud.coordinates()?;
    let intensity =
        ["intensity", "intensities", "reflectivity", "i"].iter().find_map(|name| cloud.readable_field(name));
    let time = source.or_else(|| cloud.time_source()).and_then(|source| Some((source, cloud.time_field(source)?)));
    (raw.source, raw.is_short) = time.map_or((0, false), |(source, field)| (source, field.is_short()));
    let limits = RangeLimits::new(0.0, 0.0, no_return_range_m);
    raw.returns.reserve(cloud.count().min(MAX_PREALLOCATED));
    for bytes in cloud.points() {
        let number = |field: &Field<'_>| field.number(bytes, cloud.big_endian) as f32;
        let point_in_laser = nalgebra::Vector3::new(number(x), number(y), number(z));
        if limits.is_return(point_in_laser.norm()) {
            let intensity = intensity.map_or(0.0, number);
            raw.returns.push(LidarReturn { offset: Span::ZERO, point_in_laser, intensity });
            raw.times.extend(time.map(|(_, field)| field.number(bytes, cloud.big_endian)));
        }
    }
    Ok(raw)
}

/// Counts the encodings of beams without a return in a cloud.
///
/// # Errors
/// When the bytes are not a `PointCloud2` with x, y and z.
pub fn count_no_returns(message: Payload<'_>, detector: &mut NoReturnDetector) -> Result<(), DecodeError> {
    let cloud = Cloud::decode(message)?;
    if cloud.is_empty() {
        return Ok(());
    }
    let coordinates = cloud.coordinates()?;
    for bytes in cloud.points() {
        let [x, y, z] = coordinates.map(|field| field.number(bytes, cloud.big_endian) as f32);
        let distance_m = nalgebra::Vector3::new(x, y, z).norm();
        if distance_m.is_nan() { detector.add_invalid_point() } else { detector.add_distance(distance_m) }
    }
    Ok(())
}

/// Lists the fields of a cloud with their types, for messages.
///
/// # Errors
/// When the bytes are not a `PointCloud2`.
pub fn fields(message: Payload<'_>) -> Result<String, DecodeError> {
    Ok(Cloud::decode(message)?.field_list())
}

/// Length of a row that a cloud states and that contradicts its width, height and data, bytes.
///
/// # Errors
/// When the bytes are not a `PointCloud2`.
pub fn wrong_row_step(message: Payload<'_>) -> Result<Option<usize>, DecodeError> {
    Ok(Cloud::decode(message)?.wrong_row_step)
}
