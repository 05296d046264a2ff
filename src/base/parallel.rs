//! Work on several threads: its progress, and the request to stop.
//!
//! These threads do not take over other work while they wait, as those of rayon do: what one piece takes can be limited.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Progress callback with the completed fraction, 0 to 1; it is called from worker threads.
pub type OnProgress<'a> = &'a (dyn Fn(f64) + Sync);

/// The work was stopped on request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("stopped; completed files can be read")]
pub struct Stopped;

/// Fails if the work is to stop.
///
/// # Errors
/// If `stop` is set.
pub fn check(stop: &AtomicBool) -> Result<(), Stopped> {
    if stop.load(Ordering::Relaxed) { Err(Stopped) } else { Ok(()) }
}

/// Progress of work in equal pieces that threads complete in any order.
pub struct PieceProgress<'a> {
    total: usize,
    done: AtomicUsize,
    on_progress: OnProgress<'a>,
}

impl<'a> PieceProgress<'a> {
    /// Creates the progress of `total` pieces.
    pub fn new(total: usize, on_progress: OnProgress<'a>) -> Self {
        Self { total, done: AtomicUsize::new(0), on_progress }
    }

    /// Counts one completed piece and reports the progress.
    pub fn finish_one(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        (self.on_progress)(done as f64 / self.total.max(1) as f64);
    }
}

/// Does `work` for the indices from 0 to `count` on `threads` threads; its arguments are the thread and the index.
///
/// # Errors
/// The first error of a thread; the other threads finish their work.
pub fn for_each_on_threads<E: Send>(
    count: usize,
    threads: usize,
    work: impl Fn(usize, usize) -> Result<(), E> + Sync,
) -> Result<(), E> {
    let next = AtomicUsize::new(0);
    let work_on = |thread: usize| {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= count {
                return Ok(());
            }
            work(thread, index)?;
        }
    };
    std::thread::scope(|scope| {
        let work_on = &work_on;
        let threads: Vec<_> = (0..threads.min(count)).map(|thread| scope.spawn(move || work_on(thread))).collect();
        threads.into_iter().try_for_each(|thread| match thread.join() {
            Ok(result) => result,
            Err(panic) => std::panic::resume_unwind(panic),
        })
    })
}
