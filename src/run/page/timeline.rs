//! The timeline of events.

use crate::open_loop::OpenLoopRun;
use std::cmp::Reverse;
use std::collections::BTreeMap;
use zsim_estimation::Event;
use zsim_report::page::{Interval, TimelineRow};

/// Windows with the same problem within this time are one event, s.
const MERGED_WITHIN_S: f64 = 0.5;

/// Lists the events of a run, one row for each kind, most severe first.
///
/// They are the causes of the status, the warnings of the estimator, and the problems of the windows.
pub(super) fn rows(run: &OpenLoopRun, causes: &[Event]) -> Vec<TimelineRow> {
    let problems =
        run.estimate.windows.iter().filter_map(|window| Some(Event::at(window.stamp, window.problem.clone()?)));
    let mut rows: BTreeMap<_, Vec<Interval>> = BTreeMap::new();
    for event in causes.iter().chain(&run.estimate.warnings).cloned().chain(problems) {
        let [from_s, to_s] = [event.from, event.to].map(|stamp| stamp.seconds_since(run.recorded.0));
        let row = rows.entry((Reverse(event.severity), in_words(event.kind.key()))).or_default();
        row.push(Interval { from_s, to_s, sentence: event.kind.to_string() });
    }
    let row = |((Reverse(severity), name), events)| TimelineRow { name, severity, events: merged(events) };
    rows.into_iter().map(row).collect()
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
