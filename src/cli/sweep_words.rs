//! A sweep in words.

use zsim::report;
use zsim::study::sweep::{Sweep, SweepStatus};

/// Summary of a plan.
pub(super) fn plan_words(sweep: &Sweep) -> String {
    format!("{} runs in {} tasks", sweep.plan().points(), sweep.tasks())
}

/// Progress of a sweep.
pub(super) fn status_words(status: &SweepStatus) -> String {
    let mut rows = vec![
        ("runs", status.points.to_string()),
        ("done", status.done.to_string()),
        ("failed among them", status.failed.to_string()),
        ("missing", status.missing.to_string()),
    ];
    if status.damaged > 0 {
        rows.push(("damaged among them", status.damaged.to_string()));
    }
    let left = status.thread_s_left.filter(|_| status.missing > 0);
    rows.extend(left.map(|seconds| ("remaining, on one thread", duration(seconds))));
    let rows: Vec<Vec<String>> = rows.into_iter().map(|(name, value)| vec![name.to_owned(), value]).collect();
    report::table(&[], &rows, true)
}

/// A duration in readable units.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}
