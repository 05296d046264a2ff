//! Losses and notes of a run: one entry for each kind, with count, first and last time, and the worst case.

use std::collections::BTreeMap;
use zsim_base::time::Stamp;
use zsim_estimation::{Discarded, Warning, WarningKind};
use zsim_recording::ClockStep;
use zsim_report::EventMetrics;

/// Losses and notes of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Events {
    /// Missing or unused measurements, and intervals without an estimate.
    pub losses: Vec<EventMetrics>,
    /// Other information for the user.
    pub notes: Vec<EventMetrics>,
}

impl Events {
    /// Adds a loss without a time.
    pub fn add_loss(&mut self, kind: &str, sentence: String) {
        self.losses.push(EventMetrics { kind: kind.to_owned(), count: 1, sentence, ..EventMetrics::default() });
    }

    /// Adds a note without a time.
    pub fn add_note(&mut self, kind: &str, sentence: String) {
        self.notes.push(EventMetrics { kind: kind.to_owned(), count: 1, sentence, ..EventMetrics::default() });
    }

    /// Adds a note on the steps of the sensors' clocks, with times relative to `start`.
    pub fn add_clock_steps(&mut self, steps: &[ClockStep], start: Stamp) {
        let (Some(largest), Some(sentence)) = (ClockStep::largest(steps), ClockStep::sentence(steps)) else { return };
        // Two sensors of one clock step once.
        let mut counts = BTreeMap::<&str, u64>::new();
        steps.iter().for_each(|step| *counts.entry(&step.topic).or_default() += 1);
        let times_s = || steps.iter().map(|step| step.at.seconds_since(start));
        self.notes.push(EventMetrics {
            kind: "clock_step".to_owned(),
            count: counts.into_values().max().unwrap_or(0),
            first_s: times_s().min_by(f64::total_cmp),
            last_s: times_s().max_by(f64::total_cmp),
            worst: Some(largest.by.seconds().abs()),
            sentence,
        });
    }

    /// Adds the warnings of the estimator, with times relative to `start`.
    pub fn add_warnings(&mut self, warnings: &[Warning], start: Stamp) {
        for Warning { stamp, kind } in warnings {
            let events = if is_loss(kind) { &mut self.losses } else { &mut self.notes };
            add(events, stamp.seconds_since(start), kind);
        }
    }
}

/// Adds one event to the entry of the same kind.
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

/// Whether a warning is a loss: measurements are missing or unused, or there is no estimate for some time.
pub(super) fn is_loss(kind: &WarningKind) -> bool {
    match kind {
        WarningKind::ImuGap { .. }
        | WarningKind::LidarGap { .. }
        | WarningKind::Restarted { .. }
        | WarningKind::NotRelocalised { .. }
        | WarningKind::TooShortToRelocalise { .. }
        | WarningKind::LostInMap
        | WarningKind::Lost { .. } => true,
        WarningKind::Discarded { what, .. } => *what != Discarded::Outliers,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::time::Span;

    #[test]
    fn each_kind_is_one_entry_with_count_first_time_and_worst_case() {
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
