//! Search: exploration of the design space, Pareto set and verification.

use super::evaluation::{Candidate, Evaluation, Evaluator};
use super::journey::Journeys;
use super::limits::Violation;
use super::optimise::{Scales, optimise, weights};
use super::space::Space;
use super::spec::{CoilDesign, DesignSpec};
use super::verified::{Outcomes, Rejection, VerifiedDesign};
use crate::StudyError;
use crate::sweep::{Measure, Runner, check_folder_name, pareto_set, spread};
use rand::RngExt;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;
use zsim_base::parallel::OnProgress;
use zsim_base::parallel::PieceProgress;
use zsim_base::random::Seed;
use zsim_base::spec::{Kind, NamedSpec, Source, SpecError, find_from, parse_named};
use zsim_dynamics::{HeadSpec, LinkageSpec};
use zsim_head::HeadError;
use zsim_head::coverage::CoveragePlan;
use zsim_head::spring::{Wire, simulated};
use zsim_sensors::{Lidar, LidarSpec};

/// Result of a search.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DesignStudy {
    /// The spec as used.
    pub spec: DesignSpec,
    /// Number of evaluated designs.
    pub evaluated: usize,
    /// Number of feasible designs.
    pub feasible: usize,
    /// Number of infeasible designs by the limit with the largest violation.
    pub rejected: BTreeMap<String, usize>,
    /// Number of designs in the Pareto set.
    pub pareto: usize,
    /// Verified designs of the Pareto set, in the order of the first goal.
    pub candidates: Vec<VerifiedDesign>,
    /// The rejected springs of a catalogue, and the designs that the simulation rejected.
    pub rejections: Vec<Rejection>,
    /// Metrics of the first two goals for each feasible design, for the plot.
    #[serde(skip)]
    pub cloud: Vec<(f64, f64)>,
}

impl DesignSpec {
    /// Whether `folder` has the journeys of an interrupted or finished search.
    pub fn has_journeys_in(&self, folder: &Path) -> bool {
        self.journey.is_some() && folder.join(JOURNEYS).is_dir()
    }
}

impl DesignStudy {
    /// The measures that the candidates have of their journeys.
    pub fn journey_measures(&self) -> Vec<Measure> {
        self.candidates.first().map_or(Vec::new(), |design| design.journey.keys().copied().collect())
    }
}

/// Result of the exploration of a design space.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Exploration {
    /// The feasible designs.
    pub feasible: Vec<Candidate>,
    /// Number of evaluated designs.
    pub evaluated: usize,
    /// Number of infeasible designs by the limit with the largest violation.
    pub rejected: BTreeMap<String, usize>,
    /// The rejected springs of a catalogue.
    pub rejections: Vec<Rejection>,
}

/// A search for a spring.
pub struct DesignSearch {
    pub(super) evaluator: Evaluator,
    lidar: Lidar,
    space: Space,
    journeys: Option<Journeys>,
}

/// Folder of the journeys.
const JOURNEYS: &str = "journeys";

/// Number of runs of CMA-ES, each with different weights of the goals.
const OPTIMISER_RUNS: usize = 16;

/// Fraction of the evaluations for the initial uniform sampling.
const SAMPLED_FRACTION: f64 = 0.4;

/// Fractions of the progress for the exploration, without and with journeys.
const EXPLORED: f64 = 0.5;
const EXPLORED_WITH_JOURNEYS: f64 = 0.05;

/// Maximum numbers of evaluations, of verified designs, and of designs and seeds of journeys: their results are in memory.
const MAX_EVALUATIONS: usize = 1_000_000;
const MAX_CANDIDATES: usize = 1000;
const MAX_DESIGNS: usize = 10_000;
const MAX_SEEDS: usize = 1000;

/// Maximum number of simulated designs over the number of requested candidates: rejected ones are replaced.
const MAX_SIMULATED: usize = 4;

/// Checks the counts of a spec.
fn check_counts(spec: &DesignSpec, source: &Source) -> Result<(), SpecError> {
    let journey = spec.journey.as_ref();
    let counts = [
        ("evaluations", spec.evaluations, MAX_EVALUATIONS),
        ("candidates", spec.candidates, MAX_CANDIDATES),
        ("designs", journey.map_or(0, |journey| journey.designs), MAX_DESIGNS),
        ("seeds", journey.map_or(0, |journey| journey.seeds.len()), MAX_SEEDS),
    ];
    match counts.into_iter().find(|(_, found, most)| found > most) {
        None => Ok(()),
        Some((key, found, most)) => {
            Err(SpecError::about(source, key, format!("{found} {key}: expected at most {most}")))
        }
    }
}

impl DesignSearch {
    /// Creates the search that `spec`, read from `source`, describes.
    ///
    /// # Errors
    /// When a named spec does not exist, bounds are reversed, no wire is available, or there are no goals or evaluations.
    pub fn new(spec: &DesignSpec, source: &Source) -> Result<Self, StudyError> {
        check_folder_name(spec.name.as_deref(), source)?;
        let head_source = find_from(Kind::Head, source, &spec.head)?;
        let head = HeadSpec::read(&head_source)?;
        if !matches!(head.linkage, LinkageSpec::Spring { .. }) {
            let message = format!("the head \"{}\" has no spring to replace", spec.head);
            return Err(SpecError::about(source, "head", message).into());
        }
        let lidar_source = find_from(Kind::Lidar, source, &spec.lidar)?;
        let lidar = Lidar::new(&LidarSpec::parse(&lidar_source)?, &lidar_source)?;
        if spec.goals.is_empty() {
            return Err(SpecError::about(source, "goals", "at least one goal is required").into());
        }
        check_measures(spec, source)?;
        spec.shake.check().map_err(|message| SpecError::about(source, "frequency_hz", message))?;
        if spec.evaluations == 0 || spec.candidates == 0 {
            return Err(SpecError::about(source, "evaluations", "evaluations and candidates must be at least 1").into());
        }
        check_counts(spec, source)?;
        let space = Space::of(spec, source)?;
        for goal in &spec.goals {
            if let Some(missing) = space.missing_for(goal.measure) {
                let key = goal.measure.key();
                let message =
                    format!("{key} needs the {missing} of the material: remove the goal, or state it in moduli(...)");
                return Err(SpecError::about(source, key, message).into());
            }
        }
        let load = |journey| Journeys::load(journey, spec, measures(spec), source);
        let journeys = spec.journey.as_ref().map(load).transpose()?;
        Ok(Self { evaluator: Evaluator { spec: spec.clone(), head, source: head_source }, lidar, space, journeys })
    }

    pub(super) fn spec(&self) -> &DesignSpec {
        &self.evaluator.spec
    }

    /// Explores the design space.
    ///
    /// `on_progress` is called after each evaluation.
    pub fn explore(&self, on_progress: OnProgress<'_>) -> Exploration {
        let total = match &self.space {
            Space::Catalogue(springs) => springs.len(),
            Space::Coils(_) => self.spec().evaluations,
        };
        let pieces = PieceProgress::new(total, on_progress);
        let evaluate = |coil: &CoilDesign| {
            let evaluation = self.evaluator.evaluate(coil);
            pieces.finish_one();
            evaluation
        };
        match &self.space {
            Space::Catalogue(springs) => {
                let evaluations: Vec<Evaluation> = springs.par_iter().map(evaluate).collect();
                let rejections = springs.iter().zip(&evaluations).filter_map(|(coil, e)| rejection(coil, e)).collect();
                Exploration { rejections, ..Exploration::of(evaluations) }
            }
            Space::Coils(coils) => Exploration::of(self.sample_and_optimise(&|point| evaluate(&coils.coil_at(point)))),
        }
    }

    /// Evaluates uniform samples of the unit cube, and then what the optimiser tries.
    fn sample_and_optimise(&self, evaluate: &(dyn Fn(&[f64]) -> Evaluation + Sync)) -> Vec<Evaluation> {
        let (seed, evaluations, goals) =
            (Seed(self.spec().seed), self.spec().evaluations, self.evaluator.goals().count());
        let mut stream = seed.stream("design/samples");
        // Without a goal in closed form there is nothing to optimise before the journeys.
        let sampled_fraction = if goals == 0 { 1.0 } else { SAMPLED_FRACTION };
        let samples = ((evaluations as f64 * sampled_fraction) as usize).max(1);
        let points: Vec<[f64; 4]> = (0..samples).map(|_| std::array::from_fn(|_| stream.random::<f64>())).collect();
        let sampled: Vec<Evaluation> = points.par_iter().map(|point| evaluate(point)).collect();
        let scales = Scales::of(&sampled, goals);
        let evaluations_per_run = (evaluations - samples) / OPTIMISER_RUNS;
        let runs = (0..OPTIMISER_RUNS).into_par_iter().map(|k| {
            let weights = weights(k, goals, &mut seed.part("design/weights", k as u64));
            let cost = |evaluation: &Evaluation| scales.cost(evaluation, &weights);
            let start = (0..samples).min_by(|a, b| cost(&sampled[*a]).total_cmp(&cost(&sampled[*b])));
            let start = start.map_or([0.5; 4], |k| points[k]);
            let mut stream = seed.part("design/optimiser", k as u64);
            optimise(&start, evaluations_per_run, &mut stream, &evaluate, &cost)
        });
        let optimised: Vec<Vec<Evaluation>> = runs.collect();
        sampled.into_iter().chain(optimised.into_iter().flatten()).collect()
    }

    /// Explores the design space and verifies a selection of the Pareto set.
    ///
    /// A design that is outside the limits in the simulation is replaced by another one of the set. The first part of the
    /// progress is the exploration, the second the simulations. Journeys are a [`Sweep`](crate::sweep::Sweep) in
    /// `folder/journeys`, which an interrupted search continues; `anew` permits to replace that of another search.
    ///
    /// # Errors
    /// When the simulations cannot be set up, when the search is stopped, or when `folder` has the journeys of another search
    /// or cannot be written.
    pub fn run(&self, folder: &Path, anew: bool, runner: &Runner<'_>) -> Result<DesignStudy, StudyError> {
        let on_progress = runner.on_progress;
        let explored = if self.journeys.is_some() { EXPLORED_WITH_JOURNEYS } else { EXPLORED };
        let mut found = self.explore(&|fraction| on_progress(explored * fraction));
        let simulating = |fraction| on_progress(explored + (1.0 - explored) * fraction);
        let outcomes = match &self.journeys {
            Some(journeys) => {
                let runner = Runner { on_progress: &simulating, ..*runner };
                self.outcomes(journeys, &found.feasible, &folder.join(JOURNEYS), anew, &runner)?
            }
            None => self.verified_front(&found.feasible, &simulating)?,
        };
        found.rejections.extend(outcomes.rejections);
        Ok(DesignStudy {
            spec: self.spec().clone(),
            evaluated: found.evaluated,
            feasible: found.feasible.len(),
            rejected: found.rejected,
            pareto: outcomes.pareto,
            candidates: outcomes.candidates,
            rejections: found.rejections,
            cloud: outcomes.cloud,
        })
    }

    /// The measures of the first two goals, or twice that of a single goal.
    pub(super) fn first_two_goals(&self) -> Option<[Measure; 2]> {
        let goals = &self.spec().goals;
        let first = goals.first()?.measure;
        Some([first, goals.get(1).map_or(first, |goal| goal.measure)])
    }

    /// The Pareto set in closed form, and verified designs of it.
    fn verified_front(&self, feasible: &[Candidate], on_progress: OnProgress<'_>) -> Result<Outcomes, StudyError> {
        let costs: Vec<Vec<f64>> = feasible.iter().map(|candidate| candidate.costs.clone()).collect();
        let front = pareto_set(&costs);
        let cloud = self.first_two_goals().map_or(Vec::new(), |goals| {
            feasible.iter().map(|c| goals.map(|goal| goal.cost_of_head(&c.figures)).into()).collect()
        });
        let (candidates, rejections) = self.verify_selection(feasible, &front, on_progress)?;
        Ok(Outcomes { candidates, pareto: front.len(), rejections, cloud })
    }

    /// Simulates evenly distributed designs of `front` until enough of them are within the limits.
    fn verify_selection(
        &self,
        feasible: &[Candidate],
        front: &[usize],
        on_progress: OnProgress<'_>,
    ) -> Result<(Vec<VerifiedDesign>, Vec<Rejection>), StudyError> {
        let wanted = self.spec().candidates;
        let pieces = PieceProgress::new(front.len().min(wanted), on_progress);
        let mut open: Vec<usize> = (0..front.len()).collect();
        let (mut verified, mut rejected): (Vec<(usize, VerifiedDesign)>, _) = (Vec::new(), Vec::new());
        while verified.len() < wanted && !open.is_empty() && rejected.len() + verified.len() < MAX_SIMULATED * wanted {
            let costs: Vec<Vec<f64>> = open.iter().map(|k| feasible[front[*k]].costs.clone()).collect();
            let chosen: Vec<usize> = spread(&costs, wanted - verified.len()).into_iter().map(|k| open[k]).collect();
            let results = chosen.par_iter().map(|k| {
                let result = self.verify(&feasible[front[*k]])?;
                if result.is_ok() {
                    pieces.finish_one();
                }
                Ok((*k, result))
            });
            for (k, result) in results.collect::<Result<Vec<_>, StudyError>>()? {
                match result {
                    Ok(design) => verified.push((k, design)),
                    Err(rejection) => rejected.push(rejection),
                }
            }
            open.retain(|k| !chosen.contains(k));
        }
        verified.sort_by_key(|(k, _)| *k);
        Ok((verified.into_iter().map(|(_, design)| design).collect(), rejected))
    }

    /// Simulates a design; returns the verified design, or the limit that it violates.
    pub(super) fn verify(&self, candidate: &Candidate) -> Result<Result<VerifiedDesign, Rejection>, StudyError> {
        let plan = CoveragePlan { from_s: 10.0, duration_s: 10.0, ..CoveragePlan::default() };
        let (coil, spec) = (&candidate.coil, self.spec());
        let head = self.evaluator.head_on(coil);
        let (metrics, coverage) =
            match simulated(&head, &self.evaluator.source, &spec.shake, &self.lidar, &plan, spec.build.mission_hours) {
                Ok(result) => result,
                Err(HeadError::Dynamics(error)) => {
                    let limit = format!("simulation: {error}");
                    return Ok(Err(Rejection { coil: coil.clone(), simulated: true, limit, value: None }));
                }
                Err(error) => return Err(error.into()),
            };
        if let Some(worst) = Violation::worst(&self.evaluator.violations(coil, &metrics)) {
            let (limit, value) = (worst.limit.to_owned(), worst.value);
            return Ok(Err(Rejection { coil: coil.clone(), simulated: true, limit, value }));
        }
        let wire = Wire::of(&coil.spring())?;
        Ok(Ok(VerifiedDesign {
            candidate: candidate.clone(),
            simulated: metrics,
            journey: BTreeMap::new(),
            unchecked: wire.map_or(Vec::new(), |wire| self.evaluator.unchecked(&wire)),
            fraction_seen: coverage.fraction_seen,
            saturated: coverage.gyro.saturated,
        }))
    }
}

/// The measures of the goals and limits of a search.
fn measures(spec: &DesignSpec) -> impl Iterator<Item = Measure> {
    spec.goals.iter().map(|goal| goal.measure).chain(spec.limits.iter().map(|limit| limit.measure))
}

/// Checks that goals and limits have figures.
fn check_measures(spec: &DesignSpec, source: &Source) -> Result<(), SpecError> {
    for measure in measures(spec) {
        let key = measure.key();
        let message = match (measure.has_closed_form(), measure.needs_journey()) {
            (true, _) => continue,
            (false, true) if spec.journey.is_some() => continue,
            (false, true) => format!(
                "{key} is a figure of a journey: add `journey: (scene: ..., ...)` (as specs/studies/spring_office.ron)"
            ),
            (false, false) => format!("{key} cannot be a goal or a limit of a spring search: remove it"),
        };
        return Err(SpecError::about(source, key, message));
    }
    Ok(())
}

impl Exploration {
    fn of(evaluations: Vec<Evaluation>) -> Self {
        let mut exploration = Self { evaluated: evaluations.len(), ..Self::default() };
        for evaluation in evaluations {
            if let Some(limit) = evaluation.rejected_by() {
                *exploration.rejected.entry(limit.to_owned()).or_default() += 1;
            }
            if let Evaluation::Feasible(candidate) = evaluation {
                exploration.feasible.push(*candidate);
            }
        }
        exploration
    }
}

fn rejection(coil: &CoilDesign, evaluation: &Evaluation) -> Option<Rejection> {
    let value = match evaluation {
        Evaluation::Infeasible(violations) => Violation::worst(violations).and_then(|violation| violation.value),
        Evaluation::Feasible(_) | Evaluation::Invalid(_) => None,
    };
    let limit = evaluation.rejected_by()?.to_owned();
    Some(Rejection { coil: coil.clone(), simulated: false, limit, value })
}

impl NamedSpec for DesignSpec {
    const KIND: Kind = Kind::Study;
    type Error = SpecError;

    fn parse(source: &Source) -> Result<Self, SpecError> {
        parse_named(source)
    }

    fn check_model(&self, source: &Source) -> Result<Vec<String>, SpecError> {
        match DesignSearch::new(self, source) {
            Ok(_) => Ok(Vec::new()),
            Err(StudyError::Spec(error)) => Err(error),
            Err(error) => Err(SpecError::plain(&source.name, error.to_string())),
        }
    }
}
