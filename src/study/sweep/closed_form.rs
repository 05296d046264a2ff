//! Runs that are evaluated in closed form.

use super::part::RunOutcome;
use super::tree::ClosedForm;
use super::{Measure, Plan};
use crate::study::StudyError;
use crate::study::spring::{DesignMetrics, closed_form};
use std::time::Instant;

/// Evaluates run `index`. A failure, such as a head without static equilibrium, is recorded as an error.
pub(super) fn evaluate(plan: &Plan, measures: &[Measure], index: u64) -> RunOutcome {
    let started = Instant::now();
    let outcome = match figures(plan, index) {
        Ok(of) => RunOutcome {
            figures: measures.iter().map(|measure| figure(*measure, &of)).collect(),
            ..RunOutcome::default()
        },
        Err(error) => RunOutcome::from_error(measures.len(), &error),
    };
    RunOutcome { wall_s: Some(started.elapsed().as_secs_f64()), ..outcome }
}

fn figures(plan: &Plan, index: u64) -> Result<DesignMetrics, StudyError> {
    let inputs = plan.inputs(index)?.closed_form();
    let ClosedForm { shake, head } = inputs.map_err(|message| StudyError::Plan { what: "run", message })?;
    closed_form(&head.spec, &head.source(), &shake)
}

fn figure(measure: Measure, of: &DesignMetrics) -> Option<f64> {
    match measure {
        Measure::RockingHz => Some(of.rocking_hz),
        Measure::PeakGain => Some(of.peak_gain),
        Measure::SagMm => Some(of.sag_mm),
        Measure::SpringMassG => of.spring_mass_g,
        Measure::FieldOfViewDeg => Some(of.field_of_view_deg),
        Measure::RateDegPerS => Some(of.rate_deg_per_s),
        Measure::StressShare => of.stress_share,
        _ => None,
    }
}
