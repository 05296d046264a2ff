//! Runs with timing errors: their measures, and the latency study that they make up.

use super::{BaseSpec, JourneySpec, Sweep};
use crate::StudyError;
use crate::latency::{LatencyResult, csv, curve_figure, map_figure};
use zsim_base::files::FileError;
use zsim_base::files::subfolder;
use zsim_base::files::write_text;
use zsim_run::RunInputs;
use zsim_run::timing::{ClockState, MapErrors};

impl Sweep {
    /// The latency study of the finished sweep; `None` if its runs have no timing errors, if a run failed or is missing, or
    /// if several runs have the same timing.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub(super) fn latency_result(&self) -> Result<Option<LatencyResult>, StudyError> {
        if !matches!(self.plan.spec().base, BaseSpec::Journey(JourneySpec { timing: Some(_), .. })) {
            return Ok(None);
        }
        let Some(errors) = self.details::<MapErrors>()? else { return Ok(None) };
        let inputs = (0..self.plan.runs()).map(|run| Ok(self.plan.journey(run, &self.plan.inputs(run)?)?.inputs));
        let inputs: Vec<RunInputs> = inputs.collect::<Result<_, StudyError>>()?;
        Ok(LatencyResult::of(&inputs.into_iter().zip(errors).collect::<Vec<_>>()))
    }

    /// Writes `latency.csv`, `metrics.json` and the plots of a latency study.
    pub(super) fn write_latency(&self, study: &LatencyResult) -> Result<(), StudyError> {
        for (name, text) in [("latency.csv", csv(study)), ("metrics.json", serde_json::to_string_pretty(study)? + "\n")]
        {
            write_text(&self.temporary(), &self.folder.join(name), &text)?;
        }
        let plots = subfolder(&self.folder, "plots").map_err(FileError::at(&self.folder))?;
        map_figure(study, ClockState::Off).save(&plots, "maps")?;
        map_figure(study, ClockState::On).save(&plots, "maps_clock_on")?;
        curve_figure(study).save(&plots, "curves")?;
        Ok(())
    }
}
