//! Runs that are closed forms.

use super::component::{Component, Slot};
use super::part::Row;
use super::{Measure, Plan};
use crate::study::StudyError;
use crate::study::spring::{DesignMetrics, closed_form};
use std::time::Instant;

/// What comes of run `index`; that its head falls is a row too.
pub(super) fn row(plan: &Plan, told: &[Measure], index: u64) -> Row {
    let started = Instant::now();
    let row = match figures(plan, index) {
        Ok(of) => Row { figures: told.iter().map(|measure| figure(*measure, &of)).collect(), ..Row::default() },
        Err(error) => Row::failed_by(told.len(), &error),
    };
    Row { wall_s: Some(started.elapsed().as_secs_f64()), ..row }
}

fn figures(plan: &Plan, index: u64) -> Result<DesignMetrics, StudyError> {
    let changed = plan.changed(index)?;
    let (head, run) = (plan.filled(&changed, Slot::Head)?, plan.filled(&changed, Slot::Run)?);
    let (Component::Head(spec), Component::Nod(nod)) = (&head.component, &run.component) else {
        let message = "a spec is not of its slot's kind".to_owned();
        return Err(StudyError::Plan { what: "the plan", message });
    };
    closed_form(spec, &head.source(), &nod.shake)
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
