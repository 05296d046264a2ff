//! Runs the missing runs of a sweep, or of a shard of it.

use super::outcome::RunOutcome;
use super::worker::{Runner, Worker, WorkerExit};
use super::{BaseSpec, Sweep};
use crate::StudyError;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use zsim_base::parallel::PieceProgress;
use zsim_base::parallel::Stopped;

/// Shard of a sweep for one of several processes: number `index`, from 0, of `count` equal shards.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Index of this shard, from 0.
    pub index: usize,
    /// Number of shards.
    pub count: usize,
}

impl Shard {
    /// The complete sweep.
    pub const WHOLE: Self = Self { index: 0, count: 1 };

    fn contains(self, job: usize) -> bool {
        job % self.count == self.index
    }

    /// The jobs in this shard.
    pub(super) fn select<T>(self, jobs: &[T]) -> impl Iterator<Item = &T> {
        jobs.iter().enumerate().filter(move |(job, _)| self.contains(*job)).map(|(_, job)| job)
    }
}

impl Sweep {
    /// Runs the missing runs of `shard` on as many threads as rayon has.
    ///
    /// Finished runs survive any interruption. Several processes may run the same sweep at once.
    ///
    /// # Errors
    /// If a file cannot be written, a worker cannot be started, or the sweep is stopped. A failed run is not an error
    /// here: its row in the table contains the error.
    pub fn run(&self, shard: Shard, runner: &Runner) -> Result<(), StudyError> {
        if shard.index >= shard.count {
            let message = format!("{} of {}: shares are counted from 0", shard.index, shard.count);
            return Err(StudyError::Plan { what: "share", message });
        }
        let mut jobs = Vec::new();
        for job in (0..self.jobs.len()).filter(|job| shard.contains(*job)) {
            if !self.missing_batches(job)?.is_empty() {
                jobs.push(job);
            }
        }
        match self.plan.spec().base {
            BaseSpec::Spring { .. } | BaseSpec::Gains { .. } => self.run_closed_forms(&jobs, runner),
            BaseSpec::Journey(_) => self.run_in_workers(&jobs, runner),
        }
    }

    /// Runs closed forms and gains in this process.
    fn run_closed_forms(&self, jobs: &[usize], runner: &Runner) -> Result<(), StudyError> {
        let pieces = PieceProgress::new(jobs.len(), runner.on_progress);
        jobs.par_iter().try_for_each(|job| {
            if runner.stop.load(Ordering::Relaxed) {
                return Err(Stopped.into());
            }
            self.run_job(*job, &|_| ())?;
            pieces.finish_one();
            Ok(())
        })
    }

    /// Runs journeys in worker processes.
    fn run_in_workers(&self, jobs: &[usize], runner: &Runner) -> Result<(), StudyError> {
        let threads = rayon::current_num_threads();
        let at_once = threads.min(jobs.len()).max(1);
        let missing = jobs.iter().map(|job| self.missing_batches(*job).map(|batches| batches.len()));
        let pieces = PieceProgress::new(missing.sum::<Result<usize, StudyError>>()?, runner.on_progress);
        let next = AtomicUsize::new(0);
        let failed = AtomicBool::new(false);
        let work = || {
            while let Some(job) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
                if failed.load(Ordering::Relaxed) {
                    return Ok(());
                }
                let worker = Worker { sweep: self, job: *job, runner, failed: &failed, pieces: &pieces };
                // With fewer jobs than threads each job gets several: estimates of one recording run in parallel.
                self.run_job_in_workers(&worker, (threads / at_once).max(1))
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
            // The first failure stops the other workers: report it rather than their `Stopped`.
            let is_cause = |error: &StudyError| !error.is_stopped();
            let cause = errors.iter().position(is_cause).unwrap_or(0);
            errors.into_iter().nth(cause).map_or(Ok(()), Err)
        })
    }

    /// Runs a job in a worker process, and restarts the worker after a crash.
    ///
    /// The first crash may have an external cause: the remaining runs are retried on one thread. Runs that crash a
    /// single-threaded worker twice are recorded as failed.
    fn run_job_in_workers(&self, worker: &Worker, threads: usize) -> Result<(), StudyError> {
        let (mut threads, mut last) = (threads, None);
        loop {
            let (started, reason) = match worker.attempt(threads)? {
                WorkerExit::Done => return Ok(()),
                WorkerExit::Crashed { started, reason } => (started, reason),
            };
            let is_single = threads == 1;
            threads = 1;
            if !is_single || last.as_ref() != Some(&started) {
                last = is_single.then_some(started);
                continue;
            }
            // If no run has started, the simulation that all of them share failed.
            let failed = if started.is_empty() { self.missing_batches(worker.job)? } else { started };
            let outcome = RunOutcome::failed(self.plan.result_measures().len(), &reason);
            for batch in failed {
                self.write_batch(&self.batches[batch], std::slice::from_ref(&outcome))?;
                worker.pieces.finish_one();
            }
            last = None;
        }
    }
}
