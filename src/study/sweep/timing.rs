//! Runs with timing errors: their measures, and the latency study that they make up.

use super::bootstrap::pooled;
use super::{BaseSpec, Journey, Measure, Sweep};
use crate::StudyError;
use crate::atomic_file::write_text;
use crate::latency::{ClockState, LatencyResult, MapErrors, csv, curve_figure, map_figure};
use zsim_base::files::subfolder;

/// A measure of a run with timing errors.
pub(super) fn figure(errors: &MapErrors, measure: Measure) -> Option<f64> {
    let sum = pooled(&errors.blocks);
    let figure = match measure {
        Measure::PositionRmseM => sum.position_variance_m2().sqrt(),
        Measure::CloudSigmaM => sum.cloud_variance_m2().sqrt(),
        Measure::CloudBiasM => sum.cloud_bias_m(),
        Measure::ClockErrorS => errors.clock_error_ms * 1e-3,
        _ => return None,
    };
    Some(figure).filter(|figure| figure.is_finite())
}

impl Sweep {
    /// The latency study of the finished sweep; `None` if its runs have no timing errors, if a run failed or is missing, or
    /// if several runs have the same timing.
    ///
    /// # Errors
    /// If a part cannot be read.
    pub(super) fn latency_result(&self) -> Result<Option<LatencyResult>, StudyError> {
        if !matches!(self.plan.spec().base, BaseSpec::Journey { timing: Some(_), .. }) {
            return Ok(None);
        }
        let Some(errors) = self.details::<MapErrors>()? else { return Ok(None) };
        let inputs =
            self.units.iter().map(|unit| Ok(self.plan.journey(unit.first, &self.plan.inputs(unit.first)?)?.inputs));
        let inputs: Vec<Journey> = inputs.collect::<Result<_, StudyError>>()?;
        Ok(LatencyResult::of(&inputs.into_iter().zip(errors).collect::<Vec<_>>()))
    }

    /// Writes `latency.csv`, `metrics.json` and the plots of a latency study.
    pub(super) fn write_latency(&self, study: &LatencyResult) -> Result<(), StudyError> {
        for (name, text) in [("latency.csv", csv(study)), ("metrics.json", serde_json::to_string_pretty(study)? + "\n")]
        {
            write_text(&self.temporary(), &self.folder.join(name), &text)?;
        }
        let plots = subfolder(&self.folder, "plots").map_err(StudyError::file(&self.folder))?;
        map_figure(study, ClockState::Off).save(&plots, "maps")?;
        map_figure(study, ClockState::On).save(&plots, "maps_clock_on")?;
        curve_figure(study).save(&plots, "curves")?;
        Ok(())
    }
}
