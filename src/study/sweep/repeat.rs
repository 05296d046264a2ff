//! Single runs of a sweep with all their files.

use super::in_process::evaluate;
use super::{BaseSpec, JourneySpec, Measure, Shard, Sweep};
use crate::StudyError;
use std::path::{Path, PathBuf};
use zsim_base::files::FileError;
use zsim_base::files::replace_text;
use zsim_base::files::subfolder;
use zsim_base::spec;
use zsim_run::METRICS;
use zsim_run::{EstimateOptions, EstimateResult, ProgressMonitor, simulate_and_estimate};
use zsim_simulation::Simulation;

/// Number of digits of a run's hash in the name of its folder.
const HASH_DIGITS: usize = 8;

/// A repeated run.
#[derive(Debug, Clone)]
pub enum RepeatedRun {
    /// A journey: a full run with its page.
    Journey(Box<EstimateResult>),
    /// A closed form or a gain measurement: its measures, and its head as `head.ron`.
    OfHead(Vec<(Measure, Option<f64>)>),
}

impl Sweep {
    /// Folder below the sweep's in which run `number` is kept: `runs/12-1f3a5c7e`, its index and the start of its hash.
    ///
    /// A plan that replaces another one thus never shows a run of the other.
    fn run_folder(&self, number: u64) -> PathBuf {
        self.folder.join(self.run_folder_name(number))
    }

    /// Creates the folder in which run `number` is kept.
    ///
    /// # Errors
    /// If it cannot be created.
    pub fn create_run_folder(&self, number: u64) -> Result<PathBuf, StudyError> {
        Ok(subfolder(&self.folder, self.run_folder_name(number)).map_err(FileError::at(&self.folder))?)
    }

    fn run_folder_name(&self, number: u64) -> String {
        let hash = self.identities.get(number as usize).map(ToString::to_string).unwrap_or_default();
        format!("runs/{number}-{}", &hash[..hash.len().min(HASH_DIGITS)])
    }

    /// Address of the page of a kept run, relative to the sweep's page; `None` if the run is not kept.
    pub(super) fn page_of_run(&self, number: u64) -> Option<String> {
        let address = format!("{}/report.html", self.run_folder_name(number));
        self.folder.join(&address).is_file().then_some(address)
    }

    /// Whether a run can be repeated on its own: timing errors are applied between recording and estimate, which a full
    /// run does not do.
    pub(super) fn can_repeat(&self) -> bool {
        !matches!(self.plan.spec().base, BaseSpec::Journey(JourneySpec { timing: Some(_), .. }))
    }

    /// The finished journeys of `shard` that have no complete folder, ascending.
    ///
    /// # Errors
    /// If a file cannot be opened, or if the sweep has no full runs.
    pub fn runs_to_keep(&self, shard: Shard) -> Result<Vec<u64>, StudyError> {
        if !matches!(self.plan.spec().base, BaseSpec::Journey(JourneySpec { timing: None, .. })) {
            let message = "only full runs without timing errors have a folder of their own".to_owned();
            return Err(StudyError::Plan { what: "--keep-runs", message });
        }
        let mut numbers = Vec::new();
        for batch in shard.select(&self.jobs).flatten().map(|batch| &self.batches[*batch as usize]) {
            if self.is_done(batch)? {
                numbers.extend(batch.runs());
            }
        }
        numbers.retain(|number| !self.run_folder(*number).join(METRICS).is_file());
        numbers.sort_unstable();
        Ok(numbers)
    }

    /// Checks that run `number` can be repeated.
    ///
    /// # Errors
    /// If there is no such run, or if it has timing errors.
    pub fn check_repeat(&self, number: u64) -> Result<(), StudyError> {
        let refused = |message: String| Err(StudyError::Plan { what: "run", message });
        if number >= self.plan.runs() {
            return refused(format!("{number}: the sweep has runs 0 to {}", self.plan.runs().saturating_sub(1)));
        }
        match self.can_repeat() {
            true => Ok(()),
            false => refused("the runs of this sweep have timing errors, which a full run does not apply".to_owned()),
        }
    }

    /// Repeats run `number` with all its files in the existing `folder`.
    ///
    /// A journey is a full run, see [`simulate_and_estimate`]: its figures are those of the table. Of a closed form or a
    /// gain measurement, the head is written as `head.ron`.
    ///
    /// # Errors
    /// As [`Self::check_repeat`], or if the run fails or is stopped.
    pub fn repeat(&self, number: u64, folder: &Path, watch: &mut ProgressMonitor) -> Result<RepeatedRun, StudyError> {
        let refused = |message: String| StudyError::Plan { what: "run", message };
        self.check_repeat(number)?;
        let inputs = self.plan.inputs(number)?;
        if let BaseSpec::Journey(_) = self.plan.spec().base {
            let journey = self.plan.journey(number, &inputs)?.inputs;
            let simulation = Simulation::build(journey.simulation)?;
            let ignore_manifest = journey.ignore_manifest;
            let options = EstimateOptions { ignore_manifest, ..EstimateOptions::with(journey.estimator.spec) };
            let result = simulate_and_estimate(&simulation, &options, folder, watch)?;
            return Ok(RepeatedRun::Journey(Box::new(result)));
        }
        let head = match self.plan.spec().base {
            BaseSpec::Gains { .. } => inputs.gain_run().map_err(refused)?.head,
            _ => inputs.closed_form().map_err(refused)?.head,
        };
        replace_text(&folder.join("head.ron"), &(spec::to_text(&head.spec)? + "\n"))?;
        let measures = self.plan.result_measures();
        let outcome = evaluate(&self.plan, &measures, number);
        match outcome.error {
            Some(message) => Err(refused(format!("{number}: {message}"))),
            None => Ok(RepeatedRun::OfHead(measures.into_iter().zip(outcome.figures).collect())),
        }
    }
}
