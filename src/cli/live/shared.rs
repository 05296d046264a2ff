//! What the thread of a run's state and the server share.

use super::run::{LiveRun, PageState};
use super::viewers::Viewers;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tokio::sync::watch;
use zsim_report::page::{LiveEnd, LiveVerdict};

/// State of a run and of its pages.
pub(super) struct Shared {
    /// The page, as HTML.
    pub page: String,
    run: Mutex<LiveRun>,
    viewers: Mutex<Viewers>,
    /// The file of the report; `None` until it is complete.
    report: Mutex<Option<PathBuf>>,
    /// Notifies the server of each change of `run`.
    changes: watch::Sender<()>,
}

impl Shared {
    pub(super) fn new(page: String, run: LiveRun) -> Self {
        let (changes, _) = watch::channel(());
        Self { page, run: Mutex::new(run), viewers: Mutex::default(), report: Mutex::new(None), changes }
    }

    /// Changes the state of the run, and notifies the server.
    pub(super) fn change(&self, change: impl FnOnce(&mut LiveRun)) {
        change(&mut lock(&self.run));
        self.changes.send_replace(());
    }

    /// Ends the run with its report, if there is one.
    pub(super) fn end(&self, end: LiveEnd, verdict: Option<LiveVerdict>, report: Option<&Path>) {
        *lock(&self.report) = report.map(Path::to_owned);
        self.change(|run| run.end(end, verdict));
    }

    /// A receiver of the changes from now on.
    pub(super) fn changes(&self) -> watch::Receiver<()> {
        self.changes.subscribe()
    }

    /// What a page lacks, as JSON; `None` if it lacks nothing and `wants_news`.
    pub(super) fn update(&self, page: &PageState, wants_news: bool) -> Option<Result<String, serde_json::Error>> {
        let run = lock(&self.run);
        (!wants_news || run.is_newer_than(page) || run.has_ended()).then(|| run.update(page))
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
