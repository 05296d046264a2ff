//! Time as integer nanoseconds.
//!
//! A stamp is an `i64` count of nanoseconds on a clock; the documentation of each stamp names the clock. Seconds as
//! `f64` are used only for differences of two stamps in formulas, where a resolution of 1 ns is not needed.

use serde::{Deserialize, Serialize};
use std::ops::{Add, AddAssign, Sub};

/// Nanoseconds in a second.
pub const NANOS_PER_SECOND: i64 = 1_000_000_000;

/// A time in nanoseconds on the clock of the writer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Stamp(i64);

/// A signed duration in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Span(i64);

impl Stamp {
    /// The time `nanos` after the zero of the clock.
    pub const fn from_nanos(nanos: i64) -> Self {
        Self(nanos)
    }

    /// Nanoseconds since the zero of the clock.
    pub const fn nanos(self) -> i64 {
        self.0
    }

    /// Seconds since `origin`; exact to 1 ns for durations below 100 days.
    pub fn seconds_since(self, origin: Stamp) -> f64 {
        (self - origin).seconds()
    }

    /// The stamp rounded down to a multiple of `step`, the resolution of a clock.
    ///
    /// A step of zero or below returns the stamp unchanged.
    pub const fn floor_to(self, step: Span) -> Self {
        if step.0 <= 0 { self } else { Self(self.0.div_euclid(step.0) * step.0) }
    }
}

impl Span {
    /// Zero duration.
    pub const ZERO: Span = Span(0);

    /// A duration of `nanos` nanoseconds.
    pub const fn from_nanos(nanos: i64) -> Self {
        Self(nanos)
    }

    /// The duration nearest to `seconds`; saturates at the limits of `i64`, and is zero for NaN.
    pub fn from_seconds(seconds: f64) -> Self {
        Self((seconds * NANOS_PER_SECOND as f64).round() as i64)
    }

    /// One period of `rate_hz`, to the nearest nanosecond.
    pub fn period_of(rate_hz: f64) -> Self {
        Self::from_seconds(1.0 / rate_hz)
    }

    /// Nanoseconds.
    pub const fn nanos(self) -> i64 {
        self.0
    }

    /// Seconds.
    pub fn seconds(self) -> f64 {
        self.0 as f64 / NANOS_PER_SECOND as f64
    }
}

impl Add<Span> for Stamp {
    type Output = Stamp;
    fn add(self, span: Span) -> Stamp {
        Stamp(self.0.saturating_add(span.0))
    }
}

impl AddAssign<Span> for Stamp {
    fn add_assign(&mut self, span: Span) {
        *self = *self + span;
    }
}

impl Sub<Span> for Stamp {
    type Output = Stamp;
    fn sub(self, span: Span) -> Stamp {
        Stamp(self.0.saturating_sub(span.0))
    }
}

impl Sub for Stamp {
    type Output = Span;
    fn sub(self, other: Stamp) -> Span {
        Span(self.0.saturating_sub(other.0))
    }
}

impl Add for Span {
    type Output = Span;
    fn add(self, other: Span) -> Span {
        Span(self.0.saturating_add(other.0))
    }
}

impl Sub for Span {
    type Output = Span;
    fn sub(self, other: Span) -> Span {
        Span(self.0.saturating_sub(other.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sum_of_beam_times_loses_no_nanosecond() {
        // 1440 slots of 25 ms / 1440 are one turn: 17361.1 ns each, so the last offset must be computed as one product.
        let slot_s = 0.025 / 1440.0;
        let start = Stamp::from_nanos(1_349_049_600 * NANOS_PER_SECOND);
        let end = start + Span::from_seconds(1440.0 * slot_s);
        assert_eq!((end - start).nanos(), 25_000_000);
    }

    #[test]
    fn a_coarse_clock_rounds_down_on_both_sides_of_zero() {
        let ms = Span::from_nanos(1_000_000);
        assert_eq!(Stamp::from_nanos(1_999_999).floor_to(ms).nanos(), 1_000_000);
        assert_eq!(Stamp::from_nanos(-1).floor_to(ms).nanos(), -1_000_000);
        assert_eq!(Stamp::from_nanos(5).floor_to(Span::ZERO).nanos(), 5);
    }

    #[test]
    fn stamps_at_the_ends_of_the_clock_saturate() {
        let end = Stamp::from_nanos(i64::MAX);
        assert_eq!(end + Span::from_nanos(1), end);
        assert_eq!((end - Stamp::from_nanos(-1)).nanos(), i64::MAX);
    }
}
