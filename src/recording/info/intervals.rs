//! Incremental statistics of the intervals between messages.

use zsim_base::signal::{Regularity, StampPattern};
use zsim_base::time::{Span, Stamp};

/// Number of intervals from which the period is determined.
const LEARNING_INTERVALS: usize = 1000;

/// Missing messages below this fraction are not significant if the stamps scatter.
const MIN_MISSING_FRACTION: f64 = 0.002;

/// An interval of more periods than this has missing messages.
const MISSING_THRESHOLD: f64 = 1.5;

/// Statistics of the intervals of a topic.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct IntervalStatistics {
    /// Period at the start.
    pub period: Option<Span>,
    /// Pattern of the stamps about the period.
    pub pattern: Option<StampPattern>,
    /// Longest interval.
    pub longest: Option<Span>,
    /// Number of intervals longer than a gap.
    pub gaps: u64,
    /// Number of messages missing in the longer intervals.
    pub missing: u64,
    /// Number of messages stamped before their predecessor.
    pub out_of_order: u64,
}

/// Accumulates intervals.
#[derive(Debug, Clone, Default)]
pub struct Intervals {
    latest: Option<Stamp>,
    learning: Vec<Span>,
    /// Number of intervals so far, and their sum.
    count: u64,
    total: Span,
    statistics: IntervalStatistics,
}

impl Intervals {
    /// Adds the time of the next message.
    pub fn add(&mut self, time: Stamp, gap: Span) {
        let Some(latest) = self.latest else {
            self.latest = Some(time);
            return;
        };
        let interval = time - latest;
        if interval < Span::ZERO {
            self.statistics.out_of_order += 1;
            return;
        }
        self.latest = Some(time);
        self.count += 1;
        self.total = self.total + interval;
        self.statistics.longest = self.statistics.longest.max(Some(interval));
        self.statistics.gaps += u64::from(interval > gap);
        match self.statistics.period {
            Some(period) => self.add_missing(missing_in(interval, period)),
            None => self.learning.push(interval),
        }
        if self.learning.len() >= LEARNING_INTERVALS {
            self.determine_period();
        }
    }

    /// Determines the period from the intervals so far, and counts the messages missing in them.
    fn determine_period(&mut self) {
        let mut stamp_s = 0.0;
        let after = self.learning.iter().map(|interval| {
            stamp_s += interval.seconds();
            stamp_s
        });
        let stamps_s: Vec<f64> = std::iter::once(0.0).chain(after).collect();
        let found = Regularity::of(&stamps_s).or_else(|| only_interval(&stamps_s));
        // Stamps of a few nanoseconds after each other have no period.
        let is_positive = |found: &Regularity| Span::from_seconds(found.period_s) > Span::ZERO;
        let Some(found) = found.filter(is_positive) else {
            return self.learning.clear();
        };
        let period = Span::from_seconds(found.period_s);
        (self.statistics.period, self.statistics.pattern) = (Some(period), Some(found.pattern));
        for interval in std::mem::take(&mut self.learning) {
            self.add_missing(missing_in(interval, period));
        }
    }

    fn add_missing(&mut self, missing: u64) {
        self.statistics.missing = self.statistics.missing.saturating_add(missing);
    }

    /// Completes the statistics.
    pub fn finish(mut self) -> IntervalStatistics {
        if self.statistics.period.is_none() {
            self.determine_period();
        }
        self.statistics.missing = match (self.statistics.pattern, self.statistics.period) {
            (Some(StampPattern::Delayed | StampPattern::Bursts), Some(period)) => self.missing_overall(period),
            (Some(StampPattern::Irregular), _) => 0,
            _ => self.statistics.missing,
        };
        self.statistics
    }

    /// Missing messages from the total time: a late message makes one interval long and the next one short.
    fn missing_overall(&self, period: Span) -> u64 {
        let all_s = self.total.seconds();
        let missing = (all_s / period.seconds()).round() - self.count as f64;
        if missing > MIN_MISSING_FRACTION * self.count as f64 { missing as u64 } else { 0 }
    }
}

/// With two messages, the only interval is the period.
fn only_interval(stamps_s: &[f64]) -> Option<Regularity> {
    let &[from_s, to_s] = stamps_s else { return None };
    (to_s > from_s).then_some(Regularity { period_s: to_s - from_s, jitter_s: 0.0, pattern: StampPattern::Regular })
}

fn missing_in(interval: Span, period: Span) -> u64 {
    let periods = interval.seconds() / period.seconds();
    if periods > MISSING_THRESHOLD { periods.round() as u64 - 1 } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn statistics(times_ms: impl Iterator<Item = i64>) -> IntervalStatistics {
        let mut intervals = Intervals::default();
        times_ms.for_each(|ms| intervals.add(Stamp::from_nanos(ms * 1_000_000), Span::from_seconds(0.5)));
        intervals.finish()
    }

    #[test]
    fn every_missing_tenth_message_is_counted() {
        let found = statistics((0..1000).filter(|k| k % 10 != 5).map(|k| k * 25));
        assert_eq!((found.missing, found.gaps, found.out_of_order), (100, 0, 0));
        assert_eq!(found.period, Some(Span::from_nanos(25_000_000)));
        assert_eq!(found.longest, Some(Span::from_nanos(50_000_000)));
    }

    #[test]
    fn messages_that_a_bus_delays_are_not_missing() {
        // Every 10 ms, delayed by 0 to 29 ms, 5 ms on average, sorted; then four at once.
        let delays = (0..4000_i64).map(|k| k * 7919 % 97).map(|x| if x > 80 { x % 30 } else { x % 7 });
        let late: Vec<i64> = delays.enumerate().map(|(k, delay)| k as i64 * 10 + delay).collect();
        let mut in_order = late.clone();
        in_order.sort_unstable();
        let found = statistics(in_order.into_iter());
        assert_eq!((found.missing, found.pattern), (0, Some(StampPattern::Delayed)));
        for in_burst in [2, 4] {
            let found = statistics((0..4000).map(|k| k / in_burst * 10 * in_burst));
            assert_eq!((found.missing, found.pattern), (0, Some(StampPattern::Bursts)), "{in_burst}");
        }
    }

    #[test]
    fn stamps_without_a_period_have_no_missing_messages() {
        let of_ns = |stamps: &mut dyn Iterator<Item = i64>| {
            let mut intervals = Intervals::default();
            stamps.for_each(|ns| intervals.add(Stamp::from_nanos(ns), Span::from_seconds(0.5)));
            intervals.finish().missing
        };
        assert_eq!(of_ns(&mut [0; 30].into_iter()), 0);
        // No sum of missing messages exceeds the number type.
        assert!(of_ns(&mut (0..3000).map(|k| k * 3000).chain([i64::MAX, i64::MAX])) > 0);
    }

    #[test]
    fn a_gap_of_two_seconds_and_a_step_back_are_counted() {
        // Every 10 ms; 2 s are missing after 1 s (199 messages), then one message is 5 ms out of order.
        let found = statistics((0..100).map(|k| k * 10).chain((300..400).map(|k| k * 10)).chain([3985]));
        assert_eq!((found.gaps, found.missing, found.out_of_order), (1, 200, 1));
        assert_eq!(found.longest, Some(Span::from_nanos(2_010_000_000)));
    }
}
