//! Detects the unit of point times if a lidar's clouds contradict the usual one.

use zsim_base::time::{NANOS_PER_SECOND, Stamp};

/// Minimum number of clouds for a decision.
const MIN_CLOUDS: usize = 5;

/// Plausible ratios of a cloud's duration to the period of the clouds, in the usual unit: sparse clouds are much
/// shorter.
const PLAUSIBLE_RATIOS: std::ops::RangeInclusive<f64> = 0.003..=30.0;

/// Typical ratios in the correct unit.
const TYPICAL_RATIOS: std::ops::RangeInclusive<f64> = 0.1..=1.5;

/// Unit of the times of points after their cloud's stamp, as units per second.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimeUnit(i64);

impl TimeUnit {
    /// Usual unit of integer times.
    pub const NANOSECOND: Self = Self(NANOS_PER_SECOND);
    /// Usual unit of float times.
    pub const SECOND: Self = Self(1);
    const ALL: [Self; 4] = [Self::SECOND, Self(1_000), Self(1_000_000), Self::NANOSECOND];

    /// Units per second.
    pub fn per_second(self) -> f64 {
        self.0 as f64
    }

    /// Name in the plural.
    pub fn name(self) -> &'static str {
        match self.0 {
            1 => "seconds",
            1_000 => "milliseconds",
            1_000_000 => "microseconds",
            _ => "nanoseconds",
        }
    }

    /// Detects the unit from the first clouds of a lidar.
    ///
    /// `None` if the usual unit gives a plausible ratio of duration to period, or no other unit gives a typical one.
    pub fn detect(clouds: &[CloudDuration]) -> Option<Self> {
        let mut periods_s: Vec<f64> =
            clouds.windows(2).map(|pair| (pair[1].stamp - pair[0].stamp).seconds()).filter(|s| *s > 0.0).collect();
        if periods_s.len() + 1 < MIN_CLOUDS {
            return None;
        }
        periods_s.sort_unstable_by(f64::total_cmp);
        let period_s = periods_s[periods_s.len() / 2];
        let longest = |of: fn(&CloudDuration) -> f64| clouds.iter().map(of).fold(0.0, f64::max);
        let (raw_spread, usual_s) = (longest(|cloud| cloud.raw_spread), longest(|cloud| cloud.usual_s));
        let ratio = |unit: &Self| raw_spread / unit.per_second() / period_s;
        if PLAUSIBLE_RATIOS.contains(&(usual_s / period_s)) {
            return None;
        }
        Self::ALL.into_iter().find(|unit| TYPICAL_RATIOS.contains(&ratio(unit)))
    }
}

/// Duration of a cloud.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudDuration {
    /// Stamp of the cloud.
    pub stamp: Stamp,
    /// Spread of the point times, as written.
    pub raw_spread: f64,
    /// Spread of the point times in the usual unit, s.
    pub usual_s: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Clouds at 10 Hz with the given spread of point times, whose usual unit is `unit`.
    fn clouds(raw_spread: &[f64], unit: TimeUnit) -> Vec<CloudDuration> {
        let cloud = |(k, raw_spread): (usize, &f64)| CloudDuration {
            stamp: Stamp::from_nanos(k as i64 * 100_000_000),
            raw_spread: *raw_spread,
            usual_s: raw_spread / unit.per_second(),
        };
        raw_spread.iter().enumerate().map(cloud).collect()
    }

    #[test]
    fn the_unit_is_detected_from_the_duration_of_clouds() {
        let unit = |raw_spread: f64, usual| TimeUnit::detect(&clouds(&[raw_spread; 8], usual)).map(TimeUnit::name);
        assert_eq!(unit(99.9e6, TimeUnit::NANOSECOND), None);
        assert_eq!(unit(99.9e3, TimeUnit::NANOSECOND), Some("microseconds"));
        assert_eq!(unit(99.9, TimeUnit::NANOSECOND), Some("milliseconds"));
        assert_eq!(unit(9.9e1, TimeUnit::SECOND), Some("milliseconds"));
        assert_eq!(unit(0.0999, TimeUnit::NANOSECOND), Some("seconds"));
        // All points at once; few points, but more in some clouds; too few clouds.
        assert_eq!(unit(0.0, TimeUnit::NANOSECOND), None);
        assert_eq!(unit(0.5e6, TimeUnit::NANOSECOND), None);
        assert_eq!(TimeUnit::detect(&clouds(&[1e4, 2e4, 5e5, 0.0, 1e3], TimeUnit::NANOSECOND)), None);
        assert_eq!(TimeUnit::detect(&clouds(&[99.9e3; 4], TimeUnit::NANOSECOND)), None);
    }
}
