//! An experiment: its spec, its run, and its stored result.

use super::{ExperimentResult, ExperimentSpec, Extent, RunsSpec, clock_plot, gain_curves, timing};
use crate::StudyError;
use crate::sweep::{ContentHash, MergedReport, Plan, Runner, Shard, Sweep, SweepSpec};
use serde::{Deserialize, Serialize};
use std::path::Path;
use zsim_base::files::write_text;
use zsim_base::spec::{Kind, NamedSpec, Source, find, names, parse, to_text};

/// File with the result, which is written last.
const RESULT_FILE: &str = "finding.ron";

/// Content of the file with the result.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredResult {
    /// Hash of everything that determines the result.
    inputs: String,
    result: ExperimentResult,
}

/// An experiment with its spec.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// Name or path given by the user.
    pub given: String,
    /// File name of the spec without folder and extension.
    pub name: String,
    spec: ExperimentSpec,
    source: Source,
    /// Seeds that replace those of the study; empty for those of the study.
    seeds: Vec<u64>,
}

/// An experiment and its result, `None` if it is not finished.
#[derive(Debug, Clone)]
pub struct Finding {
    /// The experiment.
    pub experiment: Experiment,
    /// The result.
    pub result: Option<ExperimentResult>,
}

impl Experiment {
    /// Loads the experiment `name`: a path, or a name in the library.
    ///
    /// # Errors
    /// If there is no such experiment, or if its spec or a spec that it refers to is invalid.
    pub fn load(name: &str) -> Result<Self, StudyError> {
        let source = find(Kind::Experiment, name)?;
        let spec: ExperimentSpec = parse(&source)?;
        spec.check_model(&source)?;
        let stem = Path::new(name).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self { given: name.to_owned(), name: stem, spec, source, seeds: Vec::new() })
    }

    /// The experiment with other seeds.
    ///
    /// # Errors
    /// If it is not made of runs with seeds, or if the seeds are invalid.
    pub fn with_seeds(mut self, seeds: &[u64]) -> Result<Self, StudyError> {
        let ExperimentSpec::Runs(spec) = &self.spec else {
            let message = format!("the experiment {} has no seeds to replace", self.given);
            return Err(StudyError::Plan { what: "--seeds", message });
        };
        self.seeds = seeds.to_vec();
        self.plan(self.study_of_runs(spec, Extent::Whole)?)?;
        Ok(self)
    }

    /// Names of all built-in experiments, sorted.
    pub fn all() -> Vec<String> {
        names(Kind::Experiment)
    }

    /// Runs the experiment in `folder`, resuming an interrupted one.
    ///
    /// The result does not depend on the number of threads, nor on interruptions.
    ///
    /// # Errors
    /// If the folder contains another experiment (or this one by another spec or version) and `anew` does not permit
    /// replacing it, if a run fails, or if a file cannot be written.
    pub fn run(
        &self,
        folder: &Path,
        extent: Extent,
        anew: bool,
        runner: &Runner,
    ) -> Result<ExperimentResult, StudyError> {
        if let Some(result) = self.finished(folder, extent)?.filter(|_| !anew) {
            return Ok(result);
        }
        let result = match &self.spec {
            ExperimentSpec::GainCurves(spec) => gain_curves::run(spec, &self.source, extent, folder, anew, runner)?,
            ExperimentSpec::Latency(spec) => {
                let (sweep, report) = self.run_study(spec.study(extent, &self.source)?, folder, anew, runner)?;
                timing::result(&spec.figure, &report.latency.ok_or_else(|| sweep.failed())?, folder)?
            }
            ExperimentSpec::Runs(spec) => {
                let (sweep, report) = self.run_study(self.study_of_runs(spec, extent)?, folder, anew, runner)?;
                if spec.plots_clock
                    && let Some(figure) = clock_plot::figure(&sweep)?
                {
                    figure.save(folder, "clock")?;
                }
                ExperimentResult { rows: report.claims, notes: spec.notes.clone() }
            }
        };
        let stored = StoredResult { inputs: self.inputs(extent)?, result };
        write_text(folder, &folder.join(RESULT_FILE), &(to_text(&stored)? + "\n"))?;
        Ok(stored.result)
    }

    /// Reads the result of an earlier run from `folder`; `None` if the experiment is not finished there.
    ///
    /// # Errors
    /// If a spec is missing, or if the folder cannot be read.
    pub fn finished(&self, folder: &Path, extent: Extent) -> Result<Option<ExperimentResult>, StudyError> {
        let path = folder.join(RESULT_FILE);
        if !path.is_file() {
            return Ok(None);
        }
        let stored: StoredResult = parse(&Source::read(&path)?)?;
        Ok((stored.inputs == self.inputs(extent)?).then_some(stored.result))
    }

    /// Number of the figure in the paper, and what it shows.
    pub(super) fn title(&self) -> String {
        match &self.spec {
            ExperimentSpec::GainCurves(spec) => format!("Figure {}: gain curves of heads on springs", spec.figure),
            ExperimentSpec::Latency(spec) => format!("Figure {}: maps with latency and timing noise", spec.figure),
            ExperimentSpec::Runs(spec) => spec.heading(),
        }
    }

    /// File name, without ending, and title of each plot.
    pub(super) fn plots(&self) -> &'static [(&'static str, &'static str)] {
        match &self.spec {
            ExperimentSpec::GainCurves(_) => &[("gains", "Gain curves"), ("coherence", "Coherence")],
            ExperimentSpec::Latency(_) => &[
                ("maps", "Maps with timing errors, clock state off"),
                ("maps_clock_on", "Maps with timing errors, clock state on"),
                ("curves", "Errors over latency and timing noise"),
            ],
            ExperimentSpec::Runs(RunsSpec { plots_clock: true, .. }) => &[("clock", "Clock offsets")],
            ExperimentSpec::Runs(_) => &[],
        }
    }

    /// Runs a study in `folder`, and merges its results.
    fn run_study(
        &self,
        study: (SweepSpec, Source),
        folder: &Path,
        anew: bool,
        runner: &Runner,
    ) -> Result<(Sweep, MergedReport), StudyError> {
        let sweep = self.plan(study)?.write(folder, anew)?;
        sweep.run(Shard::WHOLE, runner)?;
        let report = sweep.merge_and_report()?;
        Ok((sweep, report))
    }

    /// The study of an experiment made of runs, with the seeds of this experiment.
    fn study_of_runs(&self, spec: &RunsSpec, extent: Extent) -> Result<(SweepSpec, Source), StudyError> {
        let (mut study, source) = spec.study(extent, &self.source)?;
        if !self.seeds.is_empty() {
            study.seeds.clone_from(&self.seeds);
        }
        Ok((study, source))
    }

    fn plan(&self, (study, source): (SweepSpec, Source)) -> Result<Plan, StudyError> {
        Plan::new(&self.name, &study, &source)
    }

    /// Hash of everything that determines the result.
    fn inputs(&self, extent: Extent) -> Result<String, StudyError> {
        let text = match &self.spec {
            ExperimentSpec::GainCurves(spec) => to_text(&(extent, &self.spec, spec.heads(&self.source)?))?,
            ExperimentSpec::Latency(spec) => self.text_with(extent, spec.study(extent, &self.source)?)?,
            ExperimentSpec::Runs(spec) => self.text_with(extent, self.study_of_runs(spec, extent)?)?,
        };
        Ok(ContentHash::of([env!("CARGO_PKG_VERSION"), &text].map(str::as_bytes)).to_string())
    }

    /// The experiment and its study as text.
    fn text_with(&self, extent: Extent, study: (SweepSpec, Source)) -> Result<String, StudyError> {
        Ok(to_text(&(extent, &self.spec, self.plan(study)?.text()?))?)
    }
}
