//! What the estimator and the recording report, each kind once with its count, its first and its worst.

use crate::estimation::{LeftOut, Warning, WarningKind};
use crate::report::EventMetrics;
use crate::time::Stamp;

/// Losses and notes of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Events {
    /// Measurements that are missing or were not used, and stretches without an estimate.
    pub losses: Vec<EventMetrics>,
    /// What a user should know besides.
    pub notes: Vec<EventMetrics>,
}

impl Events {
    /// A loss that has no time: a sentence of its own.
    pub fn lose(&mut self, kind: &str, sentence: String) {
        self.losses.push(EventMetrics { kind: kind.to_owned(), count: 1, sentence, ..EventMetrics::default() });
    }

    /// A note that has no time.
    pub fn note(&mut self, kind: &str, sentence: String) {
        self.notes.push(EventMetrics { kind: kind.to_owned(), count: 1, sentence, ..EventMetrics::default() });
    }

    /// Adds what the estimator reported, times counting from `start`.
    pub fn add_warnings(&mut self, warnings: &[Warning], start: Stamp) {
        for Warning { stamp, kind } in warnings {
            let events = if is_loss(kind) { &mut self.losses } else { &mut self.notes };
            add(events, stamp.seconds_since(start), kind);
        }
    }
}

/// Adds one event to those of its kind.
fn add(events: &mut Vec<EventMetrics>, at_s: f64, kind: &WarningKind) {
    let (name, size) = (kind.name(), kind.size());
    let Some(event) = events.iter_mut().find(|event| event.kind == name) else {
        let (first_s, last_s) = (Some(at_s), Some(at_s));
        let (kind, sentence) = (name.to_owned(), kind.to_string());
        events.push(EventMetrics { kind, count: 1, first_s, last_s, worst: size, sentence });
        return;
    };
    event.count += 1;
    event.first_s = event.first_s.map(|first_s| first_s.min(at_s));
    event.last_s = event.last_s.map(|last_s| last_s.max(at_s));
    if size > event.worst {
        (event.worst, event.sentence) = (size, kind.to_string());
    }
}

/// Whether a warning says that measurements are missing or were not used, or that the estimate is: a result with loss.
fn is_loss(kind: &WarningKind) -> bool {
    match kind {
        WarningKind::ImuGap { .. }
        | WarningKind::LidarGap { .. }
        | WarningKind::BeganAgain { .. }
        | WarningKind::LostAgain { .. }
        | WarningKind::LostInMap
        | WarningKind::Lost { .. } => true,
        WarningKind::LeftOut { what, .. } => *what != LeftOut::Outliers,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Span;

    #[test]
    fn each_kind_is_stated_once_with_its_count_its_first_and_its_worst() {
        let start = Stamp::from_nanos(5_000_000_000);
        let gap = |at_s: f64, seconds: f64| Warning {
            stamp: start + Span::from_seconds(at_s),
            kind: WarningKind::ImuGap { seconds },
        };
        let moved = Warning { stamp: start, kind: WarningKind::StartedInMotion };
        let mut events = Events::default();
        events.add_warnings(&[gap(3.0, 0.1), moved, gap(1.0, 0.3), gap(9.0, 0.2)], start);
        let [loss] = &events.losses[..] else { panic!("{events:?}") };
        assert_eq!((loss.kind.as_str(), loss.count, loss.worst), ("imu_gap", 3, Some(0.3)));
        assert_eq!((loss.first_s, loss.last_s), (Some(1.0), Some(9.0)));
        assert!(loss.sentence.contains("0.300 s"), "{}", loss.sentence);
        assert_eq!(events.notes.len(), 1);
    }
}
