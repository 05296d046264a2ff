//! Search: evaluation of designs, Pareto set and verification.

use super::{CoilDesign, DesignSpec, SpaceSpec, catalogue};
use crate::dynamics::{HeadSpec, LinkageSpec};
use crate::elasticity::Material;
use crate::random::{Seed, Stream};
use crate::sensors::Lidar;
use crate::spec::{Kind, Source, SpecError, find_from, parse};
use crate::study::coverage::CoveragePlan;
use crate::study::progress::PieceProgress;
use crate::study::spring::{DesignMetrics, closed_form, simulated};
use crate::study::sweep::{pareto_set, spread};
use crate::study::{OnProgress, StudyError};
use cmaes::{CMAESOptions, DVector};
use rand::RngExt;
use rayon::prelude::*;
use serde::Serialize;

/// A feasible design.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// The coil.
    pub coil: CoilDesign,
    /// Metrics in closed form.
    pub figures: DesignMetrics,
    /// Cost for each goal; lower is better.
    pub costs: Vec<f64>,
}

/// A design of the Pareto set with the result of a full simulation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerifiedDesign {
    /// The design.
    #[serde(flatten)]
    pub candidate: Candidate,
    /// Metrics by simulation; `None` if it failed.
    pub simulated: Option<DesignMetrics>,
    /// Whether the simulated metrics are within all limits.
    pub holds: bool,
    /// Fraction of the sphere that the lidar covered.
    pub fraction_seen: Option<f64>,
    /// Fraction of the time in which the gyroscope was saturated.
    pub saturated: Option<f64>,
    /// The reason why the simulation failed.
    pub failed: Option<String>,
}

/// Result of a search.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DesignStudy {
    /// The spec as used.
    pub spec: DesignSpec,
    /// Number of evaluated designs.
    pub evaluated: usize,
    /// Number of feasible designs.
    pub feasible: usize,
    /// Number of designs in the Pareto set.
    pub pareto: usize,
    /// Verified designs of the Pareto set, in the order of the first goal.
    pub candidates: Vec<VerifiedDesign>,
    /// Metrics of the first two goals for each feasible design, for the plot.
    #[serde(skip)]
    pub cloud: Vec<(f64, f64)>,
}

/// Evaluation of a design.
enum Evaluation {
    /// Within all limits.
    Feasible(Box<Candidate>),
    /// Outside limits, with the sum of the relative violations.
    Infeasible(f64),
    /// The geometry is invalid, or the head has no stable rest pose.
    Invalid,
}

/// A search for a spring.
pub struct DesignSearch {
    spec: DesignSpec,
    head: HeadSpec,
    source: Source,
    lidar: Lidar,
    space: Space,
}

enum Space {
    Coil { bounds: [[f64; 2]; 4], material: Material },
    Catalogue(Vec<CoilDesign>),
}

/// Number of runs of CMA-ES, each with different weights of the goals.
const OPTIMISER_RUNS: usize = 16;

/// Fraction of the evaluations for the initial uniform sampling.
const SAMPLED_FRACTION: f64 = 0.4;

impl DesignSearch {
    /// Creates the search that `spec`, read from `source`, describes.
    ///
    /// # Errors
    /// When a named spec does not exist, bounds are reversed, or there are no goals or evaluations.
    pub fn new(spec: &DesignSpec, source: &Source) -> Result<Self, StudyError> {
        let head_source = find_from(Kind::Head, source, &spec.head)?;
        let head = HeadSpec::read(&head_source)?;
        if !matches!(head.linkage, LinkageSpec::Spring { .. }) {
            let message = format!("the head \"{}\" has no spring to replace", spec.head);
            return Err(SpecError::about(source, "head", message).into());
        }
        let lidar_source = find_from(Kind::Lidar, source, &spec.lidar)?;
        let lidar = Lidar::new(&parse(&lidar_source)?, &lidar_source)?;
        if spec.goals.is_empty() {
            return Err(SpecError::about(source, "goals", "at least one goal is required").into());
        }
        let measures = spec.goals.iter().map(|goal| goal.measure).chain(spec.limits.iter().map(|limit| limit.measure));
        if let Some(measure) = measures.into_iter().find(|measure| !measure.has_closed_form()) {
            let message = format!("{} has no closed form, so it cannot be a goal or a limit: remove it", measure.key());
            return Err(SpecError::about(source, measure.key(), message).into());
        }
        if spec.evaluations == 0 || spec.candidates == 0 {
            return Err(SpecError::about(source, "evaluations", "evaluations and candidates must be at least 1").into());
        }
        let space = match &spec.space {
            SpaceSpec::Catalogue(name) => Space::Catalogue(catalogue(name, source)?),
            SpaceSpec::Coil { coil_diameter_mm, wire_diameter_mm, active_coils, free_length_mm, material } => {
                let bounds = [*coil_diameter_mm, *wire_diameter_mm, *active_coils, *free_length_mm];
                if let Some([low, high]) = bounds.iter().find(|[low, high]| high < low) {
                    let message = format!("the lower bound {low} exceeds the upper bound {high}");
                    return Err(SpecError::about(source, "space", message).into());
                }
                Space::Coil { bounds, material: *material }
            }
        };
        Ok(Self { spec: spec.clone(), head, source: head_source, lidar, space })
    }

    /// Explores the design space; returns the feasible designs and the number of evaluations.
    ///
    /// `on_progress` is called after each evaluation.
    pub fn explore(&self, on_progress: OnProgress<'_>) -> (Vec<Candidate>, usize) {
        let total = match &self.space {
            Space::Catalogue(springs) => springs.len(),
            Space::Coil { .. } => self.spec.evaluations,
        };
        let pieces = PieceProgress::new(total, on_progress);
        let evaluate = |coil: &CoilDesign| {
            let evaluation = self.evaluate(coil);
            pieces.finish_one();
            evaluation
        };
        match &self.space {
            Space::Catalogue(springs) => {
                (feasible(springs.par_iter().map(evaluate).collect::<Vec<_>>()), springs.len())
            }
            Space::Coil { bounds, material } => {
                let evaluate = |point: &[f64]| evaluate(&coil_at(point, bounds, *material));
                let mut stream = Seed(self.spec.seed).stream("design/samples");
                let samples = ((self.spec.evaluations as f64 * SAMPLED_FRACTION) as usize).max(1);
                let points: Vec<[f64; 4]> =
                    (0..samples).map(|_| std::array::from_fn(|_| stream.random::<f64>())).collect();
                let sampled: Vec<Evaluation> = points.par_iter().map(|point| evaluate(point)).collect();
                let mut evaluated = samples;
                let scales = Scales::of(&sampled, self.spec.goals.len());
                let evaluations_per_run = (self.spec.evaluations - samples) / OPTIMISER_RUNS;
                let runs = (0..OPTIMISER_RUNS).into_par_iter().map(|k| {
                    let weights =
                        weights(k, self.spec.goals.len(), &mut Seed(self.spec.seed).part("design/weights", k as u64));
                    let cost = |evaluation: &Evaluation| scales.cost(evaluation, &weights);
                    let start = (0..samples).min_by(|a, b| cost(&sampled[*a]).total_cmp(&cost(&sampled[*b])));
                    let start = start.map_or([0.5; 4], |k| points[k]);
                    let seed = Seed(self.spec.seed).child(&format!("design/{k}")).0;
                    optimise(&start, evaluations_per_run, seed, &evaluate, &cost)
                });
                let optimised: Vec<Vec<Evaluation>> = runs.collect();
                evaluated += optimised.iter().map(Vec::len).sum::<usize>();
                (feasible(sampled.into_iter().chain(optimised.into_iter().flatten())), evaluated)
            }
        }
    }

    fn evaluate(&self, coil: &CoilDesign) -> Evaluation {
        let Ok(figures) = closed_form(&self.with(coil), &self.source, &self.spec.shake) else {
            return Evaluation::Invalid;
        };
        let excess = self.excess(&figures);
        let costs: Vec<f64> = self.spec.goals.iter().map(|goal| goal.cost(figures.cost_figure(goal.measure))).collect();
        if excess > 0.0 || costs.iter().any(|cost| !cost.is_finite()) {
            return Evaluation::Infeasible(excess);
        }
        Evaluation::Feasible(Box::new(Candidate { coil: coil.clone(), figures, costs }))
    }

    /// Sum of the relative violations of the limits.
    fn excess(&self, metrics: &DesignMetrics) -> f64 {
        self.spec.limits.iter().map(|limit| limit.excess(metrics.cost_figure(limit.measure))).sum()
    }

    /// The head with its spring replaced.
    fn with(&self, coil: &CoilDesign) -> HeadSpec {
        let mut head = self.head.clone();
        if let LinkageSpec::Spring { spring, .. } = &mut head.linkage {
            *spring = coil.spring();
        }
        head
    }

    /// Explores the design space and verifies a selection of the Pareto set.
    ///
    /// The first half of the progress is the exploration, the second half the verification.
    ///
    /// # Errors
    /// When the verification cannot be set up. A failed simulation of a design is part of the result.
    pub fn run(&self, on_progress: OnProgress<'_>) -> Result<DesignStudy, StudyError> {
        let (feasible, evaluated) = self.explore(&|fraction| on_progress(0.5 * fraction));
        let costs: Vec<Vec<f64>> = feasible.iter().map(|candidate| candidate.costs.clone()).collect();
        let front = pareto_set(&costs);
        let front_costs: Vec<Vec<f64>> = front.iter().map(|k| costs[*k].clone()).collect();
        let chosen = spread(&front_costs, self.spec.candidates);
        let second_half = |fraction: f64| on_progress(0.5 + 0.5 * fraction);
        let pieces = PieceProgress::new(chosen.len(), &second_half);
        let verified = chosen.par_iter().map(|k| {
            let verified = self.verify(&feasible[front[*k]]);
            pieces.finish_one();
            verified
        });
        let metric = |k: usize| self.spec.goals.get(k).or(self.spec.goals.first()).map(|goal| goal.measure);
        let cloud = metric(0).zip(metric(1)).map_or(Vec::new(), |(x, y)| {
            feasible.iter().map(|c| (c.figures.cost_figure(x), c.figures.cost_figure(y))).collect()
        });
        Ok(DesignStudy {
            spec: self.spec.clone(),
            evaluated,
            feasible: feasible.len(),
            pareto: front.len(),
            candidates: verified.collect::<Result<_, _>>()?,
            cloud,
        })
    }

    fn verify(&self, candidate: &Candidate) -> Result<VerifiedDesign, StudyError> {
        let plan = CoveragePlan { from_s: 10.0, duration_s: 10.0, ..CoveragePlan::default() };
        let head = self.with(&candidate.coil);
        let unverified = VerifiedDesign {
            candidate: candidate.clone(),
            simulated: None,
            holds: false,
            fraction_seen: None,
            saturated: None,
            failed: None,
        };
        match simulated(&head, &self.source, &self.spec.shake, &self.lidar, &plan) {
            Ok((metrics, coverage)) => Ok(VerifiedDesign {
                simulated: Some(metrics),
                holds: self.excess(&metrics) <= 0.0,
                fraction_seen: Some(coverage.fraction_seen),
                saturated: Some(coverage.gyro.saturated),
                ..unverified
            }),
            Err(StudyError::Dynamics(error)) => Ok(VerifiedDesign { failed: Some(error.to_string()), ..unverified }),
            Err(error) => Err(error),
        }
    }
}

/// Runs CMA-ES from `start` in the unit cube; returns all evaluations.
fn optimise(
    start: &[f64; 4],
    evaluations: usize,
    seed: u64,
    evaluate: &dyn Fn(&[f64]) -> Evaluation,
    cost: &dyn Fn(&Evaluation) -> f64,
) -> Vec<Evaluation> {
    let mut evaluated = Vec::with_capacity(evaluations);
    let population = 8;
    if evaluations < population {
        return evaluated;
    }
    let objective = |point: &DVector<f64>| {
        let outside: f64 = point.iter().map(|x| (x - x.clamp(0.0, 1.0)).powi(2)).sum();
        let inside: Vec<f64> = point.iter().map(|x| x.clamp(0.0, 1.0)).collect();
        let evaluation = evaluate(&inside);
        let value = cost(&evaluation) + outside;
        evaluated.push(evaluation);
        value
    };
    let options = CMAESOptions::new(start.to_vec(), 0.15)
        .population_size(population)
        .max_function_evals(evaluations - population + 1)
        .seed(seed);
    // These options are always valid: positive step size, population of 8.
    if let Ok(mut optimiser) = options.build(objective) {
        optimiser.run();
    }
    evaluated
}

/// The coil at a point of the unit cube.
fn coil_at(point: &[f64], bounds: &[[f64; 2]; 4], material: Material) -> CoilDesign {
    let between = |k: usize| bounds[k][0] + point[k] * (bounds[k][1] - bounds[k][0]);
    CoilDesign {
        name: String::new(),
        coil_diameter_mm: between(0),
        wire_diameter_mm: between(1),
        active_coils: between(2),
        free_length_mm: between(3),
        material,
    }
}

/// The feasible designs of the evaluations.
fn feasible(evaluations: impl IntoIterator<Item = Evaluation>) -> Vec<Candidate> {
    let candidate = |evaluation| match evaluation {
        Evaluation::Feasible(candidate) => Some(*candidate),
        _ => None,
    };
    evaluations.into_iter().filter_map(candidate).collect()
}

/// Range of each cost over the uniform samples, for normalisation.
struct Scales(Vec<(f64, f64)>);

impl Scales {
    fn of(evaluations: &[Evaluation], goals: usize) -> Self {
        let mut ranges = vec![(f64::INFINITY, f64::NEG_INFINITY); goals];
        for evaluation in evaluations {
            if let Evaluation::Feasible(candidate) = evaluation {
                for (range, cost) in ranges.iter_mut().zip(&candidate.costs) {
                    *range = (range.0.min(*cost), range.1.max(*cost));
                }
            }
        }
        let nonempty = |(low, high): (f64, f64)| if low < high { (low, high) } else { (0.0, 1.0) };
        Self(ranges.into_iter().map(nonempty).collect())
    }

    /// Scalar cost of an evaluation: augmented Chebyshev scalarisation of the normalised costs.
    ///
    /// The maximum plus 0.05 times the sum excludes weakly Pareto-optimal points. Infeasible designs cost 10 plus the
    /// violation, at most 60; invalid designs cost 100.
    fn cost(&self, evaluation: &Evaluation, weights: &[f64]) -> f64 {
        match evaluation {
            Evaluation::Invalid => 100.0,
            Evaluation::Infeasible(excess) => 10.0 + excess.min(50.0),
            Evaluation::Feasible(candidate) => {
                let scaled = candidate.costs.iter().zip(&self.0).zip(weights);
                let terms = scaled.map(|((cost, (low, high)), weight)| weight * (cost - low) / (high - low));
                let (max, sum) = terms.fold((f64::NEG_INFINITY, 0.0), |(max, sum), t| (f64::max(max, t), sum + t));
                max + 0.05 * sum
            }
        }
    }
}

/// Weights of optimiser run `index`: the first runs emphasise one goal each, the others are uniform on the simplex.
fn weights(index: usize, goals: usize, stream: &mut Stream) -> Vec<f64> {
    if index < goals {
        return (0..goals).map(|k| if k == index { 1.0 } else { 0.05 }).collect();
    }
    let values: Vec<f64> = (0..goals).map(|_| -(1.0 - stream.random::<f64>()).ln()).collect();
    let sum: f64 = values.iter().sum();
    values.iter().map(|value| value / sum).collect()
}
