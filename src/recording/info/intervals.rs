//! The times between messages, as they go by.

use crate::time::{Span, Stamp};

/// Intervals from which the period is learned.
const LEARNING: usize = 255;

/// An interval of more periods than this has messages missing in it.
const MISSING_BEYOND: f64 = 1.5;

/// What the intervals of a topic are.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Summary {
    /// Their median at the start.
    pub period: Option<Span>,
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

    /// Takes the median of the intervals so far for the period, and counts what is missing in them.
    fn learn(&mut self) {
        let mut sorted = self.learning.clone();
        sorted.sort_unstable();
        let period = sorted.get(sorted.len() / 2).copied().filter(|period| *period > Span::ZERO);
        let Some(period) = period else { return self.learning.clear() };
        self.summary.period = Some(period);
        self.summary.missing += self.learning.drain(..).map(|interval| missing_in(interval, period)).sum::<u64>();
    }

    /// All of it.
    pub fn finish(mut self) -> Summary {
        if self.summary.period.is_none() {
            self.learn();
        }
        self.summary
    }
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
    fn a_gap_of_two_seconds_and_a_step_back_are_counted() {
        // 10 ms apart; 2 s are left out after 1 s (199 messages), then one comes that is 5 ms late in order.
        let found = summary((0..100).map(|k| k * 10).chain((300..400).map(|k| k * 10)).chain([3985]));
        assert_eq!((found.gaps, found.missing, found.out_of_order), (1, 200, 1));
        assert_eq!(found.longest, Some(Span::from_nanos(2_010_000_000)));
    }
}
