//! Faults of stamps, arrival and order.

use super::FaultKind;
use super::interval::Interval;
use super::stage::{Message, Stage};
use rand::RngExt;
use rand_distr::{Distribution, Exp1};
use zsim_base::random::Stream;
use zsim_base::time::{Span, Stamp};

/// The stage of a fault of this group; `None` for other groups.
pub(super) fn stage(kind: &FaultKind, stream: &Stream, interval: &Interval) -> Option<Box<dyn Stage>> {
    let stream = stream.clone();
    Some(match kind {
        FaultKind::Delay { mean_s } => Box::new(Delay { mean_s: *mean_s, stream, last: None }),
        FaultKind::Burst { size, spacing_us } => {
            Box::new(Burst { size: *size, spacing: Span::from_seconds(1e-6 * spacing_us), waiting: Vec::new() })
        }
        FaultKind::ClockOffset { offset_s } => {
            Box::new(ClockChange { from: Span::from_nanos(i64::MIN), by: Span::from_seconds(*offset_s) })
        }
        FaultKind::ClockJump { jump_s } => {
            Box::new(ClockChange { from: interval.from(), by: Span::from_seconds(*jump_s) })
        }
        FaultKind::Duplicate { share } => Box::new(Duplicate { probability: *share, stream }),
        FaultKind::Reorder { share } => Box::new(Reorder { probability: *share, stream, waiting: None }),
        _ => return None,
    })
}

/// Delays stamps and arrivals, as a queue does.
struct Delay {
    mean_s: f64,
    stream: Stream,
    /// Stamp and arrival of the previous message.
    last: Option<(Stamp, Stamp)>,
}

impl Delay {
    fn deliver(&mut self, mut message: Message, delay: Span, out: &mut Vec<Message>) {
        let (mut stamp, mut arrival) = (message.stamp() + delay, message.arrival + delay);
        if let Some((last_stamp, last_arrival)) = self.last {
            stamp = stamp.max(last_stamp + Span::from_nanos(1));
            arrival = arrival.max(last_arrival);
        }
        self.last = Some((stamp, arrival));
        message.set_stamp(stamp);
        message.arrival = arrival;
        out.push(message);
    }
}

impl Stage for Delay {
    fn take(&mut self, message: Message, out: &mut Vec<Message>) {
        let draw: f64 = Exp1.sample(&mut self.stream);
        self.deliver(message, Span::from_seconds(self.mean_s * draw), out);
    }

    fn pass(&mut self, message: Message, out: &mut Vec<Message>) {
        self.deliver(message, Span::ZERO, out);
    }
}

/// Delivers messages in groups.
struct Burst {
    size: usize,
    spacing: Span,
    waiting: Vec<Message>,
}

impl Stage for Burst {
    fn take(&mut self, message: Message, out: &mut Vec<Message>) {
        self.waiting.push(message);
        if self.waiting.len() >= self.size {
            self.finish(out);
        }
    }

    fn finish(&mut self, out: &mut Vec<Message>) {
        let Some((mut stamp, arrival)) = self.waiting.last().map(|last| (last.stamp(), last.arrival)) else { return };
        for mut message in self.waiting.drain(..) {
            message.set_stamp(stamp);
            message.arrival = arrival;
            stamp += self.spacing;
            out.push(message);
        }
    }

    fn earliest_held(&self) -> Option<Stamp> {
        self.waiting.first().map(|message| message.arrival)
    }
}

/// Adds an offset to the clock from a time on.
struct ClockChange {
    from: Span,
    by: Span,
}

impl Stage for ClockChange {
    fn take(&mut self, mut message: Message, out: &mut Vec<Message>) {
        if message.since_start() >= self.from {
            message.set_stamp(message.stamp() + self.by);
        }
        out.push(message);
    }
}

/// Delivers messages twice.
struct Duplicate {
    probability: f64,
    stream: Stream,
}

impl Stage for Duplicate {
    fn take(&mut self, message: Message, out: &mut Vec<Message>) {
        if self.stream.random::<f64>() < self.probability {
            out.push(message.clone());
        }
        out.push(message);
    }
}

/// Exchanges neighbouring messages.
struct Reorder {
    probability: f64,
    stream: Stream,
    waiting: Option<Message>,
}

impl Stage for Reorder {
    fn take(&mut self, message: Message, out: &mut Vec<Message>) {
        if let Some(mut before) = self.waiting.take() {
            before.arrival = message.arrival;
            out.extend([message, before]);
        } else if self.stream.random::<f64>() < self.probability {
            self.waiting = Some(message);
        } else {
            out.push(message);
        }
    }

    fn finish(&mut self, out: &mut Vec<Message>) {
        out.extend(self.waiting.take());
    }

    fn earliest_held(&self) -> Option<Stamp> {
        self.waiting.as_ref().map(|message| message.arrival)
    }
}
