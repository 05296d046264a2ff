//! Supervision of a worker process that does a job.

use super::Sweep;
use super::job::WorkerMessage;
use crate::StudyError;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};
use zsim_base::files::FileError;
use zsim_base::parallel::{OnProgress, PieceProgress, Stopped};
use zsim_run::RunError;

/// Interval at which the stop flag and the time limit are polled.
const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// Grace period over the time limit: fraction of the limit, and seconds. A worker stops an overlong run itself; one that
/// does not is killed after the grace period.
const GRACE_PERIOD: (f64, f64) = (0.5, 10.0);
/// Maximum length of a worker's stderr that is read for the error message, bytes.
const MAX_STDERR_BYTES: u64 = 4096;

/// Messages on stderr of a process that is out of memory: of the allocator, of the system, of thread creation.
const OUT_OF_MEMORY: [&str; 3] = ["memory allocation of", "Cannot allocate memory", "failed to spawn thread"];

/// Execution options of a sweep.
#[derive(Clone, Copy)]
pub struct Runner<'a> {
    /// Path of the `zsim` executable: journeys run in worker processes.
    pub program: &'a Path,
    /// Stop flag, set by the caller.
    pub stop: &'a AtomicBool,
    /// Receives the finished fraction of the missing runs.
    pub on_progress: OnProgress<'a>,
}

/// A job for a worker process.
pub(super) struct Worker<'a> {
    pub sweep: &'a Sweep,
    pub job: usize,
    pub runner: &'a Runner<'a>,
    /// Set when another job has failed.
    pub failed: &'a AtomicBool,
    pub pieces: &'a PieceProgress<'a>,
}

/// How a worker process ended.
#[derive(Debug, PartialEq)]
pub(super) enum WorkerExit {
    /// All runs are finished.
    Done,
    /// The process crashed or was killed; `started` are the batches that had started but not finished.
    Crashed { started: Vec<usize>, reason: String },
}

impl Worker<'_> {
    /// Starts a worker process with `threads` threads and waits for its end.
    pub fn attempt(&self, threads: usize) -> Result<WorkerExit, StudyError> {
        let failed = |error: std::io::Error| FileError::at(self.runner.program)(error);
        let mut stderr = tempfile::tempfile().map_err(failed)?;
        let mut child = Command::new(self.runner.program)
            .args(["sweep", "task", "--quiet", "--threads", &threads.to_string(), "--task", &self.job.to_string()])
            .arg(&self.sweep.folder)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(stderr.try_clone().map_err(failed)?)
            .spawn()
            .map_err(failed)?;
        let stdout = child.stdout.take();
        let mut started = BTreeSet::new();
        let too_long = std::thread::scope(|scope| {
            let (sender, receiver) = channel();
            scope.spawn(move || {
                let lines = stdout.map(|stdout: ChildStdout| BufReader::new(stdout).lines());
                for message in
                    lines.into_iter().flatten().map_while(Result::ok).filter_map(|line| WorkerMessage::parse(&line))
                {
                    if sender.send(message).is_err() {
                        return;
                    }
                }
            });
            self.supervise(&mut child, &receiver, &mut started)
        });
        let status = child.wait().map_err(failed)?;
        if self.is_stopped() {
            return Err(Stopped.into());
        }
        if status.success() {
            return Ok(WorkerExit::Done);
        }
        let text = stderr_tail(&mut stderr).map_err(failed)?;
        let started = started.into_iter().collect();
        self.crash_reason(status, too_long, &text).map(|reason| WorkerExit::Crashed { started, reason })
    }

    /// Receives messages until the process closes its stdout; returns whether it was killed for exceeding the time limit.
    fn supervise(&self, child: &mut Child, messages: &Receiver<WorkerMessage>, started: &mut BTreeSet<usize>) -> bool {
        let limit_s = self.sweep.plan.limit().map_or(f64::INFINITY, |limit| limit.time_s);
        let timeout_s = limit_s * (1.0 + GRACE_PERIOD.0) + GRACE_PERIOD.1;
        let mut since = Instant::now();
        let mut too_long = false;
        loop {
            match messages.recv_timeout(POLL_INTERVAL) {
                Ok(WorkerMessage::Begin(batch)) => {
                    started.insert(batch);
                    since = Instant::now();
                }
                Ok(WorkerMessage::Done(batch)) => {
                    started.remove(&batch);
                    since = Instant::now();
                    self.pieces.finish_one();
                }
                Err(RecvTimeoutError::Disconnected) => return too_long,
                Err(RecvTimeoutError::Timeout) => {
                    too_long |= since.elapsed().as_secs_f64() > timeout_s;
                    if too_long || self.is_stopped() {
                        // Fails only if the process has ended already.
                        let _ = child.kill();
                    }
                }
            }
        }
    }

    fn is_stopped(&self) -> bool {
        self.runner.stop.load(Ordering::Relaxed) || self.failed.load(Ordering::Relaxed)
    }

    /// Reason of a crash that a run caused; an error for any other cause.
    fn crash_reason(&self, status: ExitStatus, too_long: bool, stderr: &str) -> Result<String, StudyError> {
        let limit = self.sweep.plan.limit();
        if let (true, Some(limit)) = (too_long, limit) {
            return Ok(RunError::TooLong { time_s: limit.time_s }.to_string());
        }
        let is_out_of_memory = OUT_OF_MEMORY.iter().any(|message| stderr.contains(message));
        if let (true, Some(limit)) = (is_out_of_memory, limit) {
            return Ok(format!("needed more than {} MiB of memory", limit.memory_mib));
        }
        if let Some(signal) = signal_of(status) {
            // SIGHUP, SIGINT and SIGTERM come from a terminal or a scheduler: stop the sweep.
            let from_outside = [1, 2, 15].contains(&signal);
            return if from_outside { Err(Stopped.into()) } else { Ok(format!("killed by signal {signal}")) };
        }
        if status.code() == Some(101) {
            let message = stderr.lines().find(|line| !line.trim().is_empty() && !line.contains("panicked at"));
            return Ok(format!("internal error of zsim: {}", message.unwrap_or("panic")));
        }
        Err(StudyError::Worker { message: stderr.trim().to_owned() })
    }
}

#[cfg(unix)]
fn signal_of(status: ExitStatus) -> Option<i32> {
    std::os::unix::process::ExitStatusExt::signal(&status)
}

#[cfg(not(unix))]
fn signal_of(_: ExitStatus) -> Option<i32> {
    None
}

/// The end of a process's stderr.
fn stderr_tail(stderr: &mut File) -> std::io::Result<String> {
    let length = stderr.seek(SeekFrom::End(0))?;
    stderr.seek(SeekFrom::Start(length.saturating_sub(MAX_STDERR_BYTES)))?;
    let mut bytes = Vec::new();
    stderr.read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}
