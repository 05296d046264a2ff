//! The paper's experiments again, by name: what it found, what we find, and the command that finds it.
//!
//! An experiment is a spec ([`ExperimentSpec`], the files of `specs/experiments/`). [`Experiment::run`] leaves its
//! figures in a folder of its own, and what each part of the work came to beside them, so that one that was stopped
//! goes on. From all that is finished [`paper_table`] makes one table.

mod damping;
mod finding;
mod gain_curves;
mod gain_plots;
pub(super) mod kept;
mod spec;
mod timing;

pub use damping::{Fit, FittedPeak, fit_damping};
pub use finding::{Finding, Row, TABLE_HEADING, paper_table};
pub use spec::{DesignedSpec, ExperimentSpec, GainCurvesSpec, PeaksSpec};

use super::latency::Latency;
use super::{OnProgress, StudyError};
use crate::dynamics::HeadSpec;
use crate::spec::{Kind, Source, find, names, parse};
use kept::Kept;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// How much of an experiment is done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Extent {
    /// All of it.
    Whole,
    /// So little that it takes seconds: to see that it runs. Its figures are no results.
    Quick,
}

/// The part that is finished last.
const FINDING: &str = "finding";

/// An experiment about to be run.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// The name that it was found by, perhaps a path.
    pub given: String,
    /// Its name: that of its spec's file, without folder and ending.
    pub name: String,
    spec: ExperimentSpec,
    source: Source,
}

impl Experiment {
    /// The experiment called `name`: a path, or a name in the library.
    ///
    /// # Errors
    /// When there is none, its spec is wrong, or names a head that is.
    pub fn load(name: &str) -> Result<Self, StudyError> {
        let source = find(Kind::Experiment, name)?;
        let spec: ExperimentSpec = parse(&source)?;
        spec.check(&source)?;
        let stem = Path::new(name).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self { given: name.to_owned(), name: stem, spec, source })
    }

    /// The names of all experiments that are built in, sorted.
    pub fn all() -> Vec<String> {
        names(Kind::Experiment)
    }

    /// Does what is not yet done of it in `folder`; `on_progress` is told how far it is.
    ///
    /// What it leaves does not depend on the number of threads, nor on where an earlier run was stopped.
    ///
    /// # Errors
    /// When the folder holds another experiment's work (or this one's by another spec or version) and `anew` does not
    /// allow to throw it away, something cannot be simulated, or a file not be written.
    pub fn run(
        &self,
        folder: &Path,
        extent: Extent,
        anew: bool,
        on_progress: OnProgress<'_>,
    ) -> Result<Finding, StudyError> {
        match self.work(extent)? {
            Work::GainCurves(spec, heads) => {
                let kept = Kept::open(folder, &made_from(extent, spec, &heads), anew)?;
                kept.part(FINDING, || gain_curves::run(spec, &heads, extent, &kept, on_progress))
            }
            Work::Latency(latency) => {
                let kept = Kept::open(folder, &latency.made_from(), anew)?;
                kept.part(FINDING, || timing::run(&latency, &kept, on_progress))
            }
        }
    }

    /// What an earlier run found and left in `folder`; `None` where this experiment is not finished there.
    ///
    /// # Errors
    /// When a spec is gone, or the folder cannot be read.
    pub fn finished(&self, folder: &Path, extent: Extent) -> Result<Option<Finding>, StudyError> {
        let kept = match self.work(extent)? {
            Work::GainCurves(spec, heads) => Kept::existing(folder, &made_from(extent, spec, &heads))?,
            Work::Latency(latency) => Kept::existing(folder, &latency.made_from())?,
        };
        kept.filter(|kept| kept.has(FINDING)).map(|kept| kept.get(FINDING)).transpose()
    }

    fn work(&self, extent: Extent) -> Result<Work<'_>, StudyError> {
        Ok(match (&self.spec, extent) {
            (ExperimentSpec::GainCurves(spec), _) => Work::GainCurves(spec, spec.heads(&self.source)?),
            (ExperimentSpec::Latency(spec), Extent::Whole) => {
                Work::Latency(Box::new(Latency::new(spec, &self.source)?))
            }
            (ExperimentSpec::Latency(spec), Extent::Quick) => {
                Work::Latency(Box::new(Latency::new(&spec.shortened(), &self.source)?))
            }
        })
    }
}

/// An experiment with what its spec names.
enum Work<'a> {
    GainCurves(&'a GainCurvesSpec, Vec<HeadSpec>),
    Latency(Box<Latency>),
}

/// All that the work on gain curves depends on.
fn made_from(extent: Extent, spec: &GainCurvesSpec, heads: &[HeadSpec]) -> impl Serialize {
    (env!("CARGO_PKG_VERSION"), extent, ExperimentSpec::GainCurves(spec.clone()), heads.to_vec())
}
