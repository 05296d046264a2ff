//! Block bootstrap: confidence intervals of the error measures of a run.

use nalgebra::{Matrix3, Vector3};
use rand::RngExt;
use serde::{Deserialize, Serialize};
use zsim_base::random::Seed;
use zsim_run::timing::{Block, pooled};

/// Number of bootstrap resamples: the ends of a 95 % interval then rest on 50 resamples each.
const RESAMPLES: usize = 2000;
/// Confidence level of the intervals.
const CONFIDENCE_LEVEL: f64 = 0.95;

/// A value with its 95 % confidence interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConfidenceInterval {
    /// Value.
    pub value: f64,
    /// Lower limit.
    pub low: f64,
    /// Upper limit.
    pub high: f64,
}

/// Bootstrap resamples of blocks (Kuensch 1989): blocks because errors are correlated in time.
///
/// All runs use the same resamples, so that errors common to two runs cancel in their difference.
#[derive(Debug)]
pub(crate) struct Resampling {
    /// Multiplicity of each block, per resample.
    counts: Vec<Vec<f64>>,
}

impl Resampling {
    pub(crate) fn new(blocks: usize, seed: Seed) -> Self {
        let mut stream = seed.stream("latency/bootstrap");
        let mut draw = || {
            let mut counts = vec![0.0; blocks];
            (0..blocks).for_each(|_| counts[stream.random_range(0..blocks)] += 1.0);
            counts
        };
        Self { counts: (0..RESAMPLES).map(|_| draw()).collect() }
    }

    /// A measure of the blocks, per resample.
    fn resampled<'a>(&'a self, blocks: &'a [Block], measure: fn(&Block) -> f64) -> impl Iterator<Item = f64> + 'a {
        self.counts.iter().map(move |counts| {
            let mut sum = Block::default();
            blocks.iter().zip(counts).for_each(|(block, times)| sum.add(block, *times));
            measure(&sum)
        })
    }

    /// A measure of all blocks with its confidence interval.
    pub(crate) fn interval(&self, blocks: &[Block], measure: fn(&Block) -> f64) -> ConfidenceInterval {
        percentile_interval(measure(&pooled(blocks)), self.resampled(blocks, measure).collect())
    }

    /// Abscissa of the minimum of a variance over `x`.
    ///
    /// Fits the parabola `a + b x + c x^2` to `curve` (abscissa, blocks); each point has the reciprocal of its bootstrap
    /// variance as weight. `None` if the parabola has no minimum.
    pub(crate) fn minimum(&self, curve: &[(f64, &[Block])], variance: fn(&Block) -> f64) -> Option<ConfidenceInterval> {
        let resampled: Vec<Vec<f64>> =
            curve.iter().map(|(_, blocks)| self.resampled(blocks, variance).collect()).collect();
        let weights: Vec<f64> = resampled.iter().map(|values| 1.0 / variance_of(values)).collect();
        let abscissae: Vec<f64> = curve.iter().map(|(x, _)| *x).collect();
        let fit = |ordinates: &[f64]| vertex(&abscissae, ordinates, &weights);
        let at = fit(&curve.iter().map(|(_, blocks)| variance(&pooled(blocks))).collect::<Vec<_>>())?;
        let of_resample = |k: usize| fit(&resampled.iter().map(|values| values[k]).collect::<Vec<_>>());
        Some(percentile_interval(at, (0..RESAMPLES).filter_map(of_resample).collect()))
    }
}

/// Percentile bootstrap interval about `value`.
fn percentile_interval(value: f64, mut resampled: Vec<f64>) -> ConfidenceInterval {
    resampled.retain(|x| x.is_finite());
    resampled.sort_by(f64::total_cmp);
    let rank = |fraction: f64| ((fraction * resampled.len() as f64) as usize).min(resampled.len().saturating_sub(1));
    let quantile = |fraction: f64| resampled.get(rank(fraction)).copied().unwrap_or(f64::NAN);
    ConfidenceInterval {
        value,
        low: quantile(0.5 - 0.5 * CONFIDENCE_LEVEL),
        high: quantile(0.5 + 0.5 * CONFIDENCE_LEVEL),
    }
}

/// Variance of `values`, bounded below to keep weights finite.
fn variance_of(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / values.len() as f64;
    // A relative standard deviation of at least 1e-6.
    variance.max((1e-6 * mean).powi(2)).max(f64::MIN_POSITIVE)
}

/// Abscissa of the vertex of the weighted least-squares parabola; `None` if it opens downwards.
fn vertex(abscissae: &[f64], ordinates: &[f64], weights: &[f64]) -> Option<f64> {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for ((x, y), weight) in abscissae.iter().zip(ordinates).zip(weights) {
        let row = Vector3::new(1.0, *x, x * x);
        normal += row * row.transpose() * *weight;
        right += row * (*y * *weight);
    }
    let [_, b, c] = normal.lu().solve(&right)?.into();
    (c > 0.0).then(|| -0.5 * b / c)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};

    /// 40 blocks of 500 points with normally distributed distances.
    fn blocks(sigma_m: f64, seed: u64) -> Vec<Block> {
        let mut stream = Seed(seed).stream("test");
        let mut block = || {
            let mut sum = Block::default();
            for _ in 0..500 {
                let z: f64 = StandardNormal.sample(&mut stream);
                let d = sigma_m * z;
                let one = Block { points: 1.0, distance_m: d, distance2_m2: d * d, poses: 1.0, position2_m2: d * d };
                sum.add(&one, 1.0);
            }
            sum
        };
        (0..40).map(|_| block()).collect()
    }

    #[test]
    fn an_interval_covers_the_true_value_and_has_the_theoretical_width() {
        // The sample variance of n normal numbers has a standard error of sigma^2 sqrt(2 / n): 1 % for n = 20 000.
        let resampling = Resampling::new(40, Seed(5));
        let mut covered = 0;
        for seed in 0..40 {
            let found = resampling.interval(&blocks(0.01, seed), Block::cloud_variance_m2);
            covered += usize::from(found.low <= 1e-4 && 1e-4 <= found.high);
            let half = 0.5 * (found.high - found.low);
            assert!((half / (1.96 * 1e-6) - 1.0).abs() < 0.4, "{found:?}");
        }
        // 95 % of 40 are 38; fewer than 32 have a probability below 1e-4.
        assert!(covered >= 32, "{covered}");
    }

    #[test]
    fn the_minimum_of_a_parabola_is_within_its_confidence_interval() {
        // sigma^2 = (1 cm)^2 + (0.4 cm/ms (x - 0.3 ms))^2.
        let resampling = Resampling::new(40, Seed(5));
        let latencies = [-5.0, -2.0, -1.0, 0.0, 1.0, 2.0, 5.0_f64];
        let of = |x: f64| blocks((1e-4 + (0.004 * (x - 0.3)).powi(2)).sqrt(), (x + 100.0) as u64);
        let simulated: Vec<(f64, Vec<Block>)> = latencies.map(|x| (x, of(x))).to_vec();
        let curve: Vec<(f64, &[Block])> = simulated.iter().map(|(x, blocks)| (*x, blocks.as_slice())).collect();
        let found = resampling.minimum(&curve, Block::cloud_variance_m2).unwrap();
        assert!(found.low < 0.3 && 0.3 < found.high && found.high - found.low < 0.1, "{found:?}");
        let hill = |block: &Block| -block.cloud_variance_m2();
        assert_eq!(resampling.minimum(&curve, hill), None);
    }
}
