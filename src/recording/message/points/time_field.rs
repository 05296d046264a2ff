//! Finds the time field of a cloud by its name.

use super::fields::{Field, UINT32};

/// Names of a time field in drivers, in order of priority; their case is ignored.
pub const TIME_NAMES: [&str; 16] = [
    "t",
    "time",
    "timestamp",
    "offset_time",
    "time_stamp",
    "time_offset",
    "time_offset_ns",
    "stamps",
    "stamp",
    "times",
    "timestamps",
    "timestamp_ns",
    "time_ns",
    "relative_time",
    "t_offset",
    "ts",
];

/// Weight of the upper half of a 64-bit integer.
const UPPER_HALF: f64 = 4_294_967_296.0;

/// Endings of the names of two fields that are one time, with the weight of the first.
const PAIRS: [(&str, &str, f64); 5] = [
    ("_h", "_l", UPPER_HALF),
    ("_high", "_low", UPPER_HALF),
    ("_hi", "_lo", UPPER_HALF),
    ("_sec", "_nsec", 1e9),
    ("_s", "_ns", 1e9),
];

/// Time field of the points: one field, or two that are the parts of one number.
#[derive(Debug, Clone, Copy)]
pub struct TimeField<'a> {
    low: Field<'a>,
    /// Further part with its weight.
    high: Option<(Field<'a>, f64)>,
}

impl<'a> TimeField<'a> {
    /// Finds the field with the name number `source` of [`TIME_NAMES`].
    ///
    /// `None` if it cannot be read from points of `step` bytes.
    pub fn find(fields: &[Field<'a>], source: usize, step: usize, big_endian: bool) -> Option<Self> {
        let name = TIME_NAMES.get(source)?;
        let named = |ending: &str| {
            let is_named = |field: &&Field<'a>| {
                field
                    .name
                    .split_at_checked(name.len())
                    .is_some_and(|(start, end)| start.eq_ignore_ascii_case(name) && end.eq_ignore_ascii_case(ending))
            };
            fields.iter().find(is_named).filter(|field| field.check(step).is_ok()).copied()
        };
        if let Some(field) = named("") {
            return Some(Self::whole(field, step, big_endian));
        }
        PAIRS.into_iter().find_map(|(high, low, weight)| {
            let (high, low) = (named(high)?, named(low)?);
            (high.is_short_integer() && low.is_short_integer()).then_some(Self { low, high: Some((high, weight)) })
        })
    }

    /// Interprets a field; two 32-bit words are a 64-bit integer.
    ///
    /// Its lower half is first, except in big-endian clouds.
    fn whole(field: Field<'a>, step: usize, big_endian: bool) -> Self {
        let at = |offset: usize| Field { offset, kind: UINT32, ..field };
        let (first, second) = (at(field.offset), at(field.offset.saturating_add(4)));
        if field.count != 2 || !field.is_word() || second.check(step).is_err() {
            return Self { low: field, high: None };
        }
        let (low, high) = if big_endian { (second, first) } else { (first, second) };
        Self { low, high: Some((high, UPPER_HALF)) }
    }

    /// Value in a point.
    pub fn number(&self, point: &[u8], big_endian: bool) -> f64 {
        let high = self.high.map_or(0.0, |(field, weight)| weight * field.number(point, big_endian));
        high + self.low.number(point, big_endian)
    }

    /// Whether the values are too short for times since 1970.
    pub fn is_short(&self) -> bool {
        self.high.is_none() && self.low.is_short_integer()
    }
}
