//! The times between messages, as they go by.

use crate::signal::{Regularity, StampPattern};
use crate::time::{Span, Stamp};

/// Intervals from which the period is learned.
const LEARNING: usize = 1000;

/// Of stamps that scatter so small a share of missing messages says nothing.
const PASSED_OVER: f64 = 0.002;

/// An interval of more periods than this has messages missing in it.
const MISSING_BEYOND: f64 = 1.5;

/// What the intervals of a topic are.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Summary {
    /// The period at the start.
    pub period: Option<Span>,
    /// How the stamps lie about it.
    pub pattern: Option<StampPattern>,
    /// The longest.
    pub longest: Option<Span>,
    /// Those longer than a gap.
    pub gaps: u64,
    /// Messages that would have filled the longer ones.
    pub missing: u64,
    /// Those that go backwards.
    pub out_of_order: u64,
}

/// Gathers intervals.
#[derive(Debug, Clone, Default)]
pub struct Intervals {
    latest: Option<Stamp>,
    learning: Vec<Span>,
    /// Intervals so far, and what they take together.
    count: u64,
    taken: Span,
    summary: Summary,
}

impl Intervals {
    /// Takes the next message's time.
    pub fn add(&mut self, time: Stamp, gap: Span) {
        let Some(latest) = self.latest else {
            self.latest = Some(time);
            return;
        };
        let interval = time - latest;
        if interval < Span::ZERO {
            self.summary.out_of_order += 1;
            return;
        }
        self.latest = Some(time);
        self.count += 1;
        self.taken = self.taken + interval;
        self.summary.longest = self.summary.longest.max(Some(interval));
        self.summary.gaps += u64::from(interval > gap);
        match self.summary.period {
            Some(period) => self.summary.missing += missing_in(interval, period),
            None => self.learning.push(interval),
        }
        if self.learning.len() >= LEARNING {
            self.learn();
        }
    }

    /// Learns the period from the intervals so far, and counts what is missing in them.
    fn learn(&mut self) {
        let mut stamp_s = 0.0;
        let after = self.learning.iter().map(|interval| {
            stamp_s += interval.seconds();
            stamp_s
        });
        let stamps_s: Vec<f64> = std::iter::once(0.0).chain(after).collect();
        let Some(found) = Regularity::of(&stamps_s).or_else(|| only_interval(&stamps_s)) else {
            return self.learning.clear();
        };
        let period = Span::from_seconds(found.period_s);
        (self.summary.period, self.summary.pattern) = (Some(period), Some(found.pattern));
        self.summary.missing += self.learning.drain(..).map(|interval| missing_in(interval, period)).sum::<u64>();
    }

    /// All of it.
    pub fn finish(mut self) -> Summary {
        if self.summary.period.is_none() {
            self.learn();
        }
        self.summary.missing = match (self.summary.pattern, self.summary.period) {
            (Some(StampPattern::Delayed | StampPattern::Bursts), Some(period)) => self.missing_in_all(period),
            (Some(StampPattern::Irregular), _) => 0,
            _ => self.summary.missing,
        };
        self.summary
    }

    /// What is missing in all: a message that comes late makes one interval long and the next one short.
    fn missing_in_all(&self, period: Span) -> u64 {
        let all_s = self.taken.seconds();
        let missing = (all_s / period.seconds()).round() - self.count as f64;
        if missing > PASSED_OVER * self.count as f64 { missing as u64 } else { 0 }
    }
}

/// Of two messages the only interval is the period.
fn only_interval(stamps_s: &[f64]) -> Option<Regularity> {
    let &[from_s, to_s] = stamps_s else { return None };
    (to_s > from_s).then_some(Regularity { period_s: to_s - from_s, jitter_s: 0.0, pattern: StampPattern::Regular })
}

fn missing_in(interval: Span, period: Span) -> u64 {
    let periods = interval.seconds() / period.seconds();
    if periods > MISSING_BEYOND { periods.round() as u64 - 1 } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn summary(times_ms: impl Iterator<Item = i64>) -> Summary {
        let mut intervals = Intervals::default();
        times_ms.for_each(|ms| intervals.add(Stamp::from_nanos(ms * 1_000_000), Span::from_seconds(0.5)));
        intervals.finish()
    }

    #[test]
    fn every_tenth_message_gone_is_counted() {
        let found = summary((0..1000).filter(|k| k % 10 != 5).map(|k| k * 25));
        assert_eq!((found.missing, found.gaps, found.out_of_order), (100, 0, 0));
        assert_eq!(found.period, Some(Span::from_nanos(25_000_000)));
        assert_eq!(found.longest, Some(Span::from_nanos(50_000_000)));
    }

    #[test]
    fn messages_that_a_bus_delays_are_not_missing() {
        // 10 ms apart, late by 0 to 29 ms and 5 ms on average, in order; or four at once.
        let delays = (0..4000_i64).map(|k| k * 7919 % 97).map(|x| if x > 80 { x % 30 } else { x % 7 });
        let late: Vec<i64> = delays.enumerate().map(|(k, delay)| k as i64 * 10 + delay).collect();
        let mut in_order = late.clone();
        in_order.sort_unstable();
        let found = summary(in_order.into_iter());
        assert_eq!((found.missing, found.pattern), (0, Some(StampPattern::Delayed)));
        let found = summary((0..4000).map(|k| k / 4 * 40));
        assert_eq!((found.missing, found.pattern), (0, Some(StampPattern::Bursts)));
    }

    #[test]
    fn a_gap_of_two_seconds_and_a_step_back_are_counted() {
        // 10 ms apart; 2 s are left out after 1 s (199 messages), then one comes that is 5 ms late in order.
        let found = summary((0..100).map(|k| k * 10).chain((300..400).map(|k| k * 10)).chain([3985]));
        assert_eq!((found.gaps, found.missing, found.out_of_order), (1, 200, 1));
        assert_eq!(found.longest, Some(Span::from_nanos(2_010_000_000)));
    }
}
