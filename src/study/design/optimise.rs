//! Optimisation of a design: CMA-ES on a scalar cost.

use super::evaluation::Evaluation;
use crate::cma_es::CmaEs;
use rand::RngExt;
use zsim_base::random::Stream;

/// Runs CMA-ES from `start` in the unit cube; returns all evaluations.
pub(super) fn optimise(
    start: &[f64; 4],
    evaluations: usize,
    stream: &mut Stream,
    evaluate: &dyn Fn(&[f64]) -> Evaluation,
    cost: &dyn Fn(&Evaluation) -> f64,
) -> Vec<Evaluation> {
    let mut evaluated = Vec::with_capacity(evaluations);
    let settings = CmaEs { step: 0.15, population: 8, max_evaluations: evaluations };
    let _ = settings.minimise(start, stream, |point| {
        let outside: f64 = point.iter().map(|x| (x - x.clamp(0.0, 1.0)).powi(2)).sum();
        let inside: Vec<f64> = point.iter().map(|x| x.clamp(0.0, 1.0)).collect();
        let evaluation = evaluate(&inside);
        let value = cost(&evaluation) + outside;
        evaluated.push(evaluation);
        value
    });
    evaluated
}

/// Range of each cost over the uniform samples, for normalisation.
pub(super) struct Scales(Vec<(f64, f64)>);

impl Scales {
    pub fn of(evaluations: &[Evaluation], goals: usize) -> Self {
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
    pub fn cost(&self, evaluation: &Evaluation, weights: &[f64]) -> f64 {
        match evaluation {
            Evaluation::Invalid(_) => 100.0,
            Evaluation::Infeasible(violations) => {
                10.0 + violations.iter().map(|violation| violation.excess).sum::<f64>().min(50.0)
            }
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
pub(super) fn weights(index: usize, goals: usize, stream: &mut Stream) -> Vec<f64> {
    if index < goals {
        return (0..goals).map(|k| if k == index { 1.0 } else { 0.05 }).collect();
    }
    let values: Vec<f64> = (0..goals).map(|_| -(1.0 - stream.random::<f64>()).ln()).collect();
    let sum: f64 = values.iter().sum();
    values.iter().map(|value| value / sum).collect()
}
