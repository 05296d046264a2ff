//! Runs the zsim command.

use std::path::Path;
use std::process::{Command, Stdio};

/// Returns the zsim command, without arguments and without standard input.
pub fn zsim() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_zsim"));
    command.stdin(Stdio::null());
    command
}

/// Runs `command`, asserts its exit code, and returns stdout and stderr.
pub fn exits_with(code: i32, command: &mut Command) -> (String, String) {
    let output = command.output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    let (stdout, stderr) = (text(output.stdout), text(output.stderr));
    assert_eq!(output.status.code(), Some(code), "{command:?}\n{stdout}\n{stderr}");
    (stdout, stderr)
}

/// Runs zsim in `folder`; returns exit code (-1 if it was killed), stdout and stderr.
pub fn run(folder: &Path, arguments: &str) -> (i32, String, String) {
    let output = zsim().current_dir(folder).args(arguments.split_whitespace()).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap_or(-1), text(output.stdout), text(output.stderr))
}
