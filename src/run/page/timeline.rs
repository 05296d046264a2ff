//! The timeline of events.

use crate::events::is_loss;
use crate::open_loop::OpenLoopRun;
use std::collections::BTreeMap;
use zsim_base::time::Stamp;
use zsim_estimation::{Warning, WarningKind};
use zsim_report::CauseMetrics;
use zsim_report::page::{Interval, Level, TimelineRow};

/// Windows with the same problem within this time are one event, s.
const MERGED_WITHIN_S: f64 = 0.5;

/// Causes of the status, warnings of the estimator and windows with a problem, one row for each kind; most severe first.
pub(super) fn rows(run: &OpenLoopRun, causes: &[CauseMetrics]) -> Vec<TimelineRow> {
    let start = run.recorded.0;
    let mut rows: BTreeMap<(Level, String), Vec<Interval>> = BTreeMap::new();
    for cause in causes {
        let level = if cause.status == "lost" { Level::Lost } else { Level::Degraded };
        let interval = Interval { from_s: cause.from_s, to_s: cause.to_s, sentence: cause.sentence.clone() };
        rows.entry((level, in_words(&cause.kind))).or_default().push(interval);
    }
    for Warning { stamp, kind } in &run.warnings {
        add(&mut rows, kind, interval(*stamp, kind, start));
    }
    for window in &run.windows {
        let Some(kind) = &window.problem else { continue };
        add(&mut rows, kind, interval(window.stamp, kind, start));
    }
    let row = |((level, name), events)| TimelineRow { name, level, events: merged(events) };
    rows.into_iter().map(row).collect()
}

fn add(rows: &mut BTreeMap<(Level, String), Vec<Interval>>, kind: &WarningKind, interval: Interval) {
    let level = if is_loss(kind) { Level::Loss } else { Level::Note };
    rows.entry((level, in_words(kind.name()))).or_default().push(interval);
}

/// The interval of a warning: an IMU gap starts at its stamp; other events have no duration, and repeat while they last.
fn interval(stamp: Stamp, kind: &WarningKind, start: Stamp) -> Interval {
    let at_s = stamp.seconds_since(start);
    let lasts_s = match kind {
        WarningKind::ImuGap { seconds } | WarningKind::Restarted { seconds } => *seconds,
        _ => 0.0,
    };
    Interval { from_s: at_s, to_s: at_s + lasts_s, sentence: kind.to_string() }
}

/// Merges events that follow each other.
fn merged(mut events: Vec<Interval>) -> Vec<Interval> {
    events.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
    let mut merged: Vec<Interval> = Vec::new();
    for event in events {
        match merged.last_mut().filter(|last| event.from_s - last.to_s < MERGED_WITHIN_S) {
            Some(last) => last.to_s = last.to_s.max(event.to_s),
            None => merged.push(event),
        }
    }
    merged
}

/// The key of a kind in words.
fn in_words(kind: &str) -> String {
    kind.replace('_', " ").replace("imu", "IMU")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_that_follow_each_other_are_one() {
        let event = |from_s: f64, to_s: f64| Interval { from_s, to_s, sentence: String::new() };
        let events = merged(vec![event(2.0, 2.0), event(1.0, 1.2), event(1.6, 1.6), event(9.0, 9.5)]);
        let spans: Vec<(f64, f64)> = events.iter().map(|event| (event.from_s, event.to_s)).collect();
        assert_eq!(spans, [(1.0, 2.0), (9.0, 9.5)]);
    }
}
