//! Reproduction of the paper's experiments, and comparison with its results.
//!
//! An experiment is a spec ([`ExperimentSpec`], the files of `specs/experiments/`). [`Experiment::run`] writes figures and
//! finished parts to a folder, so that an interrupted experiment can be resumed. [`paper_table`] combines all finished
//! experiments in one table.

mod damping;
mod gain_curves;
mod gain_plots;
pub(super) mod part_store;
mod result;
mod spec;
mod timing;

pub use damping::{DampingFit, FittedPeak, fit_damping};
pub use result::{ComparedNumber, ExperimentResult, TABLE_HEADING, paper_table};
pub use spec::{DesignedSpec, ExperimentSpec, GainCurvesSpec, PeaksSpec};

use super::latency::LatencyStudy;
use super::{OnProgress, StudyError};
use crate::dynamics::HeadSpec;
use crate::spec::{Kind, Source, find, names, parse};
use part_store::PartStore;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Extent of an experiment: the complete one, or a smoke test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Extent {
    /// The complete experiment.
    Whole,
    /// A smoke test that takes seconds; its figures are not results.
    Quick,
}

/// Name of the part with the result, which is written last.
const RESULT_PART: &str = "finding";

/// An experiment with its spec.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// Name or path given by the user.
    pub given: String,
    /// File name of the spec without folder and extension.
    pub name: String,
    spec: ExperimentSpec,
    source: Source,
}

impl Experiment {
    /// Loads the experiment `name`: a path, or a name in the library.
    ///
    /// # Errors
    /// If there is no such experiment, or if its spec or a spec that it refers to is invalid.
    pub fn load(name: &str) -> Result<Self, StudyError> {
        let source = find(Kind::Experiment, name)?;
        let spec: ExperimentSpec = parse(&source)?;
        spec.check(&source)?;
        let stem = Path::new(name).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self { given: name.to_owned(), name: stem, spec, source })
    }

    /// Names of all built-in experiments, sorted.
    pub fn all() -> Vec<String> {
        names(Kind::Experiment)
    }

    /// Runs the experiment in `folder`, resuming an interrupted one; `on_progress` receives the finished fraction.
    ///
    /// The result does not depend on the number of threads, nor on interruptions.
    ///
    /// # Errors
    /// If the folder contains another experiment (or this one by another spec or version) and `anew` does not permit
    /// replacing it, if a simulation fails, or if a file cannot be written.
    pub fn run(
        &self,
        folder: &Path,
        extent: Extent,
        anew: bool,
        on_progress: OnProgress<'_>,
    ) -> Result<ExperimentResult, StudyError> {
        match self.work(extent)? {
            Work::GainCurves(spec, heads) => {
                let store = PartStore::open(folder, &inputs(extent, spec, &heads), anew)?;
                store.part(RESULT_PART, || gain_curves::run(spec, &heads, extent, &store, on_progress))
            }
            Work::Latency(latency) => {
                let store = PartStore::open(folder, &latency.inputs(), anew)?;
                store.part(RESULT_PART, || timing::run(&latency, &store, on_progress))
            }
        }
    }

    /// Reads the result of an earlier run from `folder`; `None` if the experiment is not finished there.
    ///
    /// # Errors
    /// If a spec is missing, or if the folder cannot be read.
    pub fn finished(&self, folder: &Path, extent: Extent) -> Result<Option<ExperimentResult>, StudyError> {
        let store = match self.work(extent)? {
            Work::GainCurves(spec, heads) => PartStore::existing(folder, &inputs(extent, spec, &heads))?,
            Work::Latency(latency) => PartStore::existing(folder, &latency.inputs())?,
        };
        store.filter(|store| store.has(RESULT_PART)).map(|store| store.get(RESULT_PART)).transpose()
    }

    /// Loads the specs that the experiment refers to.
    fn work(&self, extent: Extent) -> Result<Work<'_>, StudyError> {
        Ok(match (&self.spec, extent) {
            (ExperimentSpec::GainCurves(spec), _) => Work::GainCurves(spec, spec.heads(&self.source)?),
            (ExperimentSpec::Latency(spec), Extent::Whole) => {
                Work::Latency(Box::new(LatencyStudy::new(spec, &self.source)?))
            }
            (ExperimentSpec::Latency(spec), Extent::Quick) => {
                Work::Latency(Box::new(LatencyStudy::new(&spec.shortened(), &self.source)?))
            }
        })
    }
}

/// An experiment with all specs that it refers to.
enum Work<'a> {
    GainCurves(&'a GainCurvesSpec, Vec<HeadSpec>),
    Latency(Box<LatencyStudy>),
}

/// Everything that determines the result of a gain curve experiment.
fn inputs(extent: Extent, spec: &GainCurvesSpec, heads: &[HeadSpec]) -> impl Serialize {
    (env!("CARGO_PKG_VERSION"), extent, ExperimentSpec::GainCurves(spec.clone()), heads.to_vec())
}
