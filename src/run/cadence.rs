//! Counts of a sensor's messages, and of those that are missing.

use zsim_base::signal::{Regularity, StampPattern};
use zsim_base::time::Stamp;

/// Number of stamps that determine the period.
const PERIOD_STAMPS: usize = 1000;
/// Tolerated fraction of missing messages: stamps are rounded, and a run can end within a period.
const MISSING_TOLERANCE: f64 = 0.005;

/// Counts the messages of a sensor, and the missing messages relative to a constant rate.
#[derive(Debug, Clone, Default)]
pub struct Cadence {
    first: Option<Stamp>,
    last: Option<Stamp>,
    count: usize,
    first_stamps_s: Vec<f64>,
}

impl Cadence {
    /// Counts a message.
    pub fn take(&mut self, stamp: Stamp) {
        if self.first_stamps_s.len() < PERIOD_STAMPS && self.last.is_none_or(|last| stamp >= last) {
            self.first_stamps_s.push(stamp.seconds_since(self.first.unwrap_or(stamp)));
        }
        self.first = Some(self.first.map_or(stamp, |first| first.min(stamp)));
        self.last = Some(self.last.map_or(stamp, |last| last.max(stamp)));
        self.count += 1;
    }

    /// Number of messages.
    pub fn count(&self) -> usize {
        self.count
    }

    /// First and last stamp.
    pub fn span(&self) -> Option<(Stamp, Stamp)> {
        Some((self.first?, self.last?))
    }

    /// A message on missing data, if more than 0.5 % of the messages are missing.
    pub fn missing(&self, messages: &str) -> Option<String> {
        let (first, last) = self.span()?;
        let expected = (last.seconds_since(first) / self.period_s()?).round() + 1.0;
        let missing = expected - self.count as f64;
        let is_significant = missing > 2.0 && missing > MISSING_TOLERANCE * expected;
        is_significant.then(|| format!("{missing:.0} of about {expected:.0} {messages} are missing"))
    }

    /// The period; `None` for a sensor with irregular stamps.
    fn period_s(&self) -> Option<f64> {
        let found = Regularity::of(&self.first_stamps_s)?;
        Some(found.period_s).filter(|_| found.pattern != StampPattern::Irregular)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn missing(stamps_ms: impl Iterator<Item = i64>) -> Option<String> {
        let mut cadence = Cadence::default();
        stamps_ms.for_each(|ms| cadence.take(Stamp::from_nanos(ms * 1_000_000)));
        cadence.missing("scans")
    }

    #[test]
    fn a_missing_tenth_of_the_messages_is_reported_and_a_complete_recording_is_not() {
        let message = missing((0..4000).filter(|k| k % 10 != 3).map(|k| k * 25));
        assert_eq!(message.as_deref(), Some("400 of about 4000 scans are missing"));
        assert_eq!(missing((0..4000).map(|k| k * 25)), None);
        // 30 Hz in integer milliseconds: 33, 33, 34.
        assert_eq!(missing((0..4000).map(|k| k * 1000 / 30)), None);
        assert_eq!(missing([5_i64].into_iter()), None);
        // Jitter of more than a period; the messages arrive in the order of their stamps.
        let mut jittered: Vec<i64> = (0..4000).map(|k| k * 5 + (k * 7919 % 97) * 8 / 97).collect();
        jittered.sort_unstable();
        assert_eq!(missing(jittered.into_iter()), None);
    }
}
