//! How sure the curves are: the run cut into blocks of time, drawn again and again.

use crate::random::Seed;
use nalgebra::{Matrix3, Vector3};
use rand::RngExt;
use serde::{Deserialize, Serialize};

/// How often the blocks are drawn.
const RESAMPLES: usize = 2000;
/// The share of the draws within a band.
const LEVEL: f64 = 0.95;

/// What a block of time says of an estimate: sums, so that blocks can be put together in any number.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Block {
    /// Points of the cloud within reach of a surface.
    pub points: f64,
    /// Sum of their signed distances, m.
    pub distance_m: f64,
    /// Sum of the squares of these, m^2.
    pub distance2_m2: f64,
    /// Poses.
    pub poses: f64,
    /// Sum of the squares of their position errors, m^2.
    pub position2_m2: f64,
}

impl Block {
    fn add(&mut self, other: &Block, times: f64) {
        self.points += times * other.points;
        self.distance_m += times * other.distance_m;
        self.distance2_m2 += times * other.distance2_m2;
        self.poses += times * other.poses;
        self.position2_m2 += times * other.position2_m2;
    }

    /// Variance of the signed distances about their mean, m^2.
    pub fn cloud_variance_m2(&self) -> f64 {
        let mean = self.distance_m / self.points;
        (self.distance2_m2 / self.points - mean * mean).max(0.0)
    }

    /// Mean of the squared position error, m^2.
    pub fn position_variance_m2(&self) -> f64 {
        self.position2_m2 / self.poses
    }

    /// Mean signed distance, m.
    pub fn cloud_bias_m(&self) -> f64 {
        self.distance_m / self.points
    }
}

/// All blocks together.
pub(super) fn whole(blocks: &[Block]) -> Block {
    blocks.iter().fold(Block::default(), |mut sum, block| {
        sum.add(block, 1.0);
        sum
    })
}

/// A number with the ends of its 95 % band.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Banded {
    /// The number.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Draws of blocks with replacement (Efron's bootstrap; of blocks, since errors of neighbouring instants are alike,
/// Kuensch 1989), the same for every run, so that differences between runs keep what they have in common.
#[derive(Debug)]
pub(super) struct Resampling {
    /// How often each block is in each draw.
    counts: Vec<Vec<f64>>,
}

impl Resampling {
    pub(super) fn new(blocks: usize, seed: Seed) -> Self {
        let mut stream = seed.stream("latency/bootstrap");
        let mut draw = || {
            let mut counts = vec![0.0; blocks];
            (0..blocks).for_each(|_| counts[stream.random_range(0..blocks)] += 1.0);
            counts
        };
        Self { counts: (0..RESAMPLES).map(|_| draw()).collect() }
    }

    /// A figure of the blocks in each draw.
    fn figures<'a>(&'a self, blocks: &'a [Block], figure: fn(&Block) -> f64) -> impl Iterator<Item = f64> + 'a {
        self.counts.iter().map(move |counts| {
            let mut sum = Block::default();
            blocks.iter().zip(counts).for_each(|(block, times)| sum.add(block, *times));
            figure(&sum)
        })
    }

    /// A figure of all blocks with its band.
    pub(super) fn banded(&self, blocks: &[Block], figure: fn(&Block) -> f64) -> Banded {
        banded(figure(&whole(blocks)), self.figures(blocks, figure).collect())
    }

    /// Where the parabola `a + b x + c x^2` through a variance over `x` has its minimum: fitted to all of `curve`
    /// (abscissa, blocks), each point weighted by the reciprocal of its own variance over the draws. `None` where there
    /// is no minimum.
    pub(super) fn minimum(&self, curve: &[(f64, &[Block])], variance: fn(&Block) -> f64) -> Option<Banded> {
        let drawn: Vec<Vec<f64>> = curve.iter().map(|(_, blocks)| self.figures(blocks, variance).collect()).collect();
        let weights: Vec<f64> = drawn.iter().map(|figures| 1.0 / spread2(figures)).collect();
        let abscissae: Vec<f64> = curve.iter().map(|(x, _)| *x).collect();
        let fit = |ordinates: &[f64]| vertex(&abscissae, ordinates, &weights);
        let at = fit(&curve.iter().map(|(_, blocks)| variance(&whole(blocks))).collect::<Vec<_>>())?;
        let of_draw = |k: usize| fit(&drawn.iter().map(|figures| figures[k]).collect::<Vec<_>>());
        Some(banded(at, (0..RESAMPLES).filter_map(of_draw).collect()))
    }
}

fn banded(value: f64, mut draws: Vec<f64>) -> Banded {
    draws.retain(|x| x.is_finite());
    draws.sort_by(f64::total_cmp);
    let rank = |share: f64| ((share * draws.len() as f64) as usize).min(draws.len().saturating_sub(1));
    let end = |share: f64| draws.get(rank(share)).copied().unwrap_or(f64::NAN);
    Banded { value, low: end(0.5 - 0.5 * LEVEL), high: end(0.5 + 0.5 * LEVEL) }
}

fn spread2(figures: &[f64]) -> f64 {
    let mean = figures.iter().sum::<f64>() / figures.len() as f64;
    let variance = figures.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / figures.len() as f64;
    // Nothing is known without any error.
    variance.max((1e-6 * mean).powi(2)).max(f64::MIN_POSITIVE)
}

/// The abscissa of the least ordinate of the parabola nearest to weighted points; `None` where it opens downwards.
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

    /// 40 blocks of 500 points, each about its block's own mean.
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
    fn a_band_covers_the_truth_and_is_as_wide_as_theory_says() {
        // The variance of n normal numbers has the standard error sigma^2 sqrt(2 / n): 1 % for n = 20 000.
        let resampling = Resampling::new(40, Seed(5));
        let mut covered = 0;
        for seed in 0..40 {
            let found = resampling.banded(&blocks(0.01, seed), Block::cloud_variance_m2);
            covered += usize::from(found.low <= 1e-4 && 1e-4 <= found.high);
            let half = 0.5 * (found.high - found.low);
            assert!((half / (1.96 * 1e-6) - 1.0).abs() < 0.4, "{found:?}");
        }
        // 95 % of 40 are 38; the chance of fewer than 32 is below one in ten thousand.
        assert!(covered >= 32, "{covered}");
    }

    #[test]
    fn the_minimum_of_a_parabola_is_found_within_its_band() {
        // sigma^2 = (1 cm)^2 + (0.4 cm/ms (x - 0.3 ms))^2.
        let resampling = Resampling::new(40, Seed(5));
        let latencies = [-5.0, -2.0, -1.0, 0.0, 1.0, 2.0, 5.0_f64];
        let of = |x: f64| blocks((1e-4 + (0.004 * (x - 0.3)).powi(2)).sqrt(), (x + 100.0) as u64);
        let made: Vec<(f64, Vec<Block>)> = latencies.map(|x| (x, of(x))).to_vec();
        let curve: Vec<(f64, &[Block])> = made.iter().map(|(x, blocks)| (*x, blocks.as_slice())).collect();
        let found = resampling.minimum(&curve, Block::cloud_variance_m2).unwrap();
        assert!(found.low < 0.3 && 0.3 < found.high && found.high - found.low < 0.1, "{found:?}");
        let hill = |block: &Block| -block.cloud_variance_m2();
        assert_eq!(resampling.minimum(&curve, hill), None);
    }
}
