//! Runs zsim with `--live`.

use std::io::{BufRead, BufReader};
use std::net::SocketAddr;
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// A run with `--live`.
pub struct LiveRun {
    pub child: Child,
    pub address: SocketAddr,
}

impl LiveRun {
    /// Starts zsim in `folder` and reads the address of the page from stderr.
    pub fn start(folder: &Path, arguments: &str) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_zsim"));
        command.current_dir(folder).args(arguments.split_whitespace());
        let mut child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
        let line = lines.find(|line| line.starts_with("live: ")).unwrap();
        let address = line.strip_prefix("live: http://").unwrap().trim_end_matches('/').parse().unwrap();
        std::thread::spawn(move || lines.count());
        Self { child, address }
    }

    /// Waits for the end of the process; returns its exit code.
    pub fn exit_code(mut self) -> i32 {
        self.child.wait().unwrap().code().unwrap()
    }
}
