//! Screens the stamps of a sensor: drops lone outliers and removes steps of the clock.
//!
//! Log times are late by a varying delay, but never early, and a host's clock rarely steps. So the smallest delay of the last
//! messages relates the sensor's clock to log time. Stamps that leave this relation are outliers if it returns soon, and a
//! step of the clock if the new relation lasts.

use crate::clock_step::ClockStep;
use std::collections::VecDeque;
use zsim_base::time::{Span, Stamp};

/// A smaller change of stamps relative to log times is a change of the delay.
const MIN_STEP: Span = Span::from_nanos(100_000_000);
/// So much larger than the changes of the delay a step must be.
const MIN_STEP_OVER_SCATTER: i64 = 3;
/// A few messages that are apart from the others by more are outliers, whatever their log times.
const MAX_SEPARATION: Span = Span::from_nanos(600_000_000_000);
/// Messages, and the time that they span, that confirm a new relation of the clocks.
const CONFIRMING: (usize, Span) = (10, Span::from_nanos(250_000_000));
/// Messages that are held back while they are in doubt, where stamps advance and where they do not: bounds the memory.
const MAX_PENDING: (usize, usize) = (5000, 20);
/// A longer pause among the first messages separates outliers from the others.
const MAX_PAUSE_AT_START: Span = Span::from_nanos(2_000_000_000);
/// A message that is late by less is sorted in, not dropped.
const MAX_DISORDER: Span = Span::from_nanos(500_000_000);
/// Number of messages that show the delays and the period.
const RECENT: usize = 64;
/// The clocks drift apart by at most this, relative.
const MAX_DRIFT: f64 = 1e-3;
/// The clocks of two sensors step at one time, and by the same, if they do so within this.
const SAME_STEP: (Span, Span) = (Span::from_nanos(3_000_000_000), Span::from_nanos(50_000_000));

/// Log time and stamp of a message.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Reading {
    log: Stamp,
    stamp: Stamp,
}

impl Reading {
    /// Stamp minus log time.
    fn ahead(&self) -> Span {
        self.stamp - self.log
    }
}

/// A step of a clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Step {
    /// Log time.
    pub log: Stamp,
    /// Stamp of the first message after it, without the steps.
    pub stamp: Stamp,
    /// Change of the clock.
    pub by: Span,
}

/// Screens the messages of one sensor.
#[derive(Debug)]
pub(super) struct StampScreen<T> {
    /// The last messages that continue each other, oldest first.
    recent: VecDeque<Reading>,
    /// Largest value of stamp minus log time, with an allowance for drift: the smallest delay.
    envelope: Span,
    /// Messages that do not continue the recent ones.
    pending: Vec<(Reading, T)>,
    /// Sum of the steps so far.
    shift: Span,
    /// Number of messages dropped.
    pub(super) outliers: u64,
    /// Steps of the clock, in order.
    pub(super) steps: Vec<Step>,
}

impl<T> Default for StampScreen<T> {
    fn default() -> Self {
        Self {
            recent: VecDeque::new(),
            envelope: Span::ZERO,
            pending: Vec::new(),
            shift: Span::ZERO,
            outliers: 0,
            steps: Vec::new(),
        }
    }
}

impl<T> StampScreen<T> {
    /// Takes a message; passes those that are no longer in doubt to `accept`, each with the shift to subtract from its stamp.
    ///
    /// `other`: the last step of another sensor's clock, which may be the same clock.
    pub(super) fn push(
        &mut self,
        (log, stamp): (Stamp, Stamp),
        item: T,
        other: Option<Step>,
        accept: &mut impl FnMut(T, Span),
    ) {
        let here = Reading { log, stamp };
        if self.recent.is_empty() {
            self.pending.push((here, item));
            return self.start_if_confirmed(accept);
        }
        let continues_pending =
            self.pending.last().is_some_and(|(last, _)| self.continues(last, last.ahead(), &here, false));
        if self.recent.back().is_some_and(|last| self.continues(last, self.envelope, &here, continues_pending)) {
            self.settle_pending(accept);
            self.remember(here);
            return accept(item, self.shift);
        }
        if !continues_pending {
            self.settle_pending(accept);
        }
        self.pending.push((here, item));
        let advance = self.pending[self.pending.len() - 1].0.stamp - self.pending[0].0.stamp;
        if self.pending.len() >= CONFIRMING.0 && advance >= CONFIRMING.1 {
            self.adopt_pending(other, accept);
        } else {
            self.forget_if_stalled();
        }
    }

    /// Starts with the first messages, once there are enough; those apart from most of them are outliers.
    fn start_if_confirmed(&mut self, accept: &mut impl FnMut(T, Span)) {
        let mut stamps: Vec<Stamp> = self.pending.iter().map(|(reading, _)| reading.stamp).collect();
        stamps.sort_unstable();
        let runs = stamps.chunk_by(|a, b| *b - *a < MAX_PAUSE_AT_START);
        let Some(run) = runs.max_by_key(|run| run.len()) else { return };
        let (first, last) = (run[0], run[run.len() - 1]);
        if run.len() < CONFIRMING.0 || last - first < CONFIRMING.1 {
            return self.forget_if_stalled();
        }
        for (reading, item) in std::mem::take(&mut self.pending) {
            if (first..=last).contains(&reading.stamp) {
                self.remember(reading);
                accept(item, Span::ZERO);
            } else {
                self.outliers += 1;
            }
        }
    }

    /// Drops the oldest pending message if too many wait.
    fn forget_if_stalled(&mut self) {
        let advances = self.pending.first().zip(self.pending.last()).is_some_and(|(a, b)| b.0.stamp > a.0.stamp);
        if self.pending.len() > if advances { MAX_PENDING.0 } else { MAX_PENDING.1 } {
            self.pending.remove(0);
            self.outliers += 1;
        }
    }

    /// Ends the recording: passes the messages of a recording that is too short to judge them.
    pub(super) fn finish(&mut self, accept: &mut impl FnMut(T, Span)) {
        if self.recent.is_empty() {
            self.pending.drain(..).for_each(|(_, item)| accept(item, Span::ZERO));
        }
        self.settle_pending(accept);
    }

    /// The steps of the clock of `topic` so far; `shift` is added to its stamps elsewhere.
    pub(super) fn clock_steps(&self, topic: &str, shift: Span) -> impl Iterator<Item = ClockStep> {
        self.steps.iter().map(move |step| ClockStep { topic: topic.to_owned(), at: step.stamp + shift, by: step.by })
    }

    /// Whether a message continues the messages up to `last`, whose smallest delay is `-envelope`.
    ///
    /// A message that is late, but not stamped before them, does so unless it also continues others (`has_others`).
    fn continues(&self, last: &Reading, envelope: Span, here: &Reading, has_others: bool) -> bool {
        let advance = here.stamp - last.stamp;
        if magnitude(advance) > MAX_SEPARATION {
            return false;
        }
        let is_ahead = here.log != last.log && here.ahead() - envelope > MIN_STEP;
        let is_behind = (advance < Span::ZERO - MIN_STEP || has_others) && last.ahead() - here.ahead() > MIN_STEP;
        if !is_ahead && !is_behind {
            return true;
        }
        let change = if is_ahead { here.ahead() - envelope } else { last.ahead() - here.ahead() };
        !self.shows_steps() || change < self.scatter()
    }

    /// Whether log times carry information: they advance as the stamps do, and are not copies of them.
    fn shows_steps(&self) -> bool {
        let (Some(first), Some(last)) = (self.recent.front(), self.recent.back()) else { return true };
        let (logs, stamps) = (last.log - first.log, last.stamp - first.stamp);
        logs.nanos() > stamps.nanos() / 2
    }

    /// The change of the delay that is usual for this sensor, with a margin.
    fn scatter(&self) -> Span {
        let pairs = self.recent.iter().zip(self.recent.iter().skip(1));
        let largest = pairs.map(|(a, b)| magnitude(b.ahead() - a.ahead()).nanos()).max().unwrap_or(0);
        Span::from_nanos(largest.saturating_mul(MIN_STEP_OVER_SCATTER))
    }

    fn remember(&mut self, here: Reading) {
        self.envelope = match self.recent.back() {
            Some(last) => {
                let drift = Span::from_seconds(MAX_DRIFT * here.log.seconds_since(last.log).max(0.0));
                (self.envelope - drift).max(here.ahead())
            }
            None => here.ahead(),
        };
        self.recent.push_back(here);
        if self.recent.len() > RECENT {
            self.recent.pop_front();
        }
    }

    /// Drops the pending messages as outliers; those that are only late are passed on.
    fn settle_pending(&mut self, accept: &mut impl FnMut(T, Span)) {
        let last = self.recent.back().copied();
        for (reading, item) in self.pending.drain(..) {
            if last.is_some_and(|last| magnitude(reading.stamp - last.stamp) < MAX_DISORDER) {
                accept(item, self.shift);
            } else {
                self.outliers += 1;
            }
        }
    }

    /// Continues with the pending messages, after a step of the clock or a pause.
    fn adopt_pending(&mut self, other: Option<Step>, accept: &mut impl FnMut(T, Span)) {
        let log = self.pending[0].0.log;
        if let Some(by) = self.step_before_pending() {
            let is_same =
                |step: &Step| magnitude(log - step.log) < SAME_STEP.0 && magnitude(by - step.by) < SAME_STEP.1;
            let by = other.filter(is_same).map_or(by, |step| step.by);
            self.shift = self.shift + by;
            self.steps.push(Step { log, stamp: self.pending[0].0.stamp - self.shift, by });
        }
        self.recent.clear();
        for (reading, item) in std::mem::take(&mut self.pending) {
            self.remember(reading);
            accept(item, self.shift);
        }
    }

    /// Change of the clock between the recent and the pending messages; `None` if log times show a pause or nothing.
    ///
    /// Log times show it to some milliseconds. A sensor with a period shows the rest: a whole number of periods has passed.
    fn step_before_pending(&self) -> Option<Span> {
        let last = self.recent.back()?;
        let largest = |ahead: &mut dyn Iterator<Item = Span>| ahead.max().unwrap_or_default();
        let by = largest(&mut self.pending.iter().map(|(reading, _)| reading.ahead()))
            - largest(&mut self.recent.iter().map(Reading::ahead));
        if !self.shows_steps() || magnitude(by) < MIN_STEP {
            return None;
        }
        let period = self.period().filter(|period| *period > Span::ZERO);
        let passed = self.pending[0].0.stamp - by - last.stamp;
        let whole = period.map_or(passed, |period| {
            let periods = (passed.seconds() / period.seconds()).round().max(1.0);
            Span::from_nanos((periods * period.nanos() as f64).round() as i64)
        });
        Some(self.pending[0].0.stamp - last.stamp - whole)
    }

    /// Median interval of the recent messages.
    fn period(&self) -> Option<Span> {
        let mut intervals: Vec<Span> =
            self.recent.iter().zip(self.recent.iter().skip(1)).map(|(a, b)| b.stamp - a.stamp).collect();
        intervals.sort_unstable();
        intervals.get(intervals.len() / 2).copied()
    }
}

fn magnitude(span: Span) -> Span {
    Span::from_nanos(span.nanos().saturating_abs())
}

#[cfg(test)]
mod tests;
