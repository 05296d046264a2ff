//! Runs zsim with `--live`.

use std::io::{BufRead, BufReader};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Runs as a script if the page does not escape it.
pub const HOSTILE: &str = "<script>window.hostile=1</script>";

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

/// A scene with a hostile name in `folder`.
pub fn hostile_scene(folder: &Path) -> PathBuf {
    let office = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/office.ron")).unwrap();
    let scene = folder.join("hostile.ron");
    std::fs::write(&scene, office.replacen("name: \"office\"", &format!("name: \"{HOSTILE}\""), 1)).unwrap();
    scene
}
