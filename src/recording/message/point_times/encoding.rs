//! Encoding of the points' times.

use super::cloud_times::CloudTimes;
use super::unit::TimeUnit;
use zsim_base::time::{NANOS_PER_SECOND, Span, Stamp};

/// Absolute times that differ by more than this from their cloud's stamp are on another clock, s.
const MAX_CLOCK_DIFFERENCE_S: f64 = 1.0;

/// Maximum duration of a cloud with times of another clock, s.
pub const MAX_CLOUD_S: f64 = 1.5;

/// Minimum ratio of the time on another clock to the duration of the cloud.
const MIN_UPTIME_RATIO: f64 = 20.0;

/// Maximum time between a point and its cloud's stamp, s: larger values are not a point's time.
const MAX_OFFSET_S: f64 = 60.0;

/// Tolerance between a cloud's stamp and the nearest point, s, for clouds of short duration.
const TOLERANCE_S: f64 = 1e-3;

/// Maximum relative time that is interpreted as seconds; a lidar frame is shorter.
const MAX_RELATIVE_S: f64 = 10.0;

/// Encoding of the points' times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TimeEncoding {
    /// Time after the cloud's stamp.
    AfterStamp(TimeUnit),
    /// Absolute time, in this fraction of a second (1e9: nanoseconds).
    Absolute(f64),
    /// Absolute time of another clock than the stamp's, in this fraction of a second.
    OtherClock(f64),
}

impl TimeEncoding {
    /// Detects the encoding from a cloud.
    ///
    /// Short integers are nanoseconds after the stamp. For others the first rule that applies is used: absolute times (s, us
    /// or ns) if they are as near to the stamp as to each other, and not as near to zero; seconds after the stamp if
    /// they are at most 10, since a frame is shorter; absolute times if they are within 1 s of the stamp and not of zero;
    /// absolute times of another clock if their spread is much smaller than their value; else nanoseconds after the stamp.
    pub fn detect(cloud: &CloudTimes) -> Self {
        let CloudTimes { low, high, .. } = *cloud;
        if cloud.is_short {
            return Self::AfterStamp(TimeUnit::NANOSECOND);
        }
        let stamp_s = cloud.stamp.nanos() as f64 / NANOS_PER_SECOND as f64;
        // Whether all values are within `reach_s` of `centre_s`, at `per_second` units per second.
        let within = |centre_s: f64, per_second: f64, reach_s: f64| {
            low / per_second >= centre_s - reach_s && high / per_second <= centre_s + reach_s
        };
        let spread_s = |per_second: f64| cloud.spread() / per_second + TOLERANCE_S;
        let absolute = |is_absolute: &dyn Fn(f64) -> bool| {
            [1.0, 1e6, 1e9].into_iter().find(|per_second| is_absolute(*per_second)).map(Self::Absolute)
        };
        let tight = || {
            let is_near = |per_second: f64| within(stamp_s, per_second, spread_s(per_second));
            if within(0.0, 1.0, spread_s(1.0)) { None } else { absolute(&is_near) }
        };
        let seconds =
            || (low >= -MAX_RELATIVE_S && high <= MAX_RELATIVE_S).then_some(Self::AfterStamp(TimeUnit::SECOND));
        let loose = || {
            absolute(&|per_second| {
                let is_near = |centre_s: f64| within(centre_s, per_second, MAX_CLOCK_DIFFERENCE_S);
                is_near(stamp_s) && !is_near(0.0)
            })
        };
        let found = tight().or_else(seconds).or_else(loose).or_else(|| Self::detect_other_clock(low, high));
        found.unwrap_or(Self::AfterStamp(TimeUnit::NANOSECOND))
    }

    fn detect_other_clock(low: f64, high: f64) -> Option<Self> {
        let is_cloud = |per_second: &f64| (high - low) / per_second <= MAX_CLOUD_S;
        let per_second = [1.0, 1e3, 1e6, 1e9].into_iter().find(is_cloud)?;
        (low > MIN_UPTIME_RATIO * (high - low)).then_some(Self::OtherClock(per_second))
    }

    /// Units per second.
    pub fn per_second(self) -> f64 {
        match self {
            Self::AfterStamp(unit) => unit.per_second(),
            Self::Absolute(per_second) | Self::OtherClock(per_second) => per_second,
        }
    }

    /// Computes the time of a point after `stamp`, or on another clock after `reference`.
    ///
    /// `None` if it is not finite or too far from it.
    pub fn offset(self, number: f64, stamp: Stamp, reference: f64) -> Option<Span> {
        let offset = match self {
            Self::AfterStamp(TimeUnit::NANOSECOND) => Span::from_nanos(number.round() as i64),
            Self::AfterStamp(unit) => Span::from_seconds(number / unit.per_second()),
            // Whole and fractional seconds separately: nanoseconds since 1970 exceed the 53 bits of a double.
            Self::Absolute(per_second) => {
                let whole = (number / per_second).floor();
                let part = (number - whole * per_second) / per_second;
                let absolute =
                    Stamp::from_nanos((whole as i64).saturating_mul(NANOS_PER_SECOND)) + Span::from_seconds(part);
                absolute - stamp
            }
            Self::OtherClock(per_second) => Span::from_seconds((number - reference) / per_second),
        };
        (number.is_finite() && offset.seconds().abs() <= MAX_OFFSET_S).then_some(offset)
    }
}
