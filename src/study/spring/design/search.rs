//! Trying designs, keeping the best, verifying them.

use super::{CoilDesign, DesignSpec, SpaceSpec, catalogue, pareto_set, spread};
use crate::dynamics::{self, HeadSpec, LinkageSpec};
use crate::elasticity::Material;
use crate::random::{Seed, Stream};
use crate::sensors::Lidar;
use crate::spec::{Kind, Source, SpecError, find, parse};
use crate::study::coverage::CoveragePlan;
use crate::study::spring::{DesignFigures, closed_form, simulated};
use crate::study::watch::PieceProgress;
use crate::study::{OnProgress, StudyError};
use cmaes::{CMAESOptions, DVector};
use rand::RngExt;
use rayon::prelude::*;
use serde::Serialize;

/// A design within all limits.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// The coil.
    pub coil: CoilDesign,
    /// Its figures by the closed form.
    pub figures: DesignFigures,
    /// How far it is from each goal.
    pub costs: Vec<f64>,
}

/// A design of the Pareto set, and what its full simulation says.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verified {
    /// The design.
    #[serde(flatten)]
    pub candidate: Candidate,
    /// Its figures by simulation.
    pub simulated: Option<DesignFigures>,
    /// Whether they are within all limits.
    pub holds: bool,
    /// Share of the sphere that the lidar saw.
    pub fraction_seen: Option<f64>,
    /// Share of the time in which the gyroscope was beyond its range.
    pub saturated: Option<f64>,
    /// Why the simulation failed, if it did.
    pub failed: Option<String>,
}

/// What a search found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DesignStudy {
    /// The spec as used.
    pub spec: DesignSpec,
    /// Designs that were tried.
    pub evaluated: usize,
    /// Designs within all limits.
    pub feasible: usize,
    /// Size of the Pareto set.
    pub pareto: usize,
    /// Some of it, verified, in the order of the first goal.
    pub candidates: Vec<Verified>,
    /// The values of the first two goals' figures for every design within all limits, for a plot.
    #[serde(skip)]
    pub cloud: Vec<(f64, f64)>,
}

/// What became of a design.
enum Outcome {
    /// Within all limits.
    Fits(Box<Candidate>),
    /// Beyond some, by this much in all.
    Beyond(f64),
    /// It cannot be wound, or its head falls.
    Falls,
}

/// A search about to begin.
pub struct Search {
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

/// Ways in which the goals are weighed, and so descents.
const DESCENTS: usize = 16;

/// Share of the evaluations that samples the space evenly first.
const SAMPLED: f64 = 0.4;

impl Search {
    /// The search that `spec`, read from `source`, describes.
    ///
    /// # Errors
    /// When a name in it leads nowhere, bounds are empty, or there is nothing to search for.
    pub fn new(spec: &DesignSpec, source: &Source) -> Result<Self, StudyError> {
        let (head, head_source) = dynamics::load(&spec.head)?;
        if !matches!(head.linkage, LinkageSpec::Spring { .. }) {
            let message = format!("the head \"{}\" has no spring to replace", spec.head);
            return Err(SpecError::about(source, "head", message).into());
        }
        let lidar_source = find(Kind::Lidar, &spec.lidar)?;
        let lidar = Lidar::new(&parse(&lidar_source)?, &lidar_source)?;
        if spec.goals.is_empty() {
            return Err(SpecError::about(source, "goals", "a search has at least one goal").into());
        }
        if spec.evaluations == 0 || spec.candidates == 0 {
            return Err(SpecError::about(source, "evaluations", "a search tries and tells at least one design").into());
        }
        let space = match &spec.space {
            SpaceSpec::Catalogue(name) => Space::Catalogue(catalogue(name)?),
            SpaceSpec::Coil { coil_diameter_mm, wire_diameter_mm, active_coils, free_length_mm, material } => {
                let bounds = [*coil_diameter_mm, *wire_diameter_mm, *active_coils, *free_length_mm];
                if let Some([low, high]) = bounds.iter().find(|[low, high]| high < low) {
                    let message = format!("bounds go from the smaller to the larger number, not from {low} to {high}");
                    return Err(SpecError::about(source, "space", message).into());
                }
                Space::Coil { bounds, material: *material }
            }
        };
        Ok(Self { spec: spec.clone(), head, source: head_source, lidar, space })
    }

    /// Tries the space, and returns every design within all limits, and how many were tried; `on_progress` is told
    /// after each.
    pub fn explore(&self, on_progress: OnProgress<'_>) -> (Vec<Candidate>, usize) {
        let whole = match &self.space {
            Space::Catalogue(springs) => springs.len(),
            Space::Coil { .. } => self.spec.evaluations,
        };
        let pieces = PieceProgress::new(whole, on_progress);
        let judge = |coil: &CoilDesign| {
            let outcome = self.judge(coil);
            pieces.finish_one();
            outcome
        };
        match &self.space {
            Space::Catalogue(springs) => (fitting(springs.par_iter().map(judge).collect::<Vec<_>>()), springs.len()),
            Space::Coil { bounds, material } => {
                let judge = |place: &[f64]| judge(&coil_at(place, bounds, *material));
                let mut stream = Seed(self.spec.seed).stream("design/samples");
                let samples = ((self.spec.evaluations as f64 * SAMPLED) as usize).max(1);
                let places: Vec<[f64; 4]> =
                    (0..samples).map(|_| std::array::from_fn(|_| stream.random::<f64>())).collect();
                let outcomes: Vec<Outcome> = places.par_iter().map(|place| judge(place)).collect();
                let mut evaluated = samples;
                let scales = Scales::of(&outcomes, self.spec.goals.len());
                let each = (self.spec.evaluations - samples) / DESCENTS;
                let descents = (0..DESCENTS).into_par_iter().map(|k| {
                    let weights =
                        weights(k, self.spec.goals.len(), &mut Seed(self.spec.seed).part("design/weights", k as u64));
                    let value = |o: &Outcome| scales.value(o, &weights);
                    let start = (0..samples).min_by(|a, b| value(&outcomes[*a]).total_cmp(&value(&outcomes[*b])));
                    let start = start.map_or([0.5; 4], |k| places[k]);
                    let seed = Seed(self.spec.seed).child(&format!("design/{k}")).0;
                    descend(&start, (each, seed), &judge, &value)
                });
                let descended: Vec<Vec<Outcome>> = descents.collect();
                evaluated += descended.iter().map(Vec::len).sum::<usize>();
                (fitting(outcomes.into_iter().chain(descended.into_iter().flatten())), evaluated)
            }
        }
    }

    fn judge(&self, coil: &CoilDesign) -> Outcome {
        let Ok(figures) = closed_form(&self.with(coil), &self.source, &self.spec.shake) else { return Outcome::Falls };
        let beyond = self.excess(&figures);
        let costs: Vec<f64> = self.spec.goals.iter().map(|goal| goal.cost(goal.figure.of(&figures))).collect();
        if beyond > 0.0 || costs.iter().any(|cost| !cost.is_finite()) {
            return Outcome::Beyond(beyond);
        }
        Outcome::Fits(Box::new(Candidate { coil: coil.clone(), figures, costs }))
    }

    /// By how much in all limits are exceeded.
    fn excess(&self, figures: &DesignFigures) -> f64 {
        self.spec.limits.iter().map(|limit| limit.excess(limit.figure.of(figures))).sum()
    }

    /// The head on another spring.
    fn with(&self, coil: &CoilDesign) -> HeadSpec {
        let mut head = self.head.clone();
        if let LinkageSpec::Spring { spring, .. } = &mut head.linkage {
            *spring = coil.spring();
        }
        head
    }

    /// Explores, takes the Pareto set, and verifies as much of it as the spec says. `on_progress` is told as designs
    /// are tried (the first half) and verified.
    ///
    /// # Errors
    /// When the verification cannot be set up. A design whose simulation fails is a result.
    pub fn run(&self, on_progress: OnProgress<'_>) -> Result<DesignStudy, StudyError> {
        let (feasible, evaluated) = self.explore(&|share| on_progress(0.5 * share));
        let costs: Vec<Vec<f64>> = feasible.iter().map(|candidate| candidate.costs.clone()).collect();
        let front = pareto_set(&costs);
        let of_front: Vec<Vec<f64>> = front.iter().map(|k| costs[*k].clone()).collect();
        let chosen = spread(&of_front, self.spec.candidates);
        let second_half = |share: f64| on_progress(0.5 + 0.5 * share);
        let pieces = PieceProgress::new(chosen.len(), &second_half);
        let verified = chosen.par_iter().map(|k| {
            let verified = self.verify(&feasible[front[*k]]);
            pieces.finish_one();
            verified
        });
        let figure = |k: usize| self.spec.goals.get(k).or(self.spec.goals.first()).map(|goal| goal.figure);
        let cloud = figure(0)
            .zip(figure(1))
            .map_or(Vec::new(), |(x, y)| feasible.iter().map(|c| (x.of(&c.figures), y.of(&c.figures))).collect());
        Ok(DesignStudy {
            spec: self.spec.clone(),
            evaluated,
            feasible: feasible.len(),
            pareto: front.len(),
            candidates: verified.collect::<Result<_, _>>()?,
            cloud,
        })
    }

    fn verify(&self, candidate: &Candidate) -> Result<Verified, StudyError> {
        let plan = CoveragePlan { from_s: 10.0, duration_s: 10.0, ..CoveragePlan::default() };
        let head = self.with(&candidate.coil);
        let blank = Verified {
            candidate: candidate.clone(),
            simulated: None,
            holds: false,
            fraction_seen: None,
            saturated: None,
            failed: None,
        };
        match simulated(&head, &self.source, &self.spec.shake, &self.lidar, &plan) {
            Ok((figures, seen)) => Ok(Verified {
                simulated: Some(figures),
                holds: self.excess(&figures) <= 0.0,
                fraction_seen: Some(seen.fraction_seen),
                saturated: Some(seen.gyro.saturated),
                ..blank
            }),
            Err(StudyError::Dynamics(error)) => Ok(Verified { failed: Some(error.to_string()), ..blank }),
            Err(error) => Err(error),
        }
    }
}

/// One run of CMA-ES from `start`; everything it met.
fn descend(
    start: &[f64; 4],
    (evaluations, seed): (usize, u64),
    judge: &dyn Fn(&[f64]) -> Outcome,
    value: &dyn Fn(&Outcome) -> f64,
) -> Vec<Outcome> {
    let mut met = Vec::with_capacity(evaluations);
    let population = 8;
    if evaluations < population {
        return met;
    }
    let objective = |place: &DVector<f64>| {
        let outside: f64 = place.iter().map(|x| (x - x.clamp(0.0, 1.0)).powi(2)).sum();
        let inside: Vec<f64> = place.iter().map(|x| x.clamp(0.0, 1.0)).collect();
        let outcome = judge(&inside);
        let cost = value(&outcome) + outside;
        met.push(outcome);
        cost
    };
    let options = CMAESOptions::new(start.to_vec(), 0.15)
        .population_size(population)
        .max_function_evals(evaluations - population + 1)
        .seed(seed);
    // The options are sound by construction: a positive step, a population of eight.
    if let Ok(mut descent) = options.build(objective) {
        descent.run();
    }
    met
}

/// The coil at a place of the unit cube.
fn coil_at(place: &[f64], bounds: &[[f64; 2]; 4], material: Material) -> CoilDesign {
    let between = |k: usize| bounds[k][0] + place[k] * (bounds[k][1] - bounds[k][0]);
    CoilDesign {
        name: String::new(),
        coil_diameter_mm: between(0),
        wire_diameter_mm: between(1),
        active_coils: between(2),
        free_length_mm: between(3),
        material,
    }
}

fn fitting(outcomes: impl IntoIterator<Item = Outcome>) -> Vec<Candidate> {
    let fits = |outcome| match outcome {
        Outcome::Fits(candidate) => Some(*candidate),
        _ => None,
    };
    outcomes.into_iter().filter_map(fits).collect()
}

/// The range of each goal's cost over the even samples, to compare them by.
struct Scales(Vec<(f64, f64)>);

impl Scales {
    fn of(outcomes: &[Outcome], goals: usize) -> Self {
        let mut ranges = vec![(f64::INFINITY, f64::NEG_INFINITY); goals];
        for outcome in outcomes {
            if let Outcome::Fits(candidate) = outcome {
                for (range, cost) in ranges.iter_mut().zip(&candidate.costs) {
                    *range = (range.0.min(*cost), range.1.max(*cost));
                }
            }
        }
        let sound = |(low, high): (f64, f64)| if low < high { (low, high) } else { (0.0, 1.0) };
        Self(ranges.into_iter().map(sound).collect())
    }

    /// Chebyshev's scalarisation, with a little of the sum so that nothing is given away; beyond the limits 10 and the
    /// excess, and 100 for a design that falls.
    fn value(&self, outcome: &Outcome, weights: &[f64]) -> f64 {
        match outcome {
            Outcome::Falls => 100.0,
            Outcome::Beyond(excess) => 10.0 + excess.min(50.0),
            Outcome::Fits(candidate) => {
                let scaled = candidate.costs.iter().zip(&self.0).zip(weights);
                let terms = scaled.map(|((cost, (low, high)), weight)| weight * (cost - low) / (high - low));
                let (most, sum) = terms.fold((f64::NEG_INFINITY, 0.0), |(most, sum), t| (f64::max(most, t), sum + t));
                most + 0.05 * sum
            }
        }
    }
}

/// The weights of descent `index`: each goal nearly alone first, then at random, evenly over their simplex.
fn weights(index: usize, goals: usize, stream: &mut Stream) -> Vec<f64> {
    if index < goals {
        return (0..goals).map(|k| if k == index { 1.0 } else { 0.05 }).collect();
    }
    let shares: Vec<f64> = (0..goals).map(|_| -(1.0 - stream.random::<f64>()).ln()).collect();
    let sum: f64 = shares.iter().sum();
    shares.iter().map(|share| share / sum).collect()
}
