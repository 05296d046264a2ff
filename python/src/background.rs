//! Runs a computation on another thread, without the interpreter's lock, with progress and Ctrl-C.

use crate::failure::{Error, Failure};
use pyo3::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;
use zsim::run::{ProgressMonitor, RunEvent, Stage};

/// Interval between two checks for Ctrl-C, and between two reports of progress.
const POLL: Duration = Duration::from_millis(50);

/// How long an interrupted computation may take to close its files.
const GRACE: Duration = Duration::from_secs(5);

/// Stack of the computation, bytes: that of a main thread on Linux.
const STACK_BYTES: usize = 8 << 20;

/// Progress of a computation, and the request to stop it.
#[derive(Default)]
pub struct Progress {
    stop: AtomicBool,
    latest: Mutex<Option<(&'static str, f64)>>,
    notes: Mutex<Vec<String>>,
}

impl Progress {
    /// The flag that a computation of the library checks.
    pub fn stop_flag(&self) -> &AtomicBool {
        &self.stop
    }

    /// Sets the finished fraction of a stage.
    pub fn set(&self, stage: &'static str, fraction: f64) {
        *self.latest.lock().unwrap_or_else(PoisonError::into_inner) = Some((stage, fraction));
    }

    /// Runs `work` with a monitor that reports here.
    pub fn monitored<T>(&self, work: impl FnOnce(&mut ProgressMonitor) -> T) -> T {
        let mut report = |event: RunEvent| match event {
            RunEvent::Progress { stage, fraction: Some(fraction), .. } => self.set(stage_name(stage), fraction),
            RunEvent::Note(note) => {
                self.notes.lock().unwrap_or_else(PoisonError::into_inner).push(note.to_owned());
            }
            _ => {}
        };
        work(&mut ProgressMonitor { stop: &self.stop, report: &mut report })
    }

    /// Passes new progress to `callback`, and new notes to the logger `zsim`.
    fn report(&self, py: Python<'_>, callback: Option<&Py<PyAny>>) -> PyResult<()> {
        let latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let (Some((stage, fraction)), Some(callback)) = (latest, callback) {
            callback.call1(py, (stage, fraction))?;
        }
        let notes = std::mem::take(&mut *self.notes.lock().unwrap_or_else(PoisonError::into_inner));
        if notes.is_empty() {
            return Ok(());
        }
        let logger = py.import("logging")?.call_method1("getLogger", ("zsim",))?;
        notes.iter().try_for_each(|note| logger.call_method1("info", ("%s", note)).map(|_| ()))
    }
}

fn stage_name(stage: Stage) -> &'static str {
    match stage {
        Stage::Simulating => "simulating",
        Stage::Estimating => "estimating",
        Stage::ClosingLoops => "closing loops",
        Stage::Evaluating => "evaluating",
        Stage::Registering => "registering",
        Stage::Bounding => "bounding",
        Stage::Reporting => "reporting",
    }
}

/// Runs `work` and returns its result; `callback(stage, fraction)` receives the progress.
///
/// # Errors
/// That of `work`; that of `callback`; `KeyboardInterrupt` after Ctrl-C. A computation that does not stop in time then
/// ends in the background.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    callback: Option<&Py<PyAny>>,
    work: impl FnOnce(&Progress) -> Result<T, Failure> + Send + 'static,
) -> Result<T, Failure> {
    let progress = Arc::new(Progress::default());
    let (sender, receiver) = sync_channel(1);
    let of_worker = Arc::clone(&progress);
    let worker = thread::Builder::new().name("zsim".to_owned()).stack_size(STACK_BYTES);
    worker
        .spawn(move || {
            // Without a receiver, the caller was interrupted and needs no result.
            let _ = sender.send(work(&of_worker));
        })
        .map_err(|error| Failure::other(format!("cannot start a thread: {error}")))?;
    let receiver = Mutex::new(receiver);
    loop {
        match py.detach(|| wait(&receiver, POLL)) {
            Ok(result) => {
                progress.report(py, callback)?;
                return result;
            }
            Err(RecvTimeoutError::Disconnected) => {
                let message = "the computation panicked; please report the message above";
                return Err(Error::new_err(message).into());
            }
            Err(RecvTimeoutError::Timeout) => {
                if let Err(error) = py.check_signals().and_then(|()| progress.report(py, callback)) {
                    progress.stop.store(true, Ordering::Relaxed);
                    // The result of an interrupted computation is not needed.
                    let _ = py.detach(|| wait(&receiver, GRACE));
                    return Err(error.into());
                }
            }
        }
    }
}

/// Waits for the next item.
pub fn wait<T>(receiver: &Mutex<Receiver<T>>, at_most: Duration) -> Result<T, RecvTimeoutError> {
    receiver.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(at_most)
}

/// Waits for the next item of a thread, and meanwhile checks for Ctrl-C; `None` when the thread has ended.
pub fn next<T: Send>(py: Python<'_>, receiver: &Mutex<Receiver<T>>) -> PyResult<Option<T>> {
    loop {
        match py.detach(|| wait(receiver, POLL)) {
            Ok(item) => return Ok(Some(item)),
            Err(RecvTimeoutError::Disconnected) => return Ok(None),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
        }
    }
}
