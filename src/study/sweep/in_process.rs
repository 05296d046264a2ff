//! Runs that are evaluated in this process: closed forms, and gains of a head.

use super::outcome::RunOutcome;
use super::tree::{ClosedForm, GainRun};
use super::{BaseSpec, Measure, Plan};
use crate::StudyError;
use std::time::Instant;
use zsim_base::spec;
use zsim_dynamics::HeadModel;
use zsim_head::gains::{GainWatch, gain_curve};
use zsim_head::spring::{MISSION_HOURS, closed_form};
use zsim_run::Results;

/// Evaluates run `index`. A failure, such as a head without static equilibrium, is recorded as an error.
pub(super) fn evaluate(plan: &Plan, measures: &[Measure], index: u64) -> RunOutcome {
    let started = Instant::now();
    let evaluated = match plan.spec().base {
        BaseSpec::Gains { .. } => gains(plan, measures, index),
        _ => metrics(plan, measures, index),
    };
    let outcome = evaluated.unwrap_or_else(|error| RunOutcome::from_error(measures.len(), &error));
    RunOutcome { times: vec![Some(started.elapsed().as_secs_f64())], ..outcome }
}

fn metrics(plan: &Plan, measures: &[Measure], index: u64) -> Result<RunOutcome, StudyError> {
    let inputs = plan.inputs(index)?.closed_form();
    let ClosedForm { shake, head } = inputs.map_err(|message| StudyError::Plan { what: "run", message })?;
    let head = Some(closed_form(&head.spec, &head.source(), &shake, MISSION_HOURS)?);
    Ok(RunOutcome {
        figures: super::figures(&Results { head, ..Results::default() }, measures),
        ..RunOutcome::default()
    })
}

/// Measures a gain curve, which is the detail of the run.
fn gains(plan: &Plan, measures: &[Measure], index: u64) -> Result<RunOutcome, StudyError> {
    let inputs = plan.inputs(index)?.gain_run();
    let GainRun { gains, head } = inputs.map_err(|message| StudyError::Plan { what: "run", message })?;
    let head = HeadModel::new(&head.spec, &head.source())?;
    let curve = gain_curve(&head, gains.axis, &gains.plan(), GainWatch::silent())?;
    let peak_gain = curve.peak.map(|peak| peak.gain);
    let figures = super::figures(&Results { peak_gain, ..Results::default() }, measures);
    Ok(RunOutcome { figures, details: Some(spec::to_text(&curve)?), ..RunOutcome::default() })
}
