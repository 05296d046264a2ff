//! Runs the zsim command.

use assert_cmd::Command;
use std::path::Path;

/// Runs zsim in `folder`; returns exit code (-1 if it was killed), stdout and stderr.
pub fn run(folder: &Path, arguments: &str) -> (i32, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_zsim"));
    let output = command.current_dir(folder).args(arguments.split_whitespace()).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap_or(-1), text(output.stdout), text(output.stderr))
}
