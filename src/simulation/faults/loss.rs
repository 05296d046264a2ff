//! Faults that lose messages.

use super::FaultKind;
use super::stage::{Message, Stage};
use rand::RngExt;
use zsim_base::random::Stream;
use zsim_base::time::{Span, Stamp};

/// The stage of a fault of this group; `None` for other groups.
pub(super) fn stage(kind: &FaultKind, stream: &Stream) -> Option<Box<dyn Stage>> {
    Some(match kind {
        FaultKind::Drop { share } => Box::new(Drop { probability: *share, stream: stream.clone() }),
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

/// Loses messages at random.
struct Drop {
    probability: f64,
    stream: Stream,
}

impl Stage for Drop {
    fn take(&mut self, message: Message, out: &mut Vec<Message>) {
        if self.stream.random::<f64>() >= self.probability {
            out.push(message);
        }
    }
}

/// Loses all messages.
struct Gap;

impl Stage for Gap {
    fn take(&mut self, _: Message, _: &mut Vec<Message>) {}
}

/// Loses messages before the start and after the end.
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

/// Keeps the messages nearest to given arrival times.
struct Thin {
    arrivals: Vec<Span>,
    repeat: Option<Span>,
    /// Number of arrival times that have passed.
    next: usize,
    /// The last message, which waits for the next one to decide which is nearer to an arrival time.
    pending: Option<Message>,
}

impl Thin {
    fn new(arrivals_s: &[f64], repeat_s: Option<f64>) -> Self {
        let arrivals = arrivals_s.iter().map(|s| Span::from_seconds(*s)).collect();
        Self { arrivals, repeat: repeat_s.map(Span::from_seconds), next: 0, pending: None }
    }

    /// The next arrival time.
    fn next_arrival(&self) -> Option<Span> {
        let count = self.arrivals.len().max(1);
        let round = (self.next / count) as i64;
        let offset = match self.repeat {
            Some(repeat) => Span::from_nanos(repeat.nanos().saturating_mul(round)),
            None if round == 0 => Span::ZERO,
            None => return None,
        };
        self.arrivals.get(self.next % count).map(|arrival| *arrival + offset)
    }

    /// Emits the pending message if there is an arrival time before `until`.
    fn resolve(&mut self, until: Span, out: &mut Vec<Message>) {
        let mut is_nearest = false;
        while self.next_arrival().is_some_and(|arrival| arrival < until) {
            self.next += 1;
            is_nearest = true;
        }
        out.extend(self.pending.take().filter(|_| is_nearest));
    }
}

impl Stage for Thin {
    fn take(&mut self, message: Message, out: &mut Vec<Message>) {
        if let Some(before) = &self.pending {
            let (before, now) = (before.since_start(), message.since_start());
            let middle = before + Span::from_nanos((now - before).nanos() / 2);
            self.resolve(middle, out);
        }
        self.pending = Some(message);
    }

    fn pass(&mut self, message: Message, out: &mut Vec<Message>) {
        self.finish(out);
        self.resolve(message.since_start(), out);
        out.push(message);
    }

    fn finish(&mut self, out: &mut Vec<Message>) {
        if let Some(last) = &self.pending {
            // Half a millisecond: a later arrival time belongs to a message that does not exist.
            let until = last.since_start() + Span::from_nanos(500_000);
            self.resolve(until, out);
        }
    }

    fn earliest_held(&self) -> Option<Stamp> {
        self.pending.as_ref().map(|message| message.arrival)
    }
}
