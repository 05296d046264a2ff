//! Faults by which messages are lost.

use super::FaultKind;
use super::pipeline::{Message, Stage};
use crate::random::Stream;
use crate::time::{Span, Stamp};
use rand::RngExt;

/// The stage of a fault of this group.
pub(super) fn stage(kind: &FaultKind, stream: &Stream) -> Option<Box<dyn Stage>> {
    Some(match kind {
        FaultKind::Drop { share } => Box::new(Drop { share: *share, stream: stream.clone() }),
        FaultKind::Gap => Box::new(Gap),
        FaultKind::Cut { start_s, end_s } => {
            Box::new(Cut { start: start_s.map(Span::from_seconds), end: end_s.map(Span::from_seconds) })
        }
        FaultKind::Thin { arrivals_s, repeat_s, .. } => {
            Box::new(Thin::new(arrivals_s.as_deref().unwrap_or_default(), *repeat_s))
        }
        _ => return None,
    })
}

/// Messages lost at random.
struct Drop {
    share: f64,
    stream: Stream,
}

impl Stage for Drop {
    fn take(&mut self, message: Message, out: &mut Vec<Message>) {
        if self.stream.random::<f64>() >= self.share {
            out.push(message);
        }
    }
}

/// All messages lost.
struct Gap;

impl Stage for Gap {
    fn take(&mut self, _: Message, _: &mut Vec<Message>) {}
}

/// Messages before the start and after the end lost.
struct Cut {
    start: Option<Span>,
    end: Option<Span>,
}

impl Stage for Cut {
    fn take(&mut self, message: Message, out: &mut Vec<Message>) {
        let t = message.since_start();
        if self.start.is_none_or(|start| t >= start) && self.end.is_none_or(|end| t <= end) {
            out.push(message);
        }
    }
}

/// The messages nearest to given arrival times.
struct Thin {
    arrivals: Vec<Span>,
    repeat: Option<Span>,
    /// How many arrival times are behind.
    next: usize,
    /// The message that waits for the next one, to know which of the two is nearer to an arrival time.
    waiting: Option<Message>,
}

impl Thin {
    fn new(arrivals_s: &[f64], repeat_s: Option<f64>) -> Self {
        let arrivals = arrivals_s.iter().map(|s| Span::from_seconds(*s)).collect();
        Self { arrivals, repeat: repeat_s.map(Span::from_seconds), next: 0, waiting: None }
    }

    /// The next arrival time.
    fn arrival(&self) -> Option<Span> {
        let count = self.arrivals.len().max(1);
        let round = (self.next / count) as i64;
        let offset = match self.repeat {
            Some(repeat) => Span::from_nanos(repeat.nanos().saturating_mul(round)),
            None if round == 0 => Span::ZERO,
            None => return None,
        };
        self.arrivals.get(self.next % count).map(|arrival| *arrival + offset)
    }

    /// Emits the waiting message if an arrival time lies before `until`.
    fn decide(&mut self, until: Span, out: &mut Vec<Message>) {
        let mut is_nearest = false;
        while self.arrival().is_some_and(|arrival| arrival < until) {
            self.next += 1;
            is_nearest = true;
        }
        out.extend(self.waiting.take().filter(|_| is_nearest));
    }
}

impl Stage for Thin {
    fn take(&mut self, message: Message, out: &mut Vec<Message>) {
        if let Some(before) = &self.waiting {
            let (before, now) = (before.since_start(), message.since_start());
            let middle = before + Span::from_nanos((now - before).nanos() / 2);
            self.decide(middle, out);
        }
        self.waiting = Some(message);
    }

    fn pass(&mut self, message: Message, out: &mut Vec<Message>) {
        self.finish(out);
        self.decide(message.since_start(), out);
        out.push(message);
    }

    fn finish(&mut self, out: &mut Vec<Message>) {
        if let Some(last) = &self.waiting {
            // Half a millisecond: an arrival behind that is one of a message that never came.
            let until = last.since_start() + Span::from_nanos(500_000);
            self.decide(until, out);
        }
    }

    fn held(&self) -> Option<Stamp> {
        self.waiting.as_ref().map(|message| message.arrival)
    }
}
