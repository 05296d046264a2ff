//! A task of a sweep, done in a process of its own: what it takes is limited, and what it breaks is its own.

use super::identity::Identity;
use super::journey::{MOST_TAPES, Tape, tapes};
use super::measure::Told;
use super::part::Row;
use super::plan::Point;
use super::{LimitSpec, Sweep};
use crate::simulation::Simulation;
use crate::study::StudyError;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

/// What a worker tells the process that began it, a line each on stdout: `begin 7`, `done 7`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Word {
    /// This unit is begun.
    Begin(usize),
    /// Its part is on disk.
    Done(usize),
}

impl std::fmt::Display for Word {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Begin(unit) => write!(f, "begin {unit}"),
            Self::Done(unit) => write!(f, "done {unit}"),
        }
    }
}

impl Word {
    pub(super) fn parse(line: &str) -> Option<Self> {
        let (word, unit) = line.split_once(' ')?;
        let unit = unit.parse().ok()?;
        match word {
            "begin" => Some(Self::Begin(unit)),
            "done" => Some(Self::Done(unit)),
            _ => None,
        }
    }
}

/// Runs that share a recording.
struct Shared {
    runs: Vec<(usize, Point)>,
}

/// Limits this process to what a task may take, and ends it with the one that began it; on Linux.
///
/// # Errors
/// When the system refuses.
pub fn confine(limit: Option<LimitSpec>) -> Result<(), StudyError> {
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{Resource, Rlimit, Signal, set_parent_process_death_signal, setrlimit};
        let refused = |error: rustix::io::Errno| StudyError::Worker { message: format!("no limits: {error}") };
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
    /// What a run may take, where that is limited.
    pub fn limit(&self) -> Option<LimitSpec> {
        self.plan.limit()
    }

    /// Does what is missing of task `task`, here and now, with rayon's threads; `tell` hears of each run.
    ///
    /// # Errors
    /// When there is no such task, or a part cannot be written. That a run fails is a row of its part.
    pub fn run_task(&self, task: usize, tell: &(dyn Fn(Word) + Sync)) -> Result<(), StudyError> {
        let none = || StudyError::Plan {
            what: "the task",
            message: format!("{task}: the plan has tasks 0 to {}", self.tasks.len().saturating_sub(1)),
        };
        let units = self.tasks.get(task).ok_or_else(none)?;
        let Some(limit) = self.plan.limit() else {
            return units.iter().try_for_each(|unit| self.run_block(*unit as usize));
        };
        let mut shared: Vec<Shared> = Vec::new();
        let mut places: BTreeMap<Identity, usize> = BTreeMap::new();
        for unit in self.missing(task)? {
            let point = self.plan.point(self.units[unit].first)?;
            let place = *places.entry(point.simulation).or_insert(shared.len());
            if place == shared.len() {
                shared.push(Shared { runs: Vec::new() });
            }
            shared[place].runs.push((unit, point));
        }
        shared.chunks(MOST_TAPES).try_for_each(|some| self.run_shared(some, limit, tell))
    }

    /// A block of closed forms.
    pub(super) fn run_block(&self, unit: usize) -> Result<(), StudyError> {
        let unit = &self.units[unit];
        if self.is_done(unit)? {
            return Ok(());
        }
        let told = self.plan.told();
        let row = |index| super::closed_form::row(&self.plan, &told, index);
        let rows: Vec<Row> = (unit.first..unit.first + unit.count).map(row).collect();
        self.keep(unit, &rows)
    }

    fn run_shared(&self, shared: &[Shared], limit: LimitSpec, tell: &(dyn Fn(Word) + Sync)) -> Result<(), StudyError> {
        let threads = rayon::current_num_threads();
        let told = self.plan.told();
        let recorded = told.iter().any(|measure| measure.told() == Told::Estimate);
        let mut built: Vec<Simulation> = Vec::new();
        let mut standing: Vec<&Shared> = Vec::new();
        for each in shared {
            let Some((unit, point)) = each.runs.first() else { continue };
            let seed = self.plan.seed(self.units[*unit].first).unwrap_or_default();
            match self.plan.simulation(&point.changed, seed) {
                Ok(simulation) => {
                    built.push(simulation);
                    standing.push(each);
                }
                // A head that falls, a motion that does not fit the scene: the runs' own fault.
                Err(error) => self.fail(each, &error, tell)?,
            }
        }
        let tapes = match tapes(built, (recorded, threads), limit) {
            Ok(tapes) => tapes,
            Err(error @ StudyError::File { .. }) => return Err(error),
            Err(error) => return standing.into_iter().try_for_each(|each| self.fail(each, &error, tell)),
        };
        let runs: Vec<(&Tape, &(usize, Point))> =
            tapes.iter().zip(standing).flat_map(|(tape, each)| each.runs.iter().map(move |run| (tape, run))).collect();
        self.run_on_tapes(&runs, threads, tell)
    }

    /// Estimates beside each other.
    fn run_on_tapes(
        &self,
        runs: &[(&Tape, &(usize, Point))],
        threads: usize,
        tell: &(dyn Fn(Word) + Sync),
    ) -> Result<(), StudyError> {
        let next = AtomicUsize::new(0);
        let read = |reader: usize| {
            while let Some((tape, (unit, point))) = runs.get(next.fetch_add(1, Ordering::Relaxed)) {
                if self.is_done(&self.units[*unit])? {
                    tell(Word::Done(*unit));
                    continue;
                }
                tell(Word::Begin(*unit));
                self.keep(&self.units[*unit], &[tape.row(&self.plan, point, reader)])?;
                tell(Word::Done(*unit));
            }
            Ok::<(), StudyError>(())
        };
        std::thread::scope(|scope| {
            let read = &read;
            let readers: Vec<_> =
                (0..threads.min(runs.len())).map(|reader| scope.spawn(move || read(reader))).collect();
            readers.into_iter().try_for_each(|reader| match reader.join() {
                Ok(result) => result,
                Err(panic) => std::panic::resume_unwind(panic),
            })
        })
    }

    fn fail(&self, shared: &Shared, error: &StudyError, tell: &(dyn Fn(Word) + Sync)) -> Result<(), StudyError> {
        let row = Row::failed_by(self.plan.told().len(), error);
        shared.runs.iter().try_for_each(|(unit, _)| {
            self.keep(&self.units[*unit], std::slice::from_ref(&row))?;
            tell(Word::Done(*unit));
            Ok(())
        })
    }
}
