//! Checks that need a program which is not installed everywhere, and the report of those that are skipped.

use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::process::{Command, Output};

/// Exit code of a script that cannot run on this machine; the reason is on its standard error.
const CANNOT_RUN: i32 = 77;

/// Prints `skipped: NAME: reason` and appends the line to the file `ZSIM_SKIPPED`, if the variable is set.
///
/// `.ci/run` sets it, and compares the names with `.ci/allowed-skips`.
pub fn skip(name: &str, reason: &str) {
    let line = format!("skipped: {name}: {reason}\n");
    print!("{line}");
    if let Some(path) = std::env::var_os("ZSIM_SKIPPED") {
        // One write, so that lines of several processes do not mix.
        OpenOptions::new().create(true).append(true).open(path).unwrap().write_all(line.as_bytes()).unwrap();
    }
}

/// Runs a program; `None`, reported as a skipped check, if it is not installed or cannot run on this machine.
pub fn run_or_skip(name: &str, command: &mut Command) -> Option<Output> {
    let output = match command.output() {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            skip(name, &format!("{} is not installed", command.get_program().to_string_lossy()));
            return None;
        }
        output => output.unwrap(),
    };
    if output.status.code() == Some(CANNOT_RUN) {
        skip(name, String::from_utf8_lossy(&output.stderr).trim());
        return None;
    }
    Some(output)
}
