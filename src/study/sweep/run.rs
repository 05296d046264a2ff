//! A sweep, run: what is missing of it, or of a share of it.

use super::part::Row;
use super::worker::{Ended, Worker};
use super::{BaseSpec, Sweep};
use crate::study::StudyError;
use crate::study::watch::{OnProgress, PieceProgress};
use rayon::prelude::*;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// A part of a sweep: of `count` equal parts the one with number `index`, from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Share {
    /// Which one.
    pub index: usize,
    /// Of how many.
    pub count: usize,
}

impl Share {
    /// All of it.
    pub const WHOLE: Self = Self { index: 0, count: 1 };

    fn has(self, task: usize) -> bool {
        task % self.count == self.index
    }

    /// Those of `tasks` that are in it.
    pub(super) fn of<T>(self, tasks: &[T]) -> impl Iterator<Item = &T> {
        tasks.iter().enumerate().filter(move |(task, _)| self.has(*task)).map(|(_, task)| task)
    }
}

/// How a sweep is run.
#[derive(Clone, Copy)]
pub struct Runner<'a> {
    /// The command `zsim`, of which workers are made: a journey runs in a process of its own.
    pub program: &'a Path,
    /// Set from outside to stop.
    pub stop: &'a AtomicBool,
    /// Hears which share of what was missing is done.
    pub on_progress: OnProgress<'a>,
}

impl Sweep {
    /// Does what is missing of `share`, and nothing else, on rayon's number of threads. What is done stays done,
    /// whatever ends this; any number of processes may do it at once.
    ///
    /// # Errors
    /// When a part cannot be written, a worker not be begun, or somebody stops it. That a run fails is a row of its
    /// part.
    pub fn run(&self, share: Share, runner: &Runner) -> Result<(), StudyError> {
        if share.index >= share.count {
            let message = format!("{} of {}: shares are counted from 0", share.index, share.count);
            return Err(StudyError::Plan { what: "share", message });
        }
        let mut tasks = Vec::new();
        for task in (0..self.tasks.len()).filter(|task| share.has(*task)) {
            if !self.missing(task)?.is_empty() {
                tasks.push(task);
            }
        }
        match self.plan.spec().base {
            BaseSpec::Spring { .. } => self.run_here(&tasks, runner),
            BaseSpec::Journey { .. } => self.run_in_workers(&tasks, runner),
        }
    }

    fn run_here(&self, tasks: &[usize], runner: &Runner) -> Result<(), StudyError> {
        let pieces = PieceProgress::new(tasks.len(), runner.on_progress);
        tasks.par_iter().try_for_each(|task| {
            if runner.stop.load(Ordering::Relaxed) {
                return Err(StudyError::Stopped);
            }
            self.tasks[*task].iter().try_for_each(|unit| self.run_block(*unit as usize))?;
            pieces.finish_one();
            Ok(())
        })
    }

    fn run_in_workers(&self, tasks: &[usize], runner: &Runner) -> Result<(), StudyError> {
        let threads = rayon::current_num_threads();
        let at_once = threads.min(tasks.len()).max(1);
        let missing = tasks.iter().map(|task| self.missing(*task).map(|units| units.len()));
        let pieces = PieceProgress::new(missing.sum::<Result<usize, StudyError>>()?, runner.on_progress);
        let next = AtomicUsize::new(0);
        let failed = AtomicBool::new(false);
        let work = || {
            while let Some(task) = tasks.get(next.fetch_add(1, Ordering::Relaxed)) {
                if failed.load(Ordering::Relaxed) {
                    return Ok(());
                }
                let worker = Worker { sweep: self, task: *task, runner, failed: &failed, pieces: &pieces };
                // With fewer tasks than threads each has several: estimates of one recording run beside each other.
                self.see_through(&worker, (threads / at_once).max(1))
                    .inspect_err(|_| failed.store(true, Ordering::Relaxed))?;
            }
            Ok(())
        };
        std::thread::scope(|scope| {
            let workers: Vec<_> = (0..at_once).map(|_| scope.spawn(work)).collect();
            let ended = workers.into_iter().map(|worker| match worker.join() {
                Ok(result) => result,
                Err(panic) => std::panic::resume_unwind(panic),
            });
            let errors: Vec<StudyError> = ended.collect::<Vec<_>>().into_iter().filter_map(Result::err).collect();
            // What went wrong stops all others, and is told.
            let is_cause = |error: &StudyError| !matches!(error, StudyError::Stopped);
            let cause = errors.iter().position(is_cause).unwrap_or(0);
            errors.into_iter().nth(cause).map_or(Ok(()), Err)
        })
    }

    /// Has a task done. A worker that dies is given the rest once more, on one thread: what ended it may have come from
    /// outside. What then ends it again is a run that failed.
    fn see_through(&self, worker: &Worker, threads: usize) -> Result<(), StudyError> {
        let (mut threads, mut last) = (threads, None);
        loop {
            let (begun, why) = match worker.attempt(threads)? {
                Ended::Done => return Ok(()),
                Ended::Died { begun, why } => (begun, why),
            };
            let alone = threads == 1;
            threads = 1;
            if !alone || last.as_ref() != Some(&begun) {
                last = alone.then_some(begun);
                continue;
            }
            // Before any of them was begun, their simulation failed.
            let failed = if begun.is_empty() { self.missing(worker.task)? } else { begun };
            let row = Row::failed(self.plan.told().len(), &why);
            for unit in failed {
                self.keep(&self.units[unit], std::slice::from_ref(&row))?;
                worker.pieces.finish_one();
            }
            last = None;
        }
    }

    /// The units of a task that are not done.
    pub(super) fn missing(&self, task: usize) -> Result<Vec<usize>, StudyError> {
        let mut missing = Vec::new();
        for unit in self.tasks[task].iter().map(|unit| *unit as usize) {
            if !self.is_done(&self.units[unit])? {
                missing.push(unit);
            }
        }
        Ok(missing)
    }
}
