//! `sensor_msgs/PointCloud2`: points with whatever fields their maker gave them.

mod fields;
mod unit;

use crate::measurement::{LidarReturn, LidarScan};
use crate::recording::RecordingError;
use crate::recording::message::misses::{Census, Limits};
use crate::recording::message::scan::from_earliest;
use crate::recording::wire::{DecodeError, Decoder, Encoder, Payload};
use crate::time::Span;
pub use fields::TimeField;
use fields::{FLOAT32, Field, UINT32};
pub use unit::{Lasting, Unit};

/// Bytes of a point as [`encode`] writes it: x, y, z, intensity, t.
const POINT_STEP: usize = 20;

/// Most points that room is made for beforehand.
const MOST_EXPECTED: usize = 1 << 20;

/// Most fields of a point that a cloud may name.
const MOST_FIELDS: usize = 256;

/// Writes the returns of the lidar in `frame`: x, y, z, intensity as 32-bit floats, t as nanoseconds after the stamp.
///
/// # Errors
/// When a stamp, an offset or the number of points does not fit a message.
pub fn encode(out: &mut Encoder<'_>, frame: &str, scan: &LidarScan) -> Result<(), RecordingError> {
    out.header(scan.stamp, frame)?;
    begin(out, scan.returns.len(), &["x", "y", "z", "intensity"], Some("t"))?;
    for (bytes, point) in out.room(scan.returns.len() * POINT_STEP).chunks_exact_mut(POINT_STEP).zip(&scan.returns) {
        let offset = u32::try_from(point.offset.nanos()).map_err(|_| RecordingError::Unwritable {
            what: "a point's time after its scan",
            value: format!("{} ns", point.offset.nanos()),
            limit: "a point holds 0 to 4.29 s",
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

/// Writes a cloud of `points`, each a row of 32-bit floats called `names`, in `frame`.
///
/// # Errors
/// When the stamp or the number of points does not fit a message.
pub fn encode_floats<const N: usize>(
    out: &mut Encoder<'_>,
    (stamp, frame): (crate::time::Stamp, &str),
    names: [&str; N],
    points: impl ExactSizeIterator<Item = [f32; N]>,
) -> Result<(), RecordingError> {
    out.header(stamp, frame)?;
    begin(out, points.len(), &names, None)?;
    for (bytes, point) in out.room(points.len() * 4 * N).chunks_exact_mut(4 * N).zip(points) {
        for (word, value) in bytes.chunks_exact_mut(4).zip(point) {
            word.copy_from_slice(&value.to_le_bytes());
        }
    }
    out.byte(1);
    Ok(())
}

/// All of a cloud from its height to the length of its data: float fields, then a field of integers where there is one.
fn begin(out: &mut Encoder<'_>, count: usize, floats: &[&str], integer: Option<&str>) -> Result<(), RecordingError> {
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

/// The layout of a cloud, and its data.
struct Cloud<'a> {
    stamp: crate::time::Stamp,
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
        if count > MOST_FIELDS {
            return Err(DecodeError::Contradiction("a cloud names more than 256 fields"));
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
        // Of a cloud in one row, some writers leave out how long the row is.
        let row_step = if height == 1 { row } else { row_step };
        let whole = height.checked_mul(row_step).ok_or(DecodeError::Short)?;
        if whole > data.len() || row > row_step {
            return Err(DecodeError::Contradiction("a cloud has less data than its width and height say"));
        }
        if fields.iter().any(|field| !field.fits(point_step)) {
            return Err(DecodeError::Contradiction("a field of a cloud lies outside its points"));
        }
        Ok(Self { stamp, fields, big_endian, width, point_step, row_step, data: &data[..whole] })
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

/// Reads a cloud's returns in the order in which they were fired; points that are not finite or lie in the origin are
/// beams that did not come back, and so are those at `farthest_m` and beyond. Their times after the stamp are counted
/// in `unit`, where another than the usual one is known.
///
/// # Errors
/// When the bytes are not a `PointCloud2` with x, y and z.
pub fn decode(message: Payload<'_>, unit: Option<Unit>, farthest_m: Option<f32>) -> Result<LidarScan, DecodeError> {
    let cloud = Cloud::decode(message)?;
    if cloud.is_empty() {
        // A cloud without points may come without fields.
        return Ok(LidarScan { stamp: cloud.stamp, stamped_after: Span::ZERO, returns: Vec::new(), planar: None });
    }
    let [x, y, z] = cloud.coordinates()?;
    let intensity = ["intensity", "intensities", "reflectivity", "i"].iter().find_map(|name| cloud.field(name));
    let mut time = TimeField::find(&cloud.fields);
    if let Some(time) = &mut time {
        match unit {
            Some(unit) => time.count_in(unit),
            None => time.learn(cloud.stamp, cloud.points(), cloud.big_endian),
        }
    }
    let limits = Limits::new(0.0, 0.0, farthest_m);
    let mut returns = Vec::with_capacity((cloud.data.len() / cloud.point_step.max(1)).min(MOST_EXPECTED));
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
                        "a point's time is not finite, or far from its cloud's stamp",
                    ));
                }
            },
            None => Span::ZERO,
        };
        returns.push(LidarReturn { offset, point_in_laser, intensity: intensity.map_or(0.0, number) });
    }
    let stamped_after = from_earliest(&mut returns);
    Ok(LidarScan { stamp: cloud.stamp - stamped_after, stamped_after, returns, planar: None })
}

/// Counts how the points of a cloud encode misses.
///
/// # Errors
/// When the bytes are not a `PointCloud2` with x, y and z.
pub fn count_misses(message: Payload<'_>, census: &mut Census) -> Result<(), DecodeError> {
    let cloud = Cloud::decode(message)?;
    if cloud.is_empty() {
        return Ok(());
    }
    let coordinates = cloud.coordinates()?;
    for bytes in cloud.points() {
        let [x, y, z] = coordinates.map(|field| field.number(bytes, cloud.big_endian) as f32);
        let distance_m = nalgebra::Vector3::new(x, y, z).norm();
        if distance_m.is_nan() { census.add_no_point() } else { census.add_distance(distance_m) }
    }
    Ok(())
}

/// Whether a cloud has no points.
///
/// # Errors
/// When the bytes are not a `PointCloud2`, or its points have no x, y and z.
pub fn is_empty(message: Payload<'_>) -> Result<bool, DecodeError> {
    let cloud = Cloud::decode(message)?;
    if cloud.is_empty() { Ok(true) } else { cloud.coordinates().map(|_| false) }
}

/// Whether a cloud's points tell their times by another clock than its stamp, `None` where they tell none.
///
/// # Errors
/// When the bytes are not a `PointCloud2`.
pub fn by_other_clock(message: Payload<'_>) -> Result<Option<bool>, DecodeError> {
    let cloud = Cloud::decode(message)?;
    Ok(TimeField::find(&cloud.fields).map(|mut time| {
        time.learn(cloud.stamp, cloud.points(), cloud.big_endian);
        time.is_of_other_clock()
    }))
}

/// How long a cloud lasts by its points' times; `None` where they carry none, or tell instants.
pub fn lasting(message: Payload<'_>) -> Option<Lasting> {
    let cloud = Cloud::decode(message).ok()?;
    let mut time = TimeField::find(&cloud.fields)?;
    time.learn(cloud.stamp, cloud.points(), cloud.big_endian);
    let (numbers, seconds) = time.spread(cloud.points(), cloud.big_endian)?;
    Some(Lasting { stamp: cloud.stamp, numbers, seconds })
}
