//! Period, jitter and pattern of a sensor's time stamps.

/// Thresholds for a sensor without period: stamp jitter over period, and variance ratio of intervals.
///
/// The sensor is aperiodic if the jitter exceeds the first fraction of the period, and the variance of `n` intervals
/// exceeds the second fraction of `n` times the variance of one interval.
const APERIODIC_THRESHOLDS: (f64, f64) = (0.2, 0.4);
/// The same for a sensor slower than 50 Hz. A second of its stamps is a small sample, and to call it aperiodic costs less:
/// between its readings the motion is interpolated in any case.
const SLOW_APERIODIC_THRESHOLDS: (f64, f64) = (0.12, 0.2);
/// Period of a slow sensor, s.
const SLOW_PERIOD_S: f64 = 0.02;
/// A sensor with a period of more than the first value, s, is also aperiodic if its jitter exceeds the second value times the
/// standard deviation of its intervals. Jitter about a constant period is 0.71 times it, a random walk of the stamps 1.5 times
/// and more.
const WALKING_THRESHOLDS: (f64, f64) = (0.015, 1.15);
/// Longer intervals, as multiples of the median, contain lost samples.
const MAX_INTERVAL: f64 = 1.6;
/// Skewness of the residuals above which stamps count as delayed; an exponential delay has 2.
const DELAYED_SKEWNESS: f64 = 0.8;
/// Minimum number of stamps for a meaningful skewness.
const MIN_SKEWNESS_STAMPS: usize = 30;
/// Samples count as lost if the fit with losses has a relative jitter below this fraction of that without.
const LOST_SAMPLES_JITTER_RATIO: f64 = 0.25;
/// Delayed stamps with a smaller jitter, as a fraction of the period, have a period although intervals vary with the losses.
/// Those of a sensor without a period are distributed over it: 0.25 and more.
const MAX_DELAYED_JITTER: f64 = 0.23;
/// Deviations of the first period from the median interval with which delayed stamps are counted.
const PERIOD_STEP: f64 = 0.005;
const PERIOD_STEPS: i32 = 12;
/// Iterations of counting delayed stamps with losses, each with the period of the one before.
const COUNTING_ITERATIONS: usize = 3;
/// Iterations of the lower-envelope fit, and the weight of a late stamp in it.
const ENVELOPE_ITERATIONS: usize = 30;
const LATE_WEIGHT: f64 = 1e-3;
/// Samples count as lost if the later stamps are so late with a probability below `exp(-9)` without a loss.
const LOSS_EVIDENCE: f64 = 9.0;
/// Rounding of the lateness to lost samples: a late reference must not hide a loss, an early one must not feign one.
const LOSS_ROUNDING: f64 = 0.3;
/// Time and number of later stamps that show whether samples were lost.
const LOOK_AHEAD: (f64, usize) = (0.1, 64);
/// Gain with which the count of delayed stamps with losses follows their lower envelope: it takes up an error of the period.
const ENVELOPE_GAIN: f64 = 0.1;
/// Standard deviation of exponential delays over the median deviation of the difference of two.
const SIGMA_OVER_MEDIAN: f64 = 1.0 / std::f64::consts::LN_2;
/// Stamps are in bursts if the median interval is below this fraction of the mean.
const BURST_INTERVAL_RATIO: f64 = 0.3;

/// Period, jitter and pattern of a sensor's first stamps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Regularity {
    /// Sampling period, s.
    pub period_s: f64,
    /// Standard deviation of the stamps about the fitted line, s.
    pub jitter_s: f64,
    /// Distribution of the stamps about the fitted line.
    pub pattern: StampPattern,
}

/// Pattern of a sensor's stamps about the fitted line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StampPattern {
    /// Symmetric jitter.
    Regular,
    /// One-sided jitter: a host or a bus delays the stamps.
    Delayed,
    /// Several samples arrive at once.
    Bursts,
    /// No period; `period_s` is the median interval.
    Irregular,
}

impl StampPattern {
    /// Name of the pattern in printed output.
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
    /// Fits a line through stamps over sample counts; stamps in order of time.
    ///
    /// Two counts are compared: one from the intervals, which accounts for lost samples, and the plain number of
    /// samples, which is right if the jitter is as large as the period. The better fit is used. `None` for fewer than
    /// three stamps, or for stamps that do not increase.
    pub fn of(stamps_s: &[f64]) -> Option<Self> {
        let mut intervals: Vec<f64> = stamps_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let without_losses = Self::about_line(stamps_s.iter().copied().zip(0..).map(|(s, k)| (f64::from(k), s)));
        intervals.sort_by(f64::total_cmp);
        // The lower median: pairs have as many intervals of zero as others.
        let typical = intervals.get(intervals.len().saturating_sub(1) / 2).copied().unwrap_or_default();
        let comes_in_bursts = typical < BURST_INTERVAL_RATIO * intervals.iter().sum::<f64>() / intervals.len() as f64;
        intervals.retain(|dt| *dt > 0.0);
        if intervals.len() < 2 {
            return None;
        }
        let median = intervals[intervals.len() / 2];
        if comes_in_bursts {
            // Within bursts the intervals are unrelated to the period, so use the number of samples.
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
            // A long delay looks like a loss, and with large jitter a short interval looks like the period.
            (Some(a), Some(b)) if a.relative_jitter() >= LOST_SAMPLES_JITTER_RATIO * b.relative_jitter() => {
                match Self::of_delayed_with_losses(stamps_s, median) {
                    Some(c) if c.relative_jitter() < MAX_DELAYED_JITTER.min(b.relative_jitter()) => return Some(c),
                    Some(c) if c.relative_jitter() < b.relative_jitter() => c,
                    _ => b,
                }
            }
            (a, b) => a.or(b)?,
        };
        let (jitter, variance_ratio) =
            if median > SLOW_PERIOD_S { SLOW_APERIODIC_THRESHOLDS } else { APERIODIC_THRESHOLDS };
        let walks = median > WALKING_THRESHOLDS.0
            && line.jitter_s > WALKING_THRESHOLDS.1 * interval_sigma_s(stamps_s, MAX_INTERVAL * median);
        if line.jitter_s > jitter * line.period_s && (walks || has_independent_intervals(stamps_s, variance_ratio)) {
            return Some(Self { period_s: median, jitter_s: 0.0, pattern: StampPattern::Irregular });
        }
        Some(line)
    }

    /// Standard deviation of the stamps about the line, as a fraction of the period.
    fn relative_jitter(&self) -> f64 {
        self.jitter_s / self.period_s
    }

    /// Fits a line through delayed stamps among which samples were lost; `None` if the stamps are not delayed.
    ///
    /// The samples are counted with the period of the line, which starts as the median interval.
    fn of_delayed_with_losses(stamps_s: &[f64], median_s: f64) -> Option<Self> {
        let mut deviations: Vec<f64> = stamps_s.windows(2).map(|pair| (pair[1] - pair[0] - median_s).abs()).collect();
        deviations.sort_by(f64::total_cmp);
        let jitter_s = SIGMA_OVER_MEDIAN * deviations.get(deviations.len() / 2)?;
        let fit = |deviation: i32| {
            let period_s = median_s * (1.0 + PERIOD_STEP * f64::from(deviation));
            let mut line = Self { period_s, jitter_s, pattern: StampPattern::Delayed };
            for _ in 0..COUNTING_ITERATIONS {
                let counts = counts_of_delayed(stamps_s, &line);
                line = Self::about_line(counts.zip(stamps_s.iter().copied()))?;
            }
            (line.pattern == StampPattern::Delayed).then_some(line)
        };
        let lines = (-PERIOD_STEPS..=PERIOD_STEPS).filter_map(fit);
        lines.min_by(|a, b| a.relative_jitter().total_cmp(&b.relative_jitter()))
    }

    /// Fits a line through points (count, stamp); `None` unless it increases.
    fn about_line(points: impl Iterator<Item = (f64, f64)>) -> Option<Self> {
        let points: Vec<(f64, f64)> = points.collect();
        let n = points.len() as f64;
        let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / n;
        let (mx, my) = (mean(|p| p.0), mean(|p| p.1));
        let sum = |of: &dyn Fn(f64, f64) -> f64| points.iter().map(|(x, y)| of(x - mx, y - my)).sum::<f64>();
        let period_s = sum(&|x, y| x * y) / sum(&|x, _| x * x);
        let jitter_s = (sum(&|x, y| (y - period_s * x).powi(2)) / n).sqrt();
        let skewness = sum(&|x, y| (y - period_s * x).powi(3)) / n / jitter_s.powi(3);
        let delayed = points.len() >= MIN_SKEWNESS_STAMPS && skewness > DELAYED_SKEWNESS && jitter_s > 1e-4;
        let period_s = if delayed { Self::lower_envelope(&points, period_s) } else { period_s };
        let is_line = points.len() > 2 && period_s > 0.0 && jitter_s.is_finite();
        let pattern = if delayed { StampPattern::Delayed } else { StampPattern::Regular };
        is_line.then_some(Self { period_s, jitter_s, pattern })
    }

    /// The slope of the lower envelope of points (count, stamp), starting from `slope`.
    ///
    /// Least squares with a small weight for points above the line (expectile regression, Newey and Powell,
    /// Econometrica 55, 1987).
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

/// Number of samples lost before a delayed stamp, from its lateness and that of the later stamps, s.
///
/// Delays are independent and exponentially distributed with a mean of `jitter_s`: if no sample was lost, `n` stamps are all
/// late by `least` with a probability of `exp(-n least / jitter_s)`. The lateness counts from the time at which the stamp
/// would be on time without a loss; the stamps of the next 0.1 s are considered.
pub fn lost_before(stamps_s: impl Iterator<Item = f64>, on_time_s: f64, line: (f64, f64)) -> f64 {
    let (period_s, jitter_s) = line;
    let (count, least_s) = least_lateness(stamps_s, on_time_s, period_s);
    let lost = (least_s / period_s + LOSS_ROUNDING).floor().max(0.0);
    if count as f64 * least_s > LOSS_EVIDENCE * jitter_s { lost } else { 0.0 }
}

/// The time of the first of delayed stamps without its delay, which the stamps after it show, s.
pub fn first_on_time_s(stamps_s: impl Iterator<Item = f64>, period_s: f64) -> f64 {
    let mut stamps_s = stamps_s.peekable();
    let first_s = stamps_s.peek().copied().unwrap_or_default();
    first_s + least_lateness(stamps_s, first_s, period_s).1.min(0.0)
}

/// Number of the stamps of the next 0.1 s, and the smallest lateness of them, s.
fn least_lateness(stamps_s: impl Iterator<Item = f64>, on_time_s: f64, period_s: f64) -> (usize, f64) {
    let mut stamps_s = stamps_s.take(LOOK_AHEAD.1).peekable();
    let until_s = stamps_s.peek().map_or(0.0, |first_s| first_s + LOOK_AHEAD.0);
    let lateness = stamps_s.take_while(|stamp_s| *stamp_s <= until_s).zip(0..);
    let lateness = lateness.map(|(stamp_s, k)| stamp_s - on_time_s - f64::from(k) * period_s);
    lateness.fold((0, f64::INFINITY), |(count, least_s), late_s| (count + 1, least_s.min(late_s)))
}

/// The sample count of each delayed stamp; `line` has the period and the jitter.
fn counts_of_delayed(stamps_s: &[f64], line: &Regularity) -> impl Iterator<Item = f64> {
    let Regularity { period_s, jitter_s, .. } = *line;
    let (mut count, mut on_time_s) = (-1.0, first_on_time_s(stamps_s.iter().copied(), period_s) - period_s);
    (0..stamps_s.len()).map(move |k| {
        let later = || stamps_s[k..].iter().copied();
        let advance = 1.0 + lost_before(later(), on_time_s + period_s, (period_s, jitter_s));
        count += advance;
        on_time_s += advance * period_s;
        on_time_s += ENVELOPE_GAIN * least_lateness(later(), on_time_s, period_s).1;
        count
    })
}

/// Standard deviation of the intervals below `longest_s`, s.
fn interval_sigma_s(stamps_s: &[f64], longest_s: f64) -> f64 {
    let intervals = || stamps_s.windows(2).map(|pair| pair[1] - pair[0]).filter(|interval| *interval < longest_s);
    let n = intervals().count() as f64;
    let mean_s = intervals().sum::<f64>() / n;
    (intervals().map(|interval| (interval - mean_s).powi(2)).sum::<f64>() / n).sqrt()
}

/// Whether the intervals are independent, as those of a sensor without period.
///
/// The variance of the duration of `n` independent intervals grows with `n`; jitter about a constant period does not.
fn has_independent_intervals(stamps_s: &[f64], variance_ratio: f64) -> bool {
    let variance = |n: usize| {
        let times: Vec<f64> = stamps_s.windows(n + 1).map(|run| run[n] - run[0]).collect();
        let mean = times.iter().sum::<f64>() / times.len() as f64;
        times.iter().map(|time| (time - mean).powi(2)).sum::<f64>() / times.len() as f64
    };
    let many = (stamps_s.len() / 4).min(16);
    many >= 4 && variance(many) > variance_ratio * many as f64 * variance(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// Stamps with a period of 10 ms, a clock error of 20 ppm and Gaussian jitter (sum of twelve uniform numbers).
    fn stamps(count: usize, jitter_s: f64) -> Vec<f64> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
        (0..count).map(|k| k as f64 * 0.01 * (1.0 + 20e-6) + jitter_s * normal()).collect()
    }

    #[test]
    fn stamps_in_bursts_give_the_sample_period() {
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
    fn the_arrivals_of_a_micro_controller_have_no_period() {
        // Arrival times of a real sensor, as samples of a 100 Hz IMU; any second and a half of them.
        let text = include_str!("../../../specs/faults/imu_arrivals_mcu.txt");
        let arrivals = text.lines().filter(|line| !line.starts_with('#')).map(|line| line.parse::<f64>().unwrap());
        let mut samples: Vec<f64> = arrivals.map(|arrival| (arrival / 0.01).ceil() * 0.01).collect();
        samples.dedup();
        for start in 0..50 {
            let from = samples.partition_point(|t| *t < f64::from(start));
            let to = samples.partition_point(|t| *t < f64::from(start) + 1.5);
            let found = Regularity::of(&samples[from..to]);
            assert_eq!(found.unwrap().pattern, StampPattern::Irregular, "{start}: {found:?}");
        }
    }

    /// Any three seconds of stamps that are not measurements of a constant period: of a real sensor, as they are, and of loops
    /// that sleep for a period and then work.
    #[test]
    fn stamps_that_walk_have_no_period() {
        let text = include_str!("../../../specs/faults/imu_arrivals_mcu.txt");
        let arrivals: Vec<f64> =
            text.lines().filter(|line| !line.starts_with('#')).map(|line| line.parse().unwrap()).collect();
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        let mut at_s = 0.0;
        let mut loops = |least_s: f64, most_s: f64| -> Vec<f64> {
            let step_s = |_| {
                at_s += least_s + (most_s - least_s) * random.random::<f64>();
                at_s
            };
            (0..2000).map(step_s).collect()
        };
        let (uniform, wide) = (loops(0.015, 0.025), loops(0.03, 0.046));
        for (stamps, allowed) in [(&arrivals, 0), (&uniform, 1), (&wide, 1)] {
            let first_s = stamps[0];
            let regular = (0..25).filter(|k| {
                let (from_s, to_s) = (first_s + f64::from(*k), first_s + f64::from(*k) + 3.0);
                let within: Vec<f64> = stamps.iter().copied().filter(|s| (from_s..to_s).contains(s)).collect();
                Regularity::of(&within).unwrap().pattern != StampPattern::Irregular
            });
            assert!(regular.count() <= allowed, "{stamps:?}");
        }
    }

    #[test]
    fn the_period_is_found_despite_lost_samples() {
        let mut kept: Vec<f64> = stamps(200, 1e-4);
        kept.retain(|raw| ((raw / 0.01) as usize) % 7 != 2);
        assert!((Regularity::of(&kept).unwrap().period_s - 0.01).abs() < 2e-6);
        assert_eq!(Regularity::of(&[1.0, 1.0, 1.0]), None);
    }

    /// A long delay must not count as a loss.
    #[test]
    fn delayed_stamps_without_losses_give_the_period() {
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
