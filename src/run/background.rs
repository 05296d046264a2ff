//! Two computations at the same time.

use std::thread;

/// Runs `background` on a thread of its own while `foreground` runs, if more than one thread is available.
pub(super) fn with_background<A: Send, B>(
    background: impl FnOnce() -> A + Send,
    foreground: impl FnOnce() -> B,
) -> (A, B) {
    if rayon::current_num_threads() < 2 {
        let result = foreground();
        return (background(), result);
    }
    thread::scope(|scope| {
        let running = scope.spawn(background);
        let result = foreground();
        (running.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)), result)
    })
}
