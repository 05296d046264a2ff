//! `sensor_msgs/PointCloud2`: points with driver-specific fields.

mod fields;
mod time_unit;

use crate::RecordingError;
use crate::message::no_returns::{NoReturnDetector, RangeLimits};
use crate::message::scan::sort_by_firing_time;
use crate::wire::{DecodeError, Decoder, Encoder, Payload};
pub use fields::TimeField;
use fields::{FLOAT32, Field, UINT32};
pub use time_unit::{CloudDuration, TimeUnit};
use zsim_base::measurement::{LidarReturn, LidarScan};
use zsim_base::time::{Span, Stamp};

/// Bytes of a point written by [`encode`]: x, y, z, intensity, t.
const POINT_STEP: usize = 20;

/// Maximum number of points for which memory is reserved in advance.
const MAX_PREALLOCATED: usize = 1 << 20;

/// Maximum number of fields of a point.
const MAX_FIELDS: usize = 256;

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

/// Layout and data of a cloud.
struct Cloud<'a> {
    stamp: Stamp,
    fields: Vec<Field<'a>>,
    big_endian: bool,
    width: usize,
    point_step: usize,
    row_step: usize,
    data: &'a [u8],
}

impl<'a> Cloud<'a> {
    fn decode(message: Payload<'a>) -> Result<Self, DecodeError> {
        let mut input = Decoder::new(message)?;
        let (stamp, _) = input.header()?;
        let (height, width) = (input.u32()? as usize, input.u32()? as usize);
        let count = input.u32()? as usize;
        if count > MAX_FIELDS {
            return Err(DecodeError::Contradiction("a cloud has more than 256 fields"));
        }
        let fields = (0..count)
            .map(|_| {
                let name = input.string()?;
                let offset = input.u32()? as usize;
                let kind = input.u8()?;
                input.u32()?;
                Ok(Field { name, offset, kind })
            })
            .collect::<Result<Vec<_>, DecodeError>>()?;
        let big_endian = input.u8()? != 0;
        let (point_step, row_step) = (input.u32()? as usize, input.u32()? as usize);
        let data = input.bytes()?;
        let row = width.checked_mul(point_step).ok_or(DecodeError::Short)?;
        // Some writers omit the row length of a cloud with one row.
        let row_step = if height == 1 { row } else { row_step };
        let size = height.checked_mul(row_step).ok_or(DecodeError::Short)?;
        if size > data.len() || row > row_step {
            return Err(DecodeError::Contradiction("a cloud has less data than its width and height require"));
        }
        if fields.iter().any(|field| !field.fits(point_step)) {
            return Err(DecodeError::Contradiction("a field of a cloud exceeds the size of a point"));
        }
        Ok(Self { stamp, fields, big_endian, width, point_step, row_step, data: &data[..size] })
    }

    fn field(&self, name: &str) -> Option<&Field<'a>> {
        self.fields.iter().find(|field| field.name == name)
    }

    fn is_empty(&self) -> bool {
        self.data.is_empty() || self.width == 0
    }

    fn coordinates(&self) -> Result<[&Field<'a>; 3], DecodeError> {
        let coordinate = |name| self.field(name).ok_or(DecodeError::Contradiction("a cloud has no fields x, y and z"));
        Ok([coordinate("x")?, coordinate("y")?, coordinate("z")?])
    }

    fn points(&self) -> impl Iterator<Item = &'a [u8]> {
        let (row, step) = (self.width * self.point_step, self.point_step.max(1));
        self.data.chunks_exact(self.row_step.max(1)).flat_map(move |bytes| bytes[..row].chunks_exact(step))
    }
}

/// Decodes a cloud's returns in firing order.
///
/// Points that are not finite, at the origin, or at `no_return_range_m` or farther are beams without a return. Their
/// times after the stamp have the given `unit`; without one it is detected.
///
/// # Errors
/// When the bytes are not a `PointCloud2` with x, y and z.
pub fn decode(
    message: Payload<'_>,
    unit: Option<TimeUnit>,
    no_return_range_m: Option<f32>,
) -> Result<LidarScan, DecodeError> {
    let cloud = Cloud::decode(message)?;
    if cloud.is_empty() {
        // A cloud without points may also lack fields.
        return Ok(LidarScan { stamp: cloud.stamp, stamped_after: Span::ZERO, returns: Vec::new(), planar: None });
    }
    let [x, y, z] = cloud.coordinates()?;
    let intensity = ["intensity", "intensities", "reflectivity", "i"].iter().find_map(|name| cloud.field(name));
    let mut time = TimeField::find(&cloud.fields);
    if let Some(time) = &mut time {
        match unit {
            Some(unit) => time.set_unit(unit),
            None => time.detect_encoding(cloud.stamp, cloud.points(), cloud.big_endian),
        }
    }
    let limits = RangeLimits::new(0.0, 0.0, no_return_range_m);
    let mut returns = Vec::with_capacity((cloud.data.len() / cloud.point_step.max(1)).min(MAX_PREALLOCATED));
    for bytes in cloud.points() {
        let number = |field: &Field<'_>| field.number(bytes, cloud.big_endian) as f32;
        let point_in_laser = nalgebra::Vector3::new(number(x), number(y), number(z));
        if !limits.is_return(point_in_laser.norm()) {
            continue;
        }
        let offset = match &time {
            Some(time) => match time.offset(cloud.stamp, bytes, cloud.big_endian) {
                Some(offset) => offset,
                None => {
                    return Err(DecodeError::Contradiction(
                        "a point's time is not finite, or more than 60 s from its cloud's stamp",
                    ));
                }
            },
            None => Span::ZERO,
        };
        returns.push(LidarReturn { offset, point_in_laser, intensity: intensity.map_or(0.0, number) });
    }
    let stamped_after = sort_by_firing_time(&mut returns);
    Ok(LidarScan { stamp: cloud.stamp - stamped_after, stamped_after, returns, planar: None })
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

/// Whether a cloud has no points.
///
/// # Errors
/// When the bytes are not a `PointCloud2`, or the points have no x, y and z.
pub fn is_empty(message: Payload<'_>) -> Result<bool, DecodeError> {
    let cloud = Cloud::decode(message)?;
    if cloud.is_empty() { Ok(true) } else { cloud.coordinates().map(|_| false) }
}

/// Whether a cloud's point times are on another clock than the stamp; `None` if it has no point times.
///
/// # Errors
/// When the bytes are not a `PointCloud2`.
pub fn has_other_clock(message: Payload<'_>) -> Result<Option<bool>, DecodeError> {
    let cloud = Cloud::decode(message)?;
    Ok(TimeField::find(&cloud.fields).map(|mut time| {
        time.detect_encoding(cloud.stamp, cloud.points(), cloud.big_endian);
        time.is_other_clock()
    }))
}

/// Duration of a cloud from the point times; `None` if it has none, or they are absolute.
pub fn duration(message: Payload<'_>) -> Option<CloudDuration> {
    let cloud = Cloud::decode(message).ok()?;
    let mut time = TimeField::find(&cloud.fields)?;
    time.detect_encoding(cloud.stamp, cloud.points(), cloud.big_endian);
    let (raw_spread, usual_s) = time.spread(cloud.points(), cloud.big_endian)?;
    Some(CloudDuration { stamp: cloud.stamp, raw_spread, usual_s })
}
