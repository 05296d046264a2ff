//! CMA-ES: minimisation of a function of several variables without its derivatives.
//!
//! The evolution strategy with adaptation of the covariance matrix, (mu/mu_w, lambda), also with negative weights.
//! Numbers in parentheses are equations of N. Hansen, "The CMA Evolution Strategy: A Tutorial", arXiv:1604.00772v2 (2023);
//! the rules for stopping are those of its section B.3.

mod distribution;
mod rates;

use self::distribution::Distribution;
use self::rates::Rates;
use nalgebra::DVector;
use zsim_base::random::Stream;

/// Stops if the best values of the last generations differ by less.
const VALUE_TOLERANCE: f64 = 1e-12;

/// Settings of a minimisation.
pub(crate) struct CmaEs {
    /// Standard deviation of the first generation in each coordinate, positive.
    pub step: f64,
    /// Number of points of a generation, at least 4.
    pub population: usize,
    /// Maximum number of evaluations; there are only complete generations.
    pub max_evaluations: usize,
}

/// The best point of all generations, and its value.
pub(crate) struct Minimum {
    pub point: Vec<f64>,
    pub value: f64,
}

impl CmaEs {
    /// Minimises `objective` from `start`; `None` if there is no generation.
    pub(crate) fn minimise(
        &self,
        start: &[f64],
        stream: &mut Stream,
        mut objective: impl FnMut(&[f64]) -> f64,
    ) -> Option<Minimum> {
        let rates = Rates::new(start.len(), self.population);
        let mut distribution = Distribution::new(start, self.step);
        let mut best: Option<Minimum> = None;
        let mut best_values = Vec::new();
        for _ in 0..self.max_evaluations / self.population {
            let mut generation: Vec<(f64, DVector<f64>)> = Vec::with_capacity(self.population);
            for _ in 0..self.population {
                let y = distribution.sample(stream);
                let x = &distribution.mean + distribution.step * &y; // (40)
                let value = objective(x.as_slice());
                let value = if value.is_nan() { f64::INFINITY } else { value };
                if best.as_ref().is_none_or(|best| value < best.value) {
                    best = Some(Minimum { point: x.as_slice().to_vec(), value });
                }
                generation.push((value, y));
            }
            generation.sort_by(|a, b| a.0.total_cmp(&b.0));
            best_values.push(generation[0].0);
            let steps: Vec<DVector<f64>> = generation.into_iter().map(|(_, y)| y).collect();
            let is_valid = distribution.update(&rates, &steps);
            let window = 10 + (30 * start.len()).div_ceil(self.population);
            if !is_valid || distribution.has_ended(self.step) || are_equal(&best_values, window) {
                break;
            }
        }
        best
    }
}

/// Whether the last `window` of the values are equal within the tolerance.
fn are_equal(values: &[f64], window: usize) -> bool {
    let Some(first) = values.len().checked_sub(window) else { return false };
    let (low, high) =
        values[first..].iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)));
    high - low < VALUE_TOLERANCE
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::random::Seed;

    /// Number of evaluations until `objective` is below 1e-9, from (2, 0, 2, 0), for the slowest of ten seeds.
    fn evaluations(objective: impl Fn(&[f64]) -> f64) -> usize {
        let of_seed = |seed: u64| {
            let (mut count, mut reached) = (0, None);
            let settings = CmaEs { step: 0.5, population: 8, max_evaluations: 6000 };
            let best = settings.minimise(&[2.0, 0.0, 2.0, 0.0], &mut Seed(seed).stream("test"), |x| {
                count += 1;
                let value = objective(x);
                if value < 1e-9 {
                    reached.get_or_insert(count);
                }
                value
            });
            assert!(objective(&best.unwrap().point) < 1e-11 && count < 6000, "seed {seed} ended after {count}");
            reached.unwrap()
        };
        (0..10).map(of_seed).max().unwrap()
    }

    /// Rosenbrock's function of pairs. It has one minimum; that of a chain has a second one from four variables on.
    fn rosenbrock(x: &[f64]) -> f64 {
        x.chunks(2).map(|pair| 100.0 * (pair[1] - pair[0] * pair[0]).powi(2) + (1.0 - pair[0]).powi(2)).sum()
    }

    #[test]
    fn minima_are_found() {
        let sphere = evaluations(|x| x.iter().map(|x| (x - 0.5) * (x - 0.5)).sum());
        // Condition number 1e6, the axes rotated by 45 degrees in two planes.
        let ellipsoid = evaluations(|x| {
            let rotated = [x[0] + x[1], x[0] - x[1], x[2] + x[3], x[2] - x[3]].map(|sum| sum / 2.0_f64.sqrt());
            rotated.iter().enumerate().map(|(k, u)| 100_f64.powi(k as i32) * u * u).sum()
        });
        let rosenbrock = evaluations(rosenbrock);
        assert!(sphere < 900 && ellipsoid < 1800 && rosenbrock < 2400, "{sphere}, {ellipsoid}, {rosenbrock}");
    }

    #[test]
    fn the_budget_holds_and_a_seed_gives_the_same_points() {
        let run = |max_evaluations, seed: u64| {
            let mut points = Vec::new();
            let settings = CmaEs { step: 0.2, population: 8, max_evaluations };
            let best = settings.minimise(&[0.0; 4], &mut Seed(seed).stream("test"), |x| {
                points.push(x.to_vec());
                rosenbrock(x)
            });
            (points, best.map(|best| best.value))
        };
        assert!(run(7, 1) == (Vec::new(), None));
        assert_eq!(run(39, 1).0.len(), 32);
        assert!(run(100, 1) == run(100, 1) && run(100, 1) != run(100, 2));
    }

    #[test]
    fn functions_without_a_minimum_end() {
        let ended = |objective: fn(&[f64]) -> f64| {
            let mut count = 0;
            let settings = CmaEs { step: 0.2, population: 8, max_evaluations: 100_000 };
            let _ = settings.minimise(&[0.0; 4], &mut Seed(1).stream("test"), |x| {
                count += 1;
                objective(x)
            });
            count < 10_000
        };
        assert!(ended(|_| 1.0) && ended(|_| f64::NAN) && ended(|x| x[0]));
    }
}
