//! The program `zsim-ros2`, as a child process.

use super::frame::Frame;
use crate::usage::Usage;
use anyhow::Context;
use std::io::{BufReader, BufWriter};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;

/// The program's name.
const PROGRAM: &str = "zsim-ros2";
/// Frames that wait until they are used: some seconds of both sensors.
const WAITING_FRAMES: usize = 4096;

/// A connection to DDS.
pub(super) struct Bridge {
    child: Child,
    /// Closed at the end.
    input: Option<BufWriter<ChildStdin>>,
    frames: Receiver<std::io::Result<Frame>>,
}

impl Bridge {
    /// Starts the program, which joins `domain` and is announced to the `peers`.
    pub(super) fn start(domain: u16, peers: &[String]) -> anyhow::Result<Self> {
        let path = program()?;
        let mut command = Command::new(&path);
        command.arg(domain.to_string()).args(peers).stdin(Stdio::piped()).stdout(Stdio::piped());
        // Ctrl-C is for zsim, which ends the connection when it has published everything.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn().with_context(|| format!("{} cannot be started", path.display()))?;
        let input = child.stdin.take().map(BufWriter::new);
        let output = child.stdout.take().context("zsim-ros2 has no output")?;
        let (sender, frames) = sync_channel(WAITING_FRAMES);
        std::thread::Builder::new().name("dds".to_owned()).spawn(move || {
            let mut output = BufReader::new(output);
            while let Some(frame) = Frame::read(&mut output).transpose() {
                let failed = frame.is_err();
                if sender.send(frame).is_err() || failed {
                    break;
                }
            }
        })?;
        Ok(Self { child, input, frames })
    }

    /// Sends a frame to the program.
    pub(super) fn send(&mut self, frame: &Frame) -> anyhow::Result<()> {
        let input = self.input.as_mut().context("the connection to DDS has ended")?;
        frame.write(input).context("zsim-ros2 has ended")
    }

    /// The next frame from the program; `None` if there is none for `timeout`.
    pub(super) fn receive(&mut self, timeout: Duration) -> anyhow::Result<Option<Frame>> {
        match self.frames.recv_timeout(timeout) {
            Ok(frame) => Ok(Some(frame.context("zsim-ros2")?)),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => {
                let status = self.child.wait()?;
                anyhow::bail!("zsim-ros2 has ended ({status}); its own message is above")
            }
        }
    }

    /// Ends the connection when everything is delivered.
    pub(super) fn finish(mut self) -> anyhow::Result<()> {
        self.input = None;
        let status = self.child.wait()?;
        anyhow::ensure!(status.success(), "zsim-ros2 has ended ({status}); its own message is above");
        Ok(())
    }
}

impl Drop for Bridge {
    fn drop(&mut self) {
        // The end of its input ends the program; it is not waited for after an error.
        self.input = None;
    }
}

/// The program in the folder of zsim, else one of that name on the path.
fn program() -> anyhow::Result<PathBuf> {
    let name = format!("{PROGRAM}{}", std::env::consts::EXE_SUFFIX);
    let in_folder = std::env::current_exe()?.with_file_name(&name);
    let on_path =
        std::env::var_os("PATH").into_iter().flat_map(|path| std::env::split_paths(&path).collect::<Vec<_>>());
    let mut candidates = std::iter::once(in_folder).chain(on_path.map(|folder| folder.join(&name)));
    let found = candidates.find(|path| path.is_file()).ok_or_else(|| {
        Usage(format!(
            "`{PROGRAM}`, which connects zsim to ROS 2, is neither in the folder of zsim nor on the path: it is in the \
             archives of releases, and `cargo build --release --package {PROGRAM}` builds it"
        ))
    })?;
    Ok(found)
}
