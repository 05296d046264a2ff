//! Detects the unit of point times if a lidar's clouds contradict the usual one.

use super::cloud_times::CloudTimes;
use crate::quantile::quantile;
use zsim_base::time::NANOS_PER_SECOND;

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

    /// Detects the unit of times after the stamp from the first clouds of a lidar.
    ///
    /// `None` if the `usual` unit gives a plausible ratio of duration to period, or no other unit gives a typical one.
    pub fn detect(clouds: &[CloudTimes], usual: Self) -> Option<Self> {
        if clouds.len() < MIN_CLOUDS {
            return None;
        }
        let period_s = period_s(clouds)?;
        let longest = clouds.iter().map(CloudTimes::spread).fold(0.0, f64::max);
        let ratio = |unit: &Self| longest / unit.per_second() / period_s;
        if PLAUSIBLE_RATIOS.contains(&ratio(&usual)) {
            return None;
        }
        Self::ALL.into_iter().find(|unit| TYPICAL_RATIOS.contains(&ratio(unit)))
    }
}

/// Median interval of the clouds' stamps, s; `None` if no stamp is later than its predecessor.
pub fn period_s(clouds: &[CloudTimes]) -> Option<f64> {
    let intervals_s = clouds.windows(2).map(|pair| pair[1].stamp.seconds_since(pair[0].stamp));
    let periods_s: Vec<f64> = intervals_s.filter(|s| *s > 0.0).collect();
    (!periods_s.is_empty()).then(|| quantile(periods_s, 0.5))
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::time::Stamp;

    /// Clouds at 10 Hz with the given spread of point times.
    fn clouds(spreads: &[f64]) -> Vec<CloudTimes> {
        let cloud = |(k, spread): (usize, &f64)| CloudTimes {
            stamp: Stamp::from_nanos(k as i64 * 100_000_000),
            source: 0,
            is_short: true,
            low: 0.1 * spread,
            high: 0.9 * spread,
            is_equal: Some(*spread == 0.0),
        };
        spreads.iter().enumerate().map(cloud).collect()
    }

    #[test]
    fn the_unit_is_detected_from_the_duration_of_clouds() {
        let unit = |raw_spread: f64, usual| TimeUnit::detect(&clouds(&[raw_spread; 8]), usual).map(TimeUnit::name);
        assert_eq!(unit(99.9e6, TimeUnit::NANOSECOND), None);
        assert_eq!(unit(99.9e3, TimeUnit::NANOSECOND), Some("microseconds"));
        assert_eq!(unit(99.9, TimeUnit::NANOSECOND), Some("milliseconds"));
        assert_eq!(unit(9.9e1, TimeUnit::SECOND), Some("milliseconds"));
        assert_eq!(unit(0.0999, TimeUnit::NANOSECOND), Some("seconds"));
        // All points at once; few points, but more in some clouds; too few clouds.
        assert_eq!(unit(0.0, TimeUnit::NANOSECOND), None);
        assert_eq!(unit(0.5e6, TimeUnit::NANOSECOND), None);
        assert_eq!(TimeUnit::detect(&clouds(&[1e4, 2e4, 5e5, 0.0, 1e3]), TimeUnit::NANOSECOND), None);
        assert_eq!(TimeUnit::detect(&clouds(&[99.9e3; 4]), TimeUnit::NANOSECOND), None);
    }
}
