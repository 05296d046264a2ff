//! Execution of a task in a worker process, which limits its resources and isolates its crashes.

use super::identity::ContentHash;
use super::part::RunOutcome;
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
    /// The run of this unit has started.
    Begin(usize),
    /// The part file of this unit is written.
    Done(usize),
}

impl std::fmt::Display for WorkerMessage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Begin(unit) => write!(f, "begin {unit}"),
            Self::Done(unit) => write!(f, "done {unit}"),
        }
    }
}

impl WorkerMessage {
    pub(super) fn parse(line: &str) -> Option<Self> {
        let (event, unit) = line.split_once(' ')?;
        let unit = unit.parse().ok()?;
        match event {
            "begin" => Some(Self::Begin(unit)),
            "done" => Some(Self::Done(unit)),
            _ => None,
        }
    }
}

/// Runs with the same recording.
struct SharedRecording {
    runs: Vec<(usize, PlannedJourney)>,
}

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

    /// Runs the missing runs of task `task` in this process on rayon's threads; `report` receives a message per event.
    ///
    /// # Errors
    /// If there is no such task, or if a part cannot be written. A failed run is not an error here: its row in the
    /// table contains the error.
    pub fn run_task(&self, task: usize, report: &(dyn Fn(WorkerMessage) + Sync)) -> Result<(), StudyError> {
        let unknown = || StudyError::Plan {
            what: "task",
            message: format!("{task}: the plan has tasks 0 to {}", self.tasks.len().saturating_sub(1)),
        };
        let units = self.tasks.get(task).ok_or_else(unknown)?;
        let Some(limit) = self.plan.limit() else {
            return units.iter().try_for_each(|unit| self.run_block(*unit as usize));
        };
        let mut shared: Vec<SharedRecording> = Vec::new();
        let mut groups: BTreeMap<ContentHash, usize> = BTreeMap::new();
        for unit in self.missing_units(task)? {
            let index = self.units[unit].first;
            let run = self.plan.journey(index, &self.plan.inputs(index)?)?;
            let group = *groups.entry(run.recording).or_insert(shared.len());
            if group == shared.len() {
                shared.push(SharedRecording { runs: Vec::new() });
            }
            shared[group].runs.push((unit, run));
        }
        shared.chunks(MAX_RECORDINGS).try_for_each(|some| self.run_shared(some, limit, report))
    }

    /// Runs a block of runs in this process, unless it is finished.
    pub(super) fn run_block(&self, unit: usize) -> Result<(), StudyError> {
        let unit = &self.units[unit];
        if self.is_done(unit)? {
            return Ok(());
        }
        let measures = self.plan.result_measures();
        let evaluate = |index| super::in_process::evaluate(&self.plan, &measures, index);
        let outcomes: Vec<RunOutcome> = (unit.first..unit.first + unit.count).map(evaluate).collect();
        self.write_part(unit, &outcomes)
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
            let Some((_, run)) = each.runs.first() else { continue };
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
            .flat_map(|(recording, each)| each.runs.iter().map(move |run| (recording, run)))
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
            let (recording, (unit, run)) = runs[index];
            if !self.is_done(&self.units[*unit])? {
                report(WorkerMessage::Begin(*unit));
                let outcome = self.evaluate(recording, limit.time_s, &run.inputs, reader);
                self.write_part(&self.units[*unit], &[outcome])?;
            }
            report(WorkerMessage::Done(*unit));
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
        shared.runs.iter().try_for_each(|(unit, _)| {
            self.write_part(&self.units[*unit], std::slice::from_ref(&outcome))?;
            report(WorkerMessage::Done(*unit));
            Ok(())
        })
    }
}
