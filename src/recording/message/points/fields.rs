//! Fields of a point, and the encoding of the time field.

use super::time_unit::TimeUnit;
use zsim_base::time::{NANOS_PER_SECOND, Span, Stamp};

/// `PointField.UINT32`.
pub const UINT32: u8 = 6;
/// `PointField.FLOAT32`.
pub const FLOAT32: u8 = 7;
/// `PointField.FLOAT64`.
const FLOAT64: u8 = 8;

/// Names of the time field in drivers, in order of priority.
const TIME_NAMES: [&str; 7] = ["t", "time", "timestamp", "offset_time", "time_stamp", "time_offset", "time_offset_ns"];

/// Absolute times that differ by more than this from their cloud's stamp are on another clock, s.
const MAX_CLOCK_DIFFERENCE_S: f64 = 1.0;

/// Maximum duration of a cloud with times of another clock, s.
const MAX_CLOUD_S: f64 = 1.5;

/// Minimum ratio of the time on another clock to the duration of the cloud.
const MIN_UPTIME_RATIO: f64 = 20.0;

/// Maximum time between a point and its cloud's stamp, s: larger values are not a point's time.
const MAX_OFFSET_S: f64 = 60.0;

/// Tolerance between a cloud's stamp and the nearest point, s, for clouds of short duration.
const TOLERANCE_S: f64 = 1e-3;

/// Maximum relative time that is interpreted as seconds; a lidar frame is shorter.
const MAX_RELATIVE_S: f64 = 10.0;

/// Numeric field of each point.
#[derive(Debug, Clone, Copy)]
pub struct Field<'a> {
    /// Field name.
    pub name: &'a str,
    /// Offset in the point, bytes.
    pub offset: usize,
    /// Data type, in the codes of `PointField`.
    pub kind: u8,
}

impl Field<'_> {
    fn size(&self) -> usize {
        match self.kind {
            1 | 2 => 1,
            3 | 4 => 2,
            FLOAT64 => 8,
            _ => 4,
        }
    }

    /// Whether the type is known and it fits into a point of `step` bytes.
    pub fn fits(&self, step: usize) -> bool {
        (1..=8).contains(&self.kind) && self.offset.checked_add(self.size()).is_some_and(|end| end <= step)
    }

    /// Value in a point, as a 64-bit float.
    pub fn number(&self, point: &[u8], big_endian: bool) -> f64 {
        let bytes = &point[self.offset..];
        match self.kind {
            1 => f64::from(bytes[0].cast_signed()),
            2 => f64::from(bytes[0]),
            3 => f64::from(u16::from_le_bytes(little_endian(bytes, big_endian)).cast_signed()),
            4 => f64::from(u16::from_le_bytes(little_endian(bytes, big_endian))),
            5 => f64::from(u32::from_le_bytes(little_endian(bytes, big_endian)).cast_signed()),
            UINT32 => f64::from(u32::from_le_bytes(little_endian(bytes, big_endian))),
            FLOAT32 => f64::from(f32::from_le_bytes(little_endian(bytes, big_endian))),
            _ => f64::from_le_bytes(little_endian(bytes, big_endian)),
        }
    }
}

/// The first `N` bytes in little-endian order. The caller has checked that the field fits.
fn little_endian<const N: usize>(bytes: &[u8], big_endian: bool) -> [u8; N] {
    let mut word = [0; N];
    word.copy_from_slice(&bytes[..N]);
    if big_endian {
        word.reverse();
    }
    word
}

/// Encoding of a time field.
#[derive(Debug, Clone, Copy, PartialEq)]
enum TimeEncoding {
    /// Time after the cloud's stamp.
    AfterStamp(TimeUnit),
    /// Absolute time, in this fraction of a second (1e9: nanoseconds).
    Absolute(f64),
    /// Absolute time of another clock than the stamp's; converted to the time after the cloud's first point.
    OtherClock {
        /// Units per second.
        per_second: f64,
        /// Earliest value in the cloud.
        first: f64,
    },
}

/// Time field of the points and the encoding.
pub struct TimeField<'a> {
    field: Field<'a>,
    encoding: TimeEncoding,
}

impl<'a> TimeField<'a> {
    /// Finds the time field among `fields`.
    pub fn find(fields: &[Field<'a>]) -> Option<Self> {
        let field = TIME_NAMES.iter().find_map(|name| fields.iter().find(|field| field.name == *name))?;
        Some(Self { field: *field, encoding: TimeEncoding::AfterStamp(TimeUnit::NANOSECOND) })
    }

    /// Detects the encoding from the values of a cloud.
    ///
    /// Integers are nanoseconds after the stamp. For floats the first rule that applies is used: absolute times (s, us
    /// or ns) if they are as near to the stamp as to each other, and not as near to zero; seconds after the stamp if
    /// they are at most 10, since a frame is shorter; absolute times if they are within 1 s of the stamp; absolute
    /// times of another clock if their spread is much smaller than their value; else nanoseconds after the stamp.
    pub fn detect_encoding<'p>(&mut self, stamp: Stamp, points: impl Iterator<Item = &'p [u8]>, big_endian: bool) {
        if self.field.kind < FLOAT32 {
            return;
        }
        let (min, max) = self.range(points, big_endian);
        let stamp_s = stamp.nanos() as f64 / NANOS_PER_SECOND as f64;
        // Whether all values are within `reach_s` of `centre_s`, at `per_second` units per second.
        let within = |centre_s: f64, per_second: f64, reach_s: f64| {
            min / per_second >= centre_s - reach_s && max / per_second <= centre_s + reach_s
        };
        let spread = |per_second: f64| (max - min) / per_second + TOLERANCE_S;
        let absolute = |reach: &dyn Fn(f64) -> f64| {
            [1.0, 1e6, 1e9]
                .into_iter()
                .find(|per_second| within(stamp_s, *per_second, reach(*per_second)))
                .map(TimeEncoding::Absolute)
        };
        let tight = if within(0.0, 1.0, spread(1.0)) { None } else { absolute(&spread) };
        let seconds =
            (min >= -MAX_RELATIVE_S && max <= MAX_RELATIVE_S).then_some(TimeEncoding::AfterStamp(TimeUnit::SECOND));
        let loose = || absolute(&|_| MAX_CLOCK_DIFFERENCE_S);
        let other_clock = || Self::detect_other_clock(min, max);
        let found = tight.or(seconds).or_else(loose).or_else(other_clock);
        self.encoding = found.unwrap_or(TimeEncoding::AfterStamp(TimeUnit::NANOSECOND));
    }

    fn detect_other_clock(min: f64, max: f64) -> Option<TimeEncoding> {
        let is_cloud = |per_second: &f64| (max - min) / per_second <= MAX_CLOUD_S;
        let per_second = [1.0, 1e3, 1e6, 1e9].into_iter().find(is_cloud)?;
        (min > MIN_UPTIME_RATIO * (max - min)).then_some(TimeEncoding::OtherClock { per_second, first: min })
    }

    /// Whether the point times are absolute times of another clock than the stamp's.
    pub fn is_other_clock(&self) -> bool {
        matches!(self.encoding, TimeEncoding::OtherClock { .. })
    }

    /// Interprets the values as times after the stamp in the given unit.
    pub fn set_unit(&mut self, unit: TimeUnit) {
        self.encoding = TimeEncoding::AfterStamp(unit);
    }

    /// Spread of a cloud's values, and the same in seconds; `None` if they are absolute times, or there are none.
    pub fn spread<'p>(&self, points: impl Iterator<Item = &'p [u8]>, big_endian: bool) -> Option<(f64, f64)> {
        let TimeEncoding::AfterStamp(unit) = self.encoding else { return None };
        let (min, max) = self.range(points, big_endian);
        Some((max - min, (max - min) / unit.per_second())).filter(|spread| spread.0.is_finite())
    }

    fn range<'p>(&self, points: impl Iterator<Item = &'p [u8]>, big_endian: bool) -> (f64, f64) {
        let numbers = points.map(|point| self.field.number(point, big_endian)).filter(|x| x.is_finite());
        numbers.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)))
    }

    /// Time of a point after the stamp; `None` if it is not finite or too far from the stamp.
    pub fn offset(&self, stamp: Stamp, point: &[u8], big_endian: bool) -> Option<Span> {
        let number = self.field.number(point, big_endian);
        let offset = match self.encoding {
            TimeEncoding::AfterStamp(TimeUnit::NANOSECOND) => Span::from_nanos(number.round() as i64),
            TimeEncoding::AfterStamp(unit) => Span::from_seconds(number / unit.per_second()),
            // Whole and fractional seconds separately: nanoseconds since 1970 exceed the 53 bits of a double.
            TimeEncoding::Absolute(per_second) => {
                let whole = (number / per_second).floor();
                let part = (number - whole * per_second) / per_second;
                let absolute =
                    Stamp::from_nanos((whole as i64).saturating_mul(NANOS_PER_SECOND)) + Span::from_seconds(part);
                absolute - stamp
            }
            TimeEncoding::OtherClock { per_second, first } => Span::from_seconds((number - first) / per_second),
        };
        (number.is_finite() && offset.seconds().abs() <= MAX_OFFSET_S).then_some(offset)
    }
}
