//! SIGINT and SIGTERM: the first signal requests a clean stop, the second one ends the process immediately.
//!
//! A command that does not poll the flag is ended by the first signal. Either way the exit code is that of the signal.

use std::sync::Once;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};

/// Set by the first signal.
static STOP: AtomicBool = AtomicBool::new(false);
/// The number of the first signal; 0 before it.
static SIGNAL: AtomicI32 = AtomicI32::new(0);
/// Whether the running command polls [`STOP`].
static IS_POLLED: AtomicBool = AtomicBool::new(false);

/// Exit code of a process that a signal ended, minus the number of the signal, as shells report it.
const BY_SIGNAL: i32 = 128;
/// SIGINT, the signal of Ctrl-C.
const INTERRUPT: i32 = 2;

/// Handles the signals from now on: without this they end the process without an exit code of its own.
pub(super) fn watch() {
    static HANDLER: Once = Once::new();
    HANDLER.call_once(install);
}

/// The flag that SIGINT and SIGTERM set from now on; the caller polls it.
pub(super) fn stop_flag() -> &'static AtomicBool {
    watch();
    IS_POLLED.store(true, Ordering::SeqCst);
    &STOP
}

/// From now on nobody polls the flag: a signal ends the process, also one that has set the flag already.
pub(super) fn end_polling() {
    IS_POLLED.store(false, Ordering::SeqCst);
    if STOP.load(Ordering::SeqCst) {
        std::process::exit(i32::from(exit_code()));
    }
}

/// The exit code of a run that was stopped: 130 after SIGINT, 143 after SIGTERM.
pub(super) fn exit_code() -> u8 {
    // When a worker received the signal, the run stops without a signal of its own.
    let signal = Some(SIGNAL.load(Ordering::Relaxed)).filter(|signal| *signal != 0).unwrap_or(INTERRUPT);
    u8::try_from(BY_SIGNAL + signal).unwrap_or(u8::MAX)
}

fn stop_by(signal: i32) {
    if STOP.load(Ordering::SeqCst) || !IS_POLLED.load(Ordering::SeqCst) {
        std::process::exit(BY_SIGNAL + signal);
    }
    SIGNAL.store(signal, Ordering::SeqCst);
    STOP.store(true, Ordering::SeqCst);
    // The command may have stopped polling in the meantime.
    if !IS_POLLED.load(Ordering::SeqCst) {
        std::process::exit(BY_SIGNAL + signal);
    }
}

/// Without the handlers a signal ends the program at once, which files survive too.
#[cfg(unix)]
fn install() {
    use signal_hook::consts::{SIGINT, SIGTERM};
    if let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGINT, SIGTERM]) {
        std::thread::spawn(move || signals.forever().for_each(stop_by));
    }
}

/// Without the handler Ctrl-C ends the program at once, which files survive too.
#[cfg(not(unix))]
fn install() {
    let _ = ctrlc::set_handler(|| stop_by(INTERRUPT));
}
