//! Text output of `zsim sweep`.
use zsim_study::sweep::{Sweep, SweepStatus};

/// Summary of a plan.
pub(super) fn plan_text(sweep: &Sweep) -> String {
    format!("{} runs in {} tasks", sweep.plan().runs(), sweep.jobs())
}

/// Progress of a sweep.
pub(super) fn status_text(status: &SweepStatus) -> String {
    let mut rows = vec![
        ("runs", status.points.to_string()),
        ("completed", status.done.to_string()),
        ("failed", status.failed.to_string()),
        ("missing", status.missing.to_string()),
    ];
    if status.damaged > 0 {
        rows.push(("damaged", status.damaged.to_string()));
    }
    let remaining = status.thread_s_left.filter(|_| status.missing > 0);
    rows.extend(remaining.map(|seconds| ("remaining time, one thread", duration(seconds))));
    let rows: Vec<Vec<String>> = rows.into_iter().map(|(name, value)| vec![name.to_owned(), value]).collect();
    zsim_report::table(&[], &rows, true)
}

/// A duration in readable units.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}
