//! A process that does a task.

use super::Sweep;
use super::run::Runner;
use super::task::Word;
use crate::study::StudyError;
use crate::study::watch::PieceProgress;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Time between two looks whether somebody wants it stopped.
const LOOK: Duration = Duration::from_millis(50);
/// A worker ends a run that takes too long itself. One that does not is ended after this share of the limit more, and
/// these seconds.
const GRACE: (f64, f64) = (0.5, 10.0);
/// Most of what a worker said on stderr that is read, bytes.
const LAST_WORDS: u64 = 4096;

/// What a process says whose memory has come to its end: of an allocation, of the system, of a thread's stack.
const OUT_OF_MEMORY: [&str; 3] = ["memory allocation of", "Cannot allocate memory", "failed to spawn thread"];

/// A task, to be done by a process.
pub(super) struct Worker<'a> {
    pub sweep: &'a Sweep,
    pub task: usize,
    pub runner: &'a Runner<'a>,
    /// Set when another task could not be done.
    pub failed: &'a AtomicBool,
    pub pieces: &'a PieceProgress<'a>,
}

/// How a process ended.
#[derive(Debug, PartialEq)]
pub(super) enum Ended {
    /// All is done.
    Done,
    /// By itself or the system, with these units begun.
    Died { begun: Vec<usize>, why: String },
}

impl Worker<'_> {
    /// Begins a process with so many threads, and sees it to its end.
    pub fn attempt(&self, threads: usize) -> Result<Ended, StudyError> {
        let lost = |error: std::io::Error| StudyError::file(self.runner.program)(error);
        let mut said = tempfile::tempfile().map_err(lost)?;
        let mut child = Command::new(self.runner.program)
            .args(["sweep", "task", "--quiet", "--threads", &threads.to_string(), "--task", &self.task.to_string()])
            .arg(&self.sweep.folder)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(said.try_clone().map_err(lost)?)
            .spawn()
            .map_err(lost)?;
        let out = child.stdout.take();
        let mut begun = BTreeSet::new();
        let too_long = std::thread::scope(|scope| {
            let (tell, hear) = channel();
            scope.spawn(move || {
                let lines = out.map(|out: ChildStdout| BufReader::new(out).lines());
                for word in lines.into_iter().flatten().map_while(Result::ok).filter_map(|line| Word::parse(&line)) {
                    if tell.send(word).is_err() {
                        return;
                    }
                }
            });
            self.listen(&mut child, &hear, &mut begun)
        });
        let status = child.wait().map_err(lost)?;
        if self.is_stopped() {
            return Err(StudyError::Stopped);
        }
        if status.success() {
            return Ok(Ended::Done);
        }
        let words = last_words(&mut said).map_err(lost)?;
        self.cause(status, too_long, &words).map(|why| Ended::Died { begun: begun.into_iter().collect(), why })
    }

    /// Hears of runs until the process has no more to say; whether it was ended because it took too long.
    fn listen(&self, child: &mut Child, hear: &Receiver<Word>, begun: &mut BTreeSet<usize>) -> bool {
        let limit_s = self.sweep.plan.limit().map_or(f64::INFINITY, |limit| limit.time_s);
        let patience_s = limit_s * (1.0 + GRACE.0) + GRACE.1;
        let mut since = Instant::now();
        let mut too_long = false;
        loop {
            match hear.recv_timeout(LOOK) {
                Ok(Word::Begin(unit)) => {
                    begun.insert(unit);
                    since = Instant::now();
                }
                Ok(Word::Done(unit)) => {
                    begun.remove(&unit);
                    since = Instant::now();
                    self.pieces.finish_one();
                }
                Err(RecvTimeoutError::Disconnected) => return too_long,
                Err(RecvTimeoutError::Timeout) => {
                    too_long |= since.elapsed().as_secs_f64() > patience_s;
                    if too_long || self.is_stopped() {
                        // One that has just ended cannot be ended, which is as well.
                        let _ = child.kill();
                    }
                }
            }
        }
    }

    fn is_stopped(&self) -> bool {
        self.runner.stop.load(Ordering::Relaxed) || self.failed.load(Ordering::Relaxed)
    }

    /// Why a process died, if that is a run's fault.
    fn cause(&self, status: ExitStatus, too_long: bool, words: &str) -> Result<String, StudyError> {
        let limit = self.sweep.plan.limit();
        if let (true, Some(limit)) = (too_long, limit) {
            return Ok(StudyError::TooLong { time_s: limit.time_s }.to_string());
        }
        let starved = OUT_OF_MEMORY.iter().any(|sign| words.contains(sign));
        if let (true, Some(limit)) = (starved, limit) {
            return Ok(format!("needed more than {} MiB of memory", limit.memory_mib));
        }
        if let Some(signal) = signal_of(status) {
            // From a terminal or a scheduler: somebody wants all of it to end.
            let from_outside = [1, 2, 15].contains(&signal);
            return if from_outside { Err(StudyError::Stopped) } else { Ok(format!("ended by signal {signal}")) };
        }
        if status.code() == Some(101) {
            let words = words.lines().find(|line| !line.trim().is_empty() && !line.contains("panicked at"));
            return Ok(format!("a defect of zsim: {}", words.unwrap_or("it panicked")));
        }
        Err(StudyError::Worker { message: words.trim().to_owned() })
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

/// The end of what a process said.
fn last_words(said: &mut File) -> std::io::Result<String> {
    let length = said.seek(SeekFrom::End(0))?;
    said.seek(SeekFrom::Start(length.saturating_sub(LAST_WORDS)))?;
    let mut bytes = Vec::new();
    said.read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}
