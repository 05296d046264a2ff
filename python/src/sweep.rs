//! Sweeps.

use crate::background;
use crate::failure::Failure;
use pyo3::prelude::*;
use std::path::{Path, PathBuf};
use zsim::spec::{Kind, NamedSpec, find};
use zsim::study::sweep::{BaseSpec, Plan, Runner, Shard, SweepSpec};

/// Does the missing runs of the sweep `spec` in the folder `out`, and merges them.
#[pyfunction]
#[pyo3(signature = (spec, out, program, progress))]
pub fn sweep(
    py: Python<'_>,
    spec: &str,
    out: PathBuf,
    program: Option<PathBuf>,
    progress: Option<Py<PyAny>>,
) -> Result<(), Failure> {
    let source = find(Kind::Study, spec)?;
    let name = Path::new(spec).file_stem().unwrap_or_default().to_string_lossy().into_owned();
    background::run(py, progress.as_ref(), move |progress| {
        let plan = Plan::new(&name, &SweepSpec::parse(&source)?, &source)?;
        if program.is_none() && matches!(plan.spec().base, BaseSpec::Journey { .. }) {
            let message = "full runs need the command zsim in PATH, or its path as program=: each run is a process";
            return Err(Failure::input(message));
        }
        let planned = plan.write(&out, false)?;
        let on_progress = |fraction: f64| progress.set("sweeping", fraction);
        let program = program.unwrap_or_default();
        planned
            .run(Shard::WHOLE, &Runner { program: &program, stop: progress.stop_flag(), on_progress: &on_progress })?;
        planned.merge_and_report()?;
        Ok(())
    })
}
