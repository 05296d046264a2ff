//! What the thread of a run's state and the server share.

use super::run::{LiveRun, PageState};
use super::viewers::Viewers;
use std::path::{Path, PathBuf};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use zsim_report::page::{LiveEnd, LiveVerdict};

/// State of a run and of its pages.
pub(super) struct Shared {
    /// The page, as HTML.
    pub page: String,
    run: Mutex<LiveRun>,
    viewers: Mutex<Viewers>,
    /// The file of the report; `None` until it is complete.
    report: Mutex<Option<PathBuf>>,
    /// Notifies the connections of each change of `run`.
    changed: Condvar,
}

impl Shared {
    pub(super) fn new(page: String, run: LiveRun) -> Self {
        Self {
            page,
            run: Mutex::new(run),
            viewers: Mutex::default(),
            report: Mutex::new(None),
            changed: Condvar::new(),
        }
    }

    /// Changes the state of the run, and notifies the connections.
    pub(super) fn change(&self, change: impl FnOnce(&mut LiveRun)) {
        change(&mut lock(&self.run));
        self.changed.notify_all();
    }

    /// Ends the run with its report, if there is one.
    pub(super) fn end(&self, end: LiveEnd, verdict: Option<LiveVerdict>, report: Option<&Path>) {
        *lock(&self.report) = report.map(Path::to_owned);
        self.change(|run| run.end(end, verdict));
    }

    /// What a page lacks, as JSON, as soon as it lacks something or the run has ended, but after `longest_wait` at the latest.
    pub(super) fn update(&self, page: &PageState, longest_wait: Duration) -> Result<String, serde_json::Error> {
        let has_no_news = |run: &mut LiveRun| !run.is_newer_than(page) && !run.has_ended();
        let waited = self.changed.wait_timeout_while(lock(&self.run), longest_wait, has_no_news);
        let (run, _) = waited.unwrap_or_else(PoisonError::into_inner);
        run.update(page)
    }

    pub(super) fn report(&self) -> Option<PathBuf> {
        lock(&self.report).clone()
    }

    pub(super) fn viewers(&self) -> MutexGuard<'_, Viewers> {
        lock(&self.viewers)
    }
}

/// Locks; a thread that has panicked leaves a state that can still be shown.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
