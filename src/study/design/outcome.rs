//! Search by outcome: designs are compared by what the map of a journey is worth.

use super::evaluation::Candidate;
use super::journey::Journeys;
use super::limits::Violation;
use super::search::DesignSearch;
use super::verified::{Outcomes, Rejection, VerifiedDesign};
use crate::StudyError;
use crate::sweep::{Measure, Runner, pareto_set, spread};
use rayon::prelude::*;
use std::path::Path;
use zsim_base::parallel::PieceProgress;
use zsim_base::spec::Named;
use zsim_dynamics::HeadSpec;

/// Fraction of the progress for the simulations under the shake.
const VERIFIED: f64 = 0.1;

impl DesignSearch {
    /// Simulates evenly distributed designs, first under the shake, then in the journeys, and selects the Pareto set of all
    /// goals.
    ///
    /// # Errors
    /// When a simulation cannot be set up, or as [`Journeys::figures`] for `folder`, `anew` and `runner`.
    pub(super) fn outcomes(
        &self,
        journeys: &Journeys,
        feasible: &[Candidate],
        folder: &Path,
        anew: bool,
        runner: &Runner<'_>,
    ) -> Result<Outcomes, StudyError> {
        // A journey depends on how the head swings, so designs differ in that too.
        let features = |candidate: &Candidate| {
            const SWING: [Measure; 3] =
                [Measure::named("rocking_hz"), Measure::named("field_of_view_deg"), Measure::named("rate_deg_per_s")];
            let swing = SWING.map(|measure| measure.cost_of_head(&candidate.figures));
            candidate.costs.iter().copied().chain(swing).collect::<Vec<f64>>()
        };
        let chosen = spread(&feasible.iter().map(features).collect::<Vec<_>>(), journeys.designs);
        let verifying = |fraction: f64| (runner.on_progress)(VERIFIED * fraction);
        let pieces = PieceProgress::new(chosen.len(), &verifying);
        let results = chosen.par_iter().map(|k| {
            let result = self.verify(&feasible[*k]);
            pieces.finish_one();
            result
        });
        let (mut verified, mut rejections) = (Vec::new(), Vec::new());
        for result in results.collect::<Result<Vec<_>, StudyError>>()? {
            match result {
                Ok(design) => verified.push(design),
                Err(rejection) => rejections.push(rejection),
            }
        }
        let heads: Vec<Named<HeadSpec>> = verified.iter().enumerate().map(|at| self.named_head(at)).collect();
        let travelling = |fraction: f64| (runner.on_progress)(VERIFIED + (1.0 - VERIFIED) * fraction);
        let figures = journeys.figures(&heads, folder, anew, &Runner { on_progress: &travelling, ..*runner })?;
        let mut travelled = Vec::new();
        for (mut design, figures) in verified.into_iter().zip(figures) {
            let rejected = match figures {
                Err(error) => Some((error, None)),
                Ok(figures) => {
                    design.journey = figures;
                    self.violated_in_journeys(&design).map(|worst| (worst.limit.to_owned(), worst.value))
                }
            };
            match rejected {
                None => {
                    let goals = self.spec().goals.iter();
                    design.candidate.costs = goals.map(|goal| goal.cost(design.cost_figure(goal.measure))).collect();
                    travelled.push(design);
                }
                Some((limit, value)) => {
                    rejections.push(Rejection { coil: design.candidate.coil, simulated: true, limit, value });
                }
            }
        }
        let costs = |designs: &[VerifiedDesign]| designs.iter().map(|design| design.candidate.costs.clone()).collect();
        let cloud = self.first_two_goals().map_or(Vec::new(), |goals| {
            let figures = |design: &VerifiedDesign| goals.map(|goal| design.cost_figure(goal)).into();
            travelled.iter().map(figures).collect()
        });
        let all: Vec<Vec<f64>> = costs(&travelled);
        let front: Vec<VerifiedDesign> = pareto_set(&all).into_iter().map(|k| travelled[k].clone()).collect();
        let selected = spread(&costs(&front), self.spec().candidates);
        let candidates = selected.into_iter().map(|k| front[k].clone()).collect();
        Ok(Outcomes { candidates, pareto: front.len(), rejections, cloud })
    }

    /// The head on the spring of a design, named by its number, from 1, and its coil.
    fn named_head(&self, (index, design): (usize, &VerifiedDesign)) -> Named<HeadSpec> {
        let coil = &design.candidate.coil;
        let mut head = Named::in_memory(format!("{} {}", index + 1, coil.label()), self.evaluator.head_on(coil));
        head.folder.clone_from(&self.evaluator.source.folder);
        head
    }

    /// The limit with the largest violation in the journeys of a design; touching coils violate one.
    fn violated_in_journeys(&self, design: &VerifiedDesign) -> Option<Violation> {
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
        Violation::worst(&violations).cloned()
    }
}
