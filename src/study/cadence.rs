use crate::signal::{Regularity, StampPattern};
use crate::time::Stamp;

/// Stamps from which the rhythm is learned.
const LEARNING: usize = 1000;
/// The share of missing messages that is passed over: stamps are rounded, and a run may end within a turn.
const PASSED_OVER: f64 = 0.005;

/// Counts the messages of a sensor, and those that its rhythm says are missing.
#[derive(Debug, Clone, Default)]
pub(super) struct Cadence {
    first: Option<Stamp>,
    last: Option<Stamp>,
    count: usize,
    learning_s: Vec<f64>,
}

impl Cadence {
    pub(super) fn take(&mut self, stamp: Stamp) {
        if self.learning_s.len() < LEARNING && self.last.is_none_or(|last| stamp >= last) {
            self.learning_s.push(stamp.seconds_since(self.first.unwrap_or(stamp)));
        }
        self.first = Some(self.first.map_or(stamp, |first| first.min(stamp)));
        self.last = Some(self.last.map_or(stamp, |last| last.max(stamp)));
        self.count += 1;
    }

    /// How many messages there were.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// First and last stamp.
    pub(super) fn span(&self) -> Option<(Stamp, Stamp)> {
        Some((self.first?, self.last?))
    }

    /// A sentence on the messages that are missing, if more than half a per cent are.
    pub(super) fn missing(&self, what: &str) -> Option<String> {
        let (first, last) = self.span()?;
        let expected = (last.seconds_since(first) / self.period_s()?).round() + 1.0;
        let missing = expected - self.count as f64;
        let told = missing > 2.0 && missing > PASSED_OVER * expected;
        told.then(|| format!("{missing:.0} of about {expected:.0} {what} are missing"))
    }

    /// The period; none of a sensor without one.
    fn period_s(&self) -> Option<f64> {
        let found = Regularity::of(&self.learning_s)?;
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
    fn one_message_in_ten_is_missed_and_none_of_a_whole_recording() {
        let told = missing((0..4000).filter(|k| k % 10 != 3).map(|k| k * 25));
        assert_eq!(told.as_deref(), Some("400 of about 4000 scans are missing"));
        assert_eq!(missing((0..4000).map(|k| k * 25)), None);
        // 30 Hz in whole milliseconds: 33, 33, 34.
        assert_eq!(missing((0..4000).map(|k| k * 1000 / 30)), None);
        assert_eq!(missing([5_i64].into_iter()), None);
        // Jitter of more than a period, in the order of stamps.
        let mut jittered: Vec<i64> = (0..4000).map(|k| k * 5 + (k * 7919 % 97) * 8 / 97).collect();
        jittered.sort_unstable();
        assert_eq!(missing(jittered.into_iter()), None);
    }
}
