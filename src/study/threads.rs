//! Work on threads of its own, which do not take over other work while they wait, as those of rayon do: what one
//! piece takes can be limited.

use std::sync::atomic::{AtomicUsize, Ordering};

/// Does `work` for the indices from 0 to `count` on `threads` threads; its arguments are the thread and the index.
///
/// # Errors
/// The first error of a thread; the other threads finish their work.
pub(super) fn for_each_on_threads<E: Send>(
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
