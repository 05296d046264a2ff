//! The period of a sensor, and how its stamps lie about it.

/// A sensor may have no period when its stamps scatter about a line by more than the first multiple of it, and has none
/// when the variance of `n` intervals is more than the second fraction of `n` times that of one.
const APERIODIC: (f64, f64) = (0.2, 0.4);
/// Stamps are delayed where their skewness about a line is above this; that of an exponential delay is 2.
const DELAYED_SKEWNESS: f64 = 0.8;
/// Of fewer stamps the skewness says nothing.
const DELAYED_FROM: usize = 30;
/// Samples were lost where a line with losses leaves less than this share of the jitter, each in its periods.
const LOSSES_FIT: f64 = 0.25;
/// Iterations of the line below delayed stamps, and the weight of a late stamp in them.
const ENVELOPE_ITERATIONS: usize = 30;
const LATE_WEIGHT: f64 = 1e-3;
/// Stamps come in bursts where the median interval is less than this fraction of the mean.
const BURST: f64 = 0.3;

/// What the first stamps of a sensor show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Regularity {
    /// From sample to sample, s.
    pub period_s: f64,
    /// Standard deviation of the stamps about a line through them, s.
    pub jitter_s: f64,
    /// How the stamps lie about that line.
    pub pattern: StampPattern,
}

/// How the stamps of a sensor lie about a line through them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StampPattern {
    /// To either side.
    Regular,
    /// To one side: they are delayed by a host or a bus.
    Delayed,
    /// Several samples at once.
    Bursts,
    /// The samples follow no period; `period_s` is the median interval.
    Irregular,
}

impl StampPattern {
    /// As in what is printed.
    pub fn name(self) -> &'static str {
        match self {
            Self::Regular => "regular",
            Self::Delayed => "delayed",
            Self::Bursts => "bursts",
            Self::Irregular => "irregular",
        }
    }
}

impl Regularity {
    /// Of stamps in order: a line through stamps over counts, the counts being such that the stamps lie closest to it.
    /// Where samples were lost, the intervals tell the count; where stamps jitter by as much as the period, only their
    /// number does. `None` for fewer than three stamps, or for stamps that do not advance.
    pub fn of(stamps_s: &[f64]) -> Option<Self> {
        let mut intervals: Vec<f64> = stamps_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let without_losses = Self::about_line(stamps_s.iter().copied().zip(0..).map(|(s, k)| (f64::from(k), s)));
        intervals.sort_by(f64::total_cmp);
        let typical = intervals.get(intervals.len() / 2).copied().unwrap_or_default();
        let comes_in_bursts = typical < BURST * intervals.iter().sum::<f64>() / intervals.len() as f64;
        intervals.retain(|dt| *dt > 0.0);
        if intervals.len() < 2 {
            return None;
        }
        let median = intervals[intervals.len() / 2];
        if comes_in_bursts {
            // Stamps in bursts: the intervals within them say nothing of the period, the number of samples does.
            return without_losses.map(|line| match line.pattern {
                StampPattern::Regular => Self { pattern: StampPattern::Bursts, ..line },
                _ => line,
            });
        }
        let (mut count, mut before) = (-1.0, stamps_s[0]);
        let counted = stamps_s.iter().map(|stamp| {
            count += ((stamp - before) / median).round().max(1.0);
            before = *stamp;
            (count, *stamp)
        });
        let by_intervals = Self::about_line(counted);
        let line = match (by_intervals, without_losses) {
            // A long delay passes for a loss, and among jittered stamps any short interval for the period.
            (Some(a), Some(b)) => {
                let fits = a.jitter_s / a.period_s < LOSSES_FIT * b.jitter_s / b.period_s;
                if fits { a } else { b }
            }
            (a, b) => a.or(b)?,
        };
        if line.jitter_s > APERIODIC.0 * line.period_s && wanders(stamps_s) {
            return Some(Self { period_s: median, jitter_s: 0.0, pattern: StampPattern::Irregular });
        }
        Some(line)
    }

    /// The line through points (count, stamp), if it rises.
    fn about_line(points: impl Iterator<Item = (f64, f64)>) -> Option<Self> {
        let points: Vec<(f64, f64)> = points.collect();
        let n = points.len() as f64;
        let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / n;
        let (mx, my) = (mean(|p| p.0), mean(|p| p.1));
        let sum = |of: &dyn Fn(f64, f64) -> f64| points.iter().map(|(x, y)| of(x - mx, y - my)).sum::<f64>();
        let period_s = sum(&|x, y| x * y) / sum(&|x, _| x * x);
        let jitter_s = (sum(&|x, y| (y - period_s * x).powi(2)) / n).sqrt();
        let skewness = sum(&|x, y| (y - period_s * x).powi(3)) / n / jitter_s.powi(3);
        let delayed = points.len() >= DELAYED_FROM && skewness > DELAYED_SKEWNESS && jitter_s > 1e-4;
        let period_s = if delayed { Self::lower_envelope(&points, period_s) } else { period_s };
        let is_line = points.len() > 2 && period_s > 0.0 && jitter_s.is_finite();
        let pattern = if delayed { StampPattern::Delayed } else { StampPattern::Regular };
        is_line.then_some(Self { period_s, jitter_s, pattern })
    }

    /// The slope of a line below points (count, stamp): least squares in which points above it count for little
    /// (expectile regression, Newey and Powell, Econometrica 55, 1987), begun from `slope`.
    fn lower_envelope(points: &[(f64, f64)], slope: f64) -> f64 {
        let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / points.len() as f64;
        let (mut slope, mut offset) = (slope, mean(|p| p.1) - slope * mean(|p| p.0));
        for _ in 0..ENVELOPE_ITERATIONS {
            let mut sums = [0.0; 5];
            for (x, y) in points {
                let weight = if *y > slope * x + offset { LATE_WEIGHT } else { 1.0 };
                let terms = [1.0, *x, *y, x * x, x * y];
                sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += weight * term);
            }
            let [w, x, y, xx, xy] = sums;
            let determinant = w * xx - x * x;
            if determinant <= 0.0 {
                break;
            }
            slope = (w * xy - x * y) / determinant;
            offset = (y - slope * x) / w;
        }
        slope
    }
}

/// Whether intervals add up like independent ones: the variance of the time that `n` of them take then grows with `n`,
/// while jitter of the stamps of a regular sensor leaves it as it is.
fn wanders(stamps_s: &[f64]) -> bool {
    let variance = |n: usize| {
        let times: Vec<f64> = stamps_s.windows(n + 1).map(|run| run[n] - run[0]).collect();
        let mean = times.iter().sum::<f64>() / times.len() as f64;
        times.iter().map(|time| (time - mean).powi(2)).sum::<f64>() / times.len() as f64
    };
    let many = (stamps_s.len() / 4).min(16);
    many >= 4 && variance(many) > APERIODIC.1 * many as f64 * variance(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// Stamps of a sensor of period 10 ms and 20 ppm whose jitter is Gaussian (sum of twelve uniform numbers).
    fn stamps(count: usize, jitter_s: f64) -> Vec<f64> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
        (0..count).map(|k| k as f64 * 0.01 * (1.0 + 20e-6) + jitter_s * normal()).collect()
    }

    #[test]
    fn stamps_in_bursts_have_the_period_of_the_samples() {
        let bursts: Vec<f64> = (0..160).map(|k| f64::from(k / 4) * 0.04 + f64::from(k % 4) * 1e-6).collect();
        let regularity = Regularity::of(&bursts).unwrap();
        assert!(
            (regularity.period_s - 0.01).abs() < 2e-4 && regularity.pattern == StampPattern::Bursts,
            "{regularity:?}"
        );
    }

    #[test]
    fn a_sensor_without_a_period_is_recognised() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(9);
        let mut t = 0.0;
        let irregular: Vec<f64> = (0..60)
            .map(|_| {
                t += 0.02 + 0.04 * random.random::<f64>();
                t
            })
            .collect();
        assert_eq!(Regularity::of(&irregular).unwrap().pattern, StampPattern::Irregular);
        let noisy: Vec<f64> = stamps(150, 8e-3);
        assert_ne!(Regularity::of(&noisy).unwrap().pattern, StampPattern::Irregular);
    }

    #[test]
    fn the_period_is_found_in_spite_of_losses() {
        let mut kept: Vec<f64> = stamps(200, 1e-4);
        kept.retain(|raw| ((raw / 0.01) as usize) % 7 != 2);
        assert!((Regularity::of(&kept).unwrap().period_s - 0.01).abs() < 2e-6);
        assert_eq!(Regularity::of(&[1.0, 1.0, 1.0]), None);
    }

    /// A long delay must not pass for a loss.
    #[test]
    fn delayed_stamps_of_which_none_is_lost_have_their_period() {
        for seed in 0..40 {
            let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
            let mut last = 0.0_f64;
            let mut delayed = |k: i32| {
                last = (f64::from(k) * 0.01 - 4e-3 * (1.0 - random.random::<f64>()).ln()).max(last + 1e-6);
                last
            };
            let delayed: Vec<f64> = (0..1000).map(&mut delayed).collect();
            let found = Regularity::of(&delayed).unwrap();
            assert!(
                (found.period_s - 0.01).abs() < 1e-5 && found.pattern == StampPattern::Delayed,
                "{seed}: {found:?}"
            );
        }
    }
}
