//! What a point's fields are, and how its time is told.

use super::unit::Unit;
use crate::time::{NANOS_PER_SECOND, Span, Stamp};

/// `PointField.UINT32`.
pub const UINT32: u8 = 6;
/// `PointField.FLOAT32`.
pub const FLOAT32: u8 = 7;
/// `PointField.FLOAT64`.
const FLOAT64: u8 = 8;

/// Names under which makers keep a point's time, the first one that is there is taken.
const TIME_NAMES: [&str; 7] = ["t", "time", "timestamp", "offset_time", "time_stamp", "time_offset", "time_offset_ns"];

/// Instants that are farther than this from their cloud's stamp are of another clock.
const SAME_CLOCK_S: f64 = 1.0;

/// A cloud of another clock's instants lasts at most this, s.
const LONGEST_CLOUD_S: f64 = 1.5;

/// And it lasts so many times less than that clock has run.
const FAR_FROM_ZERO: f64 = 20.0;

/// Longest time from a cloud's stamp to a point of it: beyond, the time is not what its field's name says.
const LONGEST_S: f64 = 60.0;

/// How far from a cloud's stamp the nearest of its points may be told, when points lie close together.
const SLACK_S: f64 = 1e-3;

/// Greatest relative time that is taken for seconds; a frame of a lidar is shorter.
const MOST_SECONDS: f64 = 10.0;

/// A number within each point.
#[derive(Debug, Clone, Copy)]
pub struct Field<'a> {
    /// Its name.
    pub name: &'a str,
    /// Where it begins, bytes into the point.
    pub offset: usize,
    /// Its type, as `PointField` counts them.
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

    /// Whether it is of a known type and lies within a point of `step` bytes.
    pub fn fits(&self, step: usize) -> bool {
        (1..=8).contains(&self.kind) && self.offset.checked_add(self.size()).is_some_and(|end| end <= step)
    }

    /// Its value in a point, exact for every type but the largest doubles' use.
    pub fn number(&self, point: &[u8], big_endian: bool) -> f64 {
        let bytes = &point[self.offset..];
        match self.kind {
            1 => f64::from(bytes[0].cast_signed()),
            2 => f64::from(bytes[0]),
            3 => f64::from(u16::from_le_bytes(ordered(bytes, big_endian)).cast_signed()),
            4 => f64::from(u16::from_le_bytes(ordered(bytes, big_endian))),
            5 => f64::from(u32::from_le_bytes(ordered(bytes, big_endian)).cast_signed()),
            UINT32 => f64::from(u32::from_le_bytes(ordered(bytes, big_endian))),
            FLOAT32 => f64::from(f32::from_le_bytes(ordered(bytes, big_endian))),
            _ => f64::from_le_bytes(ordered(bytes, big_endian)),
        }
    }
}

/// The first `N` bytes, least significant first. Fields are checked to fit before a point is read.
fn ordered<const N: usize>(bytes: &[u8], big_endian: bool) -> [u8; N] {
    let mut word = [0; N];
    word.copy_from_slice(&bytes[..N]);
    if big_endian {
        word.reverse();
    }
    word
}

/// What a field's number means.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Meaning {
    /// Time after the cloud's stamp.
    AfterStamp(Unit),
    /// An instant, counted in this many parts of a second.
    Instant(f64),
    /// An instant of another clock than the stamp's, after the cloud's first one.
    OfOtherClock {
        /// Counted in this many parts of a second.
        parts: f64,
        /// The first one.
        first: f64,
    },
}

/// The field that tells a point's time, and how to read it.
pub struct TimeField<'a> {
    field: Field<'a>,
    meaning: Meaning,
}

impl<'a> TimeField<'a> {
    /// The time field among `fields`.
    pub fn find(fields: &[Field<'a>]) -> Option<Self> {
        let field = TIME_NAMES.iter().find_map(|name| fields.iter().find(|field| field.name == *name))?;
        Some(Self { field: *field, meaning: Meaning::AfterStamp(Unit::NANOSECOND) })
    }

    /// Learns from a cloud's numbers what they mean. Integers are nanoseconds after the stamp. Floats are instants
    /// where they lie as near the stamp as they lie to each other (in seconds, microseconds or nanoseconds), and not as
    /// near to zero; else seconds after the stamp while they are at most 10, as a frame is shorter; else instants where
    /// they lie near the stamp at all; else instants of another clock where they lie far closer to each other than to
    /// zero; else nanoseconds after it.
    pub fn learn<'p>(&mut self, stamp: Stamp, points: impl Iterator<Item = &'p [u8]>, big_endian: bool) {
        if self.field.kind < FLOAT32 {
            return;
        }
        let (least, most) = self.range(points, big_endian);
        let stamp_s = stamp.nanos() as f64 / NANOS_PER_SECOND as f64;
        // Whether all lie within `reach_s` of `centre_s`, counted in `parts` of a second.
        let within = |centre_s: f64, parts: f64, reach_s: f64| {
            least / parts >= centre_s - reach_s && most / parts <= centre_s + reach_s
        };
        let spread = |parts: f64| (most - least) / parts + SLACK_S;
        let instant = |reach: &dyn Fn(f64) -> f64| {
            [1.0, 1e6, 1e9].into_iter().find(|parts| within(stamp_s, *parts, reach(*parts))).map(Meaning::Instant)
        };
        let tight = if within(0.0, 1.0, spread(1.0)) { None } else { instant(&spread) };
        let seconds = (least >= -MOST_SECONDS && most <= MOST_SECONDS).then_some(Meaning::AfterStamp(Unit::SECOND));
        let loose = || instant(&|_| SAME_CLOCK_S);
        let other_clock = || Self::of_other_clock(least, most);
        let found = tight.or(seconds).or_else(loose).or_else(other_clock);
        self.meaning = found.unwrap_or(Meaning::AfterStamp(Unit::NANOSECOND));
    }

    fn of_other_clock(least: f64, most: f64) -> Option<Meaning> {
        let is_cloud = |parts: &f64| (most - least) / parts <= LONGEST_CLOUD_S;
        let parts = [1.0, 1e3, 1e6, 1e9].into_iter().find(is_cloud)?;
        (least > FAR_FROM_ZERO * (most - least)).then_some(Meaning::OfOtherClock { parts, first: least })
    }

    /// Whether points tell instants of another clock than the stamp's.
    pub fn is_of_other_clock(&self) -> bool {
        matches!(self.meaning, Meaning::OfOtherClock { .. })
    }

    /// Takes a point's number for so much time after the stamp.
    pub fn count_in(&mut self, unit: Unit) {
        self.meaning = Meaning::AfterStamp(unit);
    }

    /// From the least of a cloud's numbers to the greatest, and the same in seconds; `None` where they are instants, or
    /// there are none.
    pub fn spread<'p>(&self, points: impl Iterator<Item = &'p [u8]>, big_endian: bool) -> Option<(f64, f64)> {
        let Meaning::AfterStamp(unit) = self.meaning else { return None };
        let (least, most) = self.range(points, big_endian);
        Some((most - least, (most - least) / unit.in_a_second())).filter(|spread| spread.0.is_finite())
    }

    fn range<'p>(&self, points: impl Iterator<Item = &'p [u8]>, big_endian: bool) -> (f64, f64) {
        let numbers = points.map(|point| self.field.number(point, big_endian)).filter(|x| x.is_finite());
        numbers.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)))
    }

    /// A point's time after the stamp; `None` where it is not finite or too far from it.
    pub fn offset(&self, stamp: Stamp, point: &[u8], big_endian: bool) -> Option<Span> {
        let number = self.field.number(point, big_endian);
        let offset = match self.meaning {
            Meaning::AfterStamp(Unit::NANOSECOND) => Span::from_nanos(number.round() as i64),
            Meaning::AfterStamp(unit) => Span::from_seconds(number / unit.in_a_second()),
            // Whole and fractional seconds apart: their product in nanoseconds is beyond a double's 53 bits.
            Meaning::Instant(parts) => {
                let whole = (number / parts).floor();
                let part = (number - whole * parts) / parts;
                let instant =
                    Stamp::from_nanos((whole as i64).saturating_mul(NANOS_PER_SECOND)) + Span::from_seconds(part);
                instant - stamp
            }
            Meaning::OfOtherClock { parts, first } => Span::from_seconds((number - first) / parts),
        };
        (number.is_finite() && offset.seconds().abs() <= LONGEST_S).then_some(offset)
    }
}
