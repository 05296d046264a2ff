//! In what the times of a lidar's points are counted, where its clouds show that it is not what is usual.

use crate::time::{NANOS_PER_SECOND, Stamp};

/// Fewest clouds that show it.
const FEWEST: usize = 5;

/// What part of the time from one cloud to the next a cloud may last, as its times are usually counted: sparse clouds
/// less, by far.
const CREDIBLE: std::ops::RangeInclusive<f64> = 0.003..=30.0;

/// What part of it a cloud lasts whose times are counted rightly.
const USUAL: std::ops::RangeInclusive<f64> = 0.1..=1.5;

/// A unit in which points' times after their cloud's stamp are counted: so many make a second.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unit(i64);

impl Unit {
    /// As drivers count in integers.
    pub const NANOSECOND: Self = Self(NANOS_PER_SECOND);
    /// As they count in floats.
    pub const SECOND: Self = Self(1);
    const ALL: [Self; 4] = [Self::SECOND, Self(1_000), Self(1_000_000), Self::NANOSECOND];

    /// How many make a second.
    pub fn in_a_second(self) -> f64 {
        self.0 as f64
    }

    /// Many of them.
    pub fn name(self) -> &'static str {
        match self.0 {
            1 => "seconds",
            1_000 => "milliseconds",
            1_000_000 => "microseconds",
            _ => "nanoseconds",
        }
    }

    /// The unit that the first clouds of a lidar show, where as they are usually read they would last far longer or
    /// shorter than the time from one to the next; `None` where that is credible, or no other unit makes it so.
    pub fn shown_by(clouds: &[Lasting]) -> Option<Self> {
        let mut periods_s: Vec<f64> =
            clouds.windows(2).map(|pair| (pair[1].stamp - pair[0].stamp).seconds()).filter(|s| *s > 0.0).collect();
        if periods_s.len() + 1 < FEWEST {
            return None;
        }
        periods_s.sort_unstable_by(f64::total_cmp);
        let period_s = periods_s[periods_s.len() / 2];
        let longest = |of: fn(&Lasting) -> f64| clouds.iter().map(of).fold(0.0, f64::max);
        let (numbers, seconds) = (longest(|cloud| cloud.numbers), longest(|cloud| cloud.seconds));
        let lasts = |unit: &Self| numbers / unit.in_a_second() / period_s;
        if CREDIBLE.contains(&(seconds / period_s)) {
            return None;
        }
        Self::ALL.into_iter().find(|unit| USUAL.contains(&lasts(unit)))
    }
}

/// How long a cloud lasts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lasting {
    /// The cloud's stamp.
    pub stamp: Stamp,
    /// From its least time to its greatest, as they are written.
    pub numbers: f64,
    /// The same as it is usually read, s.
    pub seconds: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Clouds ten times a second that last `numbers` each, usually read as `unit`.
    fn clouds(numbers: &[f64], unit: Unit) -> Vec<Lasting> {
        let cloud = |(k, numbers): (usize, &f64)| Lasting {
            stamp: Stamp::from_nanos(k as i64 * 100_000_000),
            numbers: *numbers,
            seconds: numbers / unit.in_a_second(),
        };
        numbers.iter().enumerate().map(cloud).collect()
    }

    #[test]
    fn a_unit_is_told_by_how_long_clouds_last() {
        let unit = |numbers: f64, usual| Unit::shown_by(&clouds(&[numbers; 8], usual)).map(Unit::name);
        assert_eq!(unit(99.9e6, Unit::NANOSECOND), None);
        assert_eq!(unit(99.9e3, Unit::NANOSECOND), Some("microseconds"));
        assert_eq!(unit(99.9, Unit::NANOSECOND), Some("milliseconds"));
        assert_eq!(unit(9.9e1, Unit::SECOND), Some("milliseconds"));
        assert_eq!(unit(0.0999, Unit::NANOSECOND), Some("seconds"));
        // All at once; few points, but of some cloud more; too few clouds.
        assert_eq!(unit(0.0, Unit::NANOSECOND), None);
        assert_eq!(unit(0.5e6, Unit::NANOSECOND), None);
        assert_eq!(Unit::shown_by(&clouds(&[1e4, 2e4, 5e5, 0.0, 1e3], Unit::NANOSECOND)), None);
        assert_eq!(Unit::shown_by(&clouds(&[99.9e3; 4], Unit::NANOSECOND)), None);
    }
}
