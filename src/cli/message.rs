//! Messages on stderr: the one way to print them.
//!
//! A message that cannot be written is lost, and the command goes on: a terminal that has closed, a pipe without a reader or
//! a full disk must not end a run of hours. `eprintln!` would panic.

use std::io::Write;
use zsim_base::printable::printable;

/// Prints a line, with control characters escaped.
pub(super) fn line(text: &str) {
    // One write per line, so that lines of several processes do not mix.
    let _ = std::io::stderr().lock().write_all(format!("{}\n", printable(text)).as_bytes());
}

/// Prints a note.
pub(super) fn note(text: &str) {
    line(&format!("note: {text}"));
}

/// Prints a warning.
pub(super) fn warning(text: &str) {
    line(&format!("warning: {text}"));
}

/// Prints a loss of data.
pub(super) fn loss(text: &str) {
    line(&format!("loss: {text}"));
}

/// Prints an error.
pub(super) fn error(text: &str) {
    line(&format!("error: {text}"));
}
