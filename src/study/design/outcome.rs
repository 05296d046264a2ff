//! Search by outcome: designs are compared by what the map of a journey is worth.

use super::evaluation::Candidate;
use super::journey::Journeys;
use super::limits::Violation;
use super::search::DesignSearch;
use super::verified::{Outcomes, Rejection, VerifiedDesign};
use crate::StudyError;
use crate::sweep::{Measure, pareto_set, spread};
use std::sync::{Mutex, PoisonError};
use zsim_base::parallel::OnProgress;
use zsim_base::parallel::PieceProgress;
use zsim_base::parallel::for_each_on_threads;
use zsim_run::RunError;

impl DesignSearch {
    /// Simulates evenly distributed designs, first under the shake, then in the journeys, and selects the Pareto set of all
    /// goals.
    ///
    /// # Errors
    /// When a simulation cannot be set up.
    pub(super) fn outcomes(
        &self,
        journeys: &Journeys,
        feasible: &[Candidate],
        on_progress: OnProgress<'_>,
    ) -> Result<Outcomes, StudyError> {
        // A journey depends on how the head swings, so designs differ in that too.
        let features = |candidate: &Candidate| {
            const SWING: [Measure; 3] =
                [Measure::named("rocking_hz"), Measure::named("field_of_view_deg"), Measure::named("rate_deg_per_s")];
            let swing = SWING.map(|measure| measure.cost_of_head(&candidate.figures));
            candidate.costs.iter().copied().chain(swing).collect::<Vec<f64>>()
        };
        let chosen = spread(&feasible.iter().map(features).collect::<Vec<_>>(), journeys.designs);
        let pieces = PieceProgress::new(chosen.len(), on_progress);
        let results = Mutex::new(vec![None; chosen.len()]);
        for_each_on_threads(chosen.len(), rayon::current_num_threads(), |_, k| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
            let result = pool.install(|| self.travel(journeys, &feasible[chosen[k]]))?;
            results.lock().unwrap_or_else(PoisonError::into_inner)[k] = Some(result);
            pieces.finish_one();
            Ok::<(), StudyError>(())
        })?;
        let (mut verified, mut rejections) = (Vec::new(), Vec::new());
        for result in results.into_inner().unwrap_or_else(PoisonError::into_inner).into_iter().flatten() {
            match result {
                Ok(design) => verified.push(design),
                Err(rejection) => rejections.push(rejection),
            }
        }
        let costs = |designs: &[VerifiedDesign]| designs.iter().map(|design| design.candidate.costs.clone()).collect();
        let cloud = self.first_two_goals().map_or(Vec::new(), |goals| {
            let figures = |design: &VerifiedDesign| goals.map(|goal| design.cost_figure(goal)).into();
            verified.iter().map(figures).collect()
        });
        let all: Vec<Vec<f64>> = costs(&verified);
        let front: Vec<VerifiedDesign> = pareto_set(&all).into_iter().map(|k| verified[k].clone()).collect();
        let selected = spread(&costs(&front), self.spec().candidates);
        let candidates = selected.into_iter().map(|k| front[k].clone()).collect();
        Ok(Outcomes { candidates, pareto: front.len(), rejections, cloud })
    }

    /// Simulates a design under the shake and in the journeys; returns it with its costs for all goals, or the limit that it
    /// violates.
    fn travel(
        &self,
        journeys: &Journeys,
        candidate: &Candidate,
    ) -> Result<Result<VerifiedDesign, Rejection>, StudyError> {
        let mut design = match self.verify(candidate)? {
            Ok(design) => design,
            Err(rejection) => return Ok(Err(rejection)),
        };
        let coil = &candidate.coil;
        let reject =
            |limit: String, value: Option<f64>| Rejection { coil: coil.clone(), simulated: true, limit, value };
        design.journey = match journeys.figures(&self.evaluator.head_on(coil)) {
            Ok(figures) => figures,
            Err(error @ StudyError::Run(RunError::File(_))) => return Err(error),
            Err(error) => return Ok(Err(reject(error.to_string(), None))),
        };
        let contact_s = design.journey.get(&Measure::COIL_CONTACT_S).copied().filter(|contact_s| *contact_s > 0.0);
        let contact = contact_s.map(|contact_s| Violation {
            limit: Measure::COIL_CONTACT_S.key(),
            value: Some(contact_s),
            excess: f64::INFINITY,
        });
        let of_measures = self.spec().limits.iter().filter_map(|limit| {
            let value = *design.journey.get(&limit.measure)?;
            let excess = limit.excess(value);
            (excess > 0.0).then(|| Violation { limit: limit.measure.key(), value: Some(value), excess })
        });
        let violations: Vec<Violation> = of_measures.chain(contact).collect();
        if let Some(worst) = Violation::worst(&violations) {
            return Ok(Err(reject(worst.limit.to_owned(), worst.value)));
        }
        let goals = self.spec().goals.iter();
        design.candidate.costs = goals.map(|goal| goal.cost(design.cost_figure(goal.measure))).collect();
        Ok(Ok(design))
    }
}
