//! Execution of a job in a worker process, which limits its resources and isolates its crashes.

use super::identity::ContentHash;
use super::outcome::RunOutcome;
use super::plan::PlannedJourney;
use super::{LimitSpec, Sweep, figures, needs};
use crate::StudyError;
use std::collections::BTreeMap;
use std::error::Error;
use std::time::Instant;
use zsim_base::parallel::for_each_on_threads;
use zsim_run::{MAX_RECORDINGS, RunError, RunInputs, TemporaryRecording, record_simulations};
use zsim_simulation::Simulation;

/// Message from a worker to its supervisor, one line on stdout: `begin 7`, `done 7`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WorkerMessage {
    /// The run of this batch has started.
    Begin(usize),
    /// The file of this batch is written.
    Done(usize),
}

impl std::fmt::Display for WorkerMessage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Begin(batch) => write!(f, "begin {batch}"),
            Self::Done(batch) => write!(f, "done {batch}"),
        }
    }
}

impl WorkerMessage {
    pub(super) fn parse(line: &str) -> Option<Self> {
        let (event, batch) = line.split_once(' ')?;
        let batch = batch.parse().ok()?;
        match event {
            "begin" => Some(Self::Begin(batch)),
            "done" => Some(Self::Done(batch)),
            _ => None,
        }
    }
}

/// Runs with the same recording, each with the index of its batch.
type SharedRecording = Vec<(usize, PlannedJourney)>;

/// Limits the memory of this process, and ends it when its parent ends; only on Linux.
///
/// # Errors
/// If the operating system rejects a limit.
pub fn limit_process(limit: Option<LimitSpec>) -> Result<(), StudyError> {
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{Resource, Rlimit, Signal, set_parent_process_death_signal, setrlimit};
        let refused =
            |error: rustix::io::Errno| StudyError::Worker { message: format!("cannot limit the process: {error}") };
        set_parent_process_death_signal(Some(Signal::KILL)).map_err(refused)?;
        if let Some(limit) = limit {
            let bytes = Some(limit.memory_mib.saturating_mul(1 << 20));
            setrlimit(Resource::Data, Rlimit { current: bytes, maximum: bytes }).map_err(refused)?;
        }
    }
    #[cfg(not(target_os = "linux"))]
    let _ = limit;
    Ok(())
}

impl Sweep {
    /// Time and memory limits of a run; `None` for closed forms.
    pub fn limit(&self) -> Option<LimitSpec> {
        self.plan.limit()
    }

    /// Does the missing runs of a job in this process on rayon's threads; `report` receives a message per event.
    ///
    /// # Errors
    /// If there is no such job, or if a file cannot be written. A failed run is not an error here: its row in the
    /// table contains the error.
    pub fn run_job(&self, job: usize, report: &(dyn Fn(WorkerMessage) + Sync)) -> Result<(), StudyError> {
        if job >= self.jobs() {
            let message = format!("{job}: the plan has tasks 0 to {}", self.jobs().saturating_sub(1));
            return Err(StudyError::Plan { what: "task", message });
        }
        let missing = self.missing_batches(job)?;
        let Some(limit) = self.plan.limit() else {
            return missing.into_iter().try_for_each(|batch| self.run_in_process(batch));
        };
        let mut shared: Vec<SharedRecording> = Vec::new();
        let mut groups: BTreeMap<ContentHash, usize> = BTreeMap::new();
        for batch in missing {
            let index = self.batches[batch].first;
            let run = self.plan.journey(index, &self.plan.inputs(index)?)?;
            let group = *groups.entry(run.recording).or_insert(shared.len());
            if group == shared.len() {
                shared.push(Vec::new());
            }
            shared[group].push((batch, run));
        }
        shared.chunks(MAX_RECORDINGS).try_for_each(|some| self.run_shared(some, limit, report))
    }

    /// Unfinished batches of a job.
    pub(super) fn missing_batches(&self, job: usize) -> Result<Vec<usize>, StudyError> {
        let mut missing = Vec::new();
        for batch in self.jobs[job].iter().map(|batch| *batch as usize) {
            if !self.is_done(&self.batches[batch])? {
                missing.push(batch);
            }
        }
        Ok(missing)
    }

    /// Does the closed forms or gains of a batch.
    fn run_in_process(&self, batch: usize) -> Result<(), StudyError> {
        let batch = &self.batches[batch];
        let measures = self.plan.result_measures();
        let evaluate = |run| super::in_process::evaluate(&self.plan, &measures, run);
        self.write_batch(batch, &batch.runs().map(evaluate).collect::<Vec<_>>())
    }

    /// Simulates and records each group of runs, then estimates.
    fn run_shared(
        &self,
        shared: &[SharedRecording],
        limit: LimitSpec,
        report: &(dyn Fn(WorkerMessage) + Sync),
    ) -> Result<(), StudyError> {
        let threads = rayon::current_num_threads();
        let measures = self.plan.result_measures();
        let recorded = measures.iter().any(|measure| measure.is_of_estimate());
        let mut simulations: Vec<Simulation> = Vec::new();
        let mut groups: Vec<&SharedRecording> = Vec::new();
        for each in shared {
            let Some((_, run)) = each.first() else { continue };
            match Simulation::build(run.inputs.simulation.clone()) {
                Ok(simulation) => {
                    simulations.push(simulation);
                    groups.push(each);
                }
                // For example a head without static equilibrium, or a motion that leaves the scene: these runs fail.
                Err(error) => self.fail(each, &error, report)?,
            }
        }
        let recordings = match record_simulations(simulations, recorded, threads, limit.time_s) {
            Ok(recordings) => recordings,
            Err(error @ RunError::File(_)) => return Err(error.into()),
            Err(error) => return groups.into_iter().try_for_each(|each| self.fail(each, &error, report)),
        };
        let runs: Vec<(&TemporaryRecording, &(usize, PlannedJourney))> = recordings
            .iter()
            .zip(groups)
            .flat_map(|(recording, each)| each.iter().map(move |run| (recording, run)))
            .collect();
        self.estimate_runs(&runs, limit, threads, report)
    }

    /// Estimates the runs in parallel, each on one thread.
    fn estimate_runs(
        &self,
        runs: &[(&TemporaryRecording, &(usize, PlannedJourney))],
        limit: LimitSpec,
        threads: usize,
        report: &(dyn Fn(WorkerMessage) + Sync),
    ) -> Result<(), StudyError> {
        for_each_on_threads(runs.len(), threads, |reader, index| {
            let (recording, (batch, run)) = runs[index];
            if !self.is_done(&self.batches[*batch])? {
                report(WorkerMessage::Begin(*batch));
                let outcome = self.evaluate(recording, limit.time_s, &run.inputs, reader);
                self.write_batch(&self.batches[*batch], &[outcome])?;
            }
            report(WorkerMessage::Done(*batch));
            Ok(())
        })
    }

    /// Evaluates a run on its recording, read by thread `reader`.
    fn evaluate(&self, recording: &TemporaryRecording, limit_s: f64, run: &RunInputs, reader: usize) -> RunOutcome {
        let (measures, times) = (self.plan.result_measures(), self.plan.time_measures());
        let needs = needs(&self.plan.spec().measures);
        let compared = recording.compared_with(limit_s, &needs, run, reader);
        let started = Instant::now();
        let results = compared.and_then(|compared| recording.results(&needs, limit_s, run, reader, &compared));
        let wall_s = Some(started.elapsed().as_secs_f64());
        match results {
            Ok((results, details)) => RunOutcome {
                figures: figures(&results, &measures),
                times: std::iter::once(wall_s).chain(figures(&results, &times[1..])).collect(),
                details,
                error: None,
            },
            Err(error) => RunOutcome { times: vec![wall_s], ..RunOutcome::from_error(measures.len(), &error) },
        }
    }

    /// Records all runs of a group as failed.
    fn fail(
        &self,
        shared: &SharedRecording,
        error: &dyn Error,
        report: &(dyn Fn(WorkerMessage) + Sync),
    ) -> Result<(), StudyError> {
        let outcome = RunOutcome::from_error(self.plan.result_measures().len(), error);
        shared.iter().try_for_each(|(batch, _)| {
            self.write_batch(&self.batches[*batch], std::slice::from_ref(&outcome))?;
            report(WorkerMessage::Done(*batch));
            Ok(())
        })
    }
}
