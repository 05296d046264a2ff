//! Smoothing of a regular sensor's stamps.
//!
//! A sensor that samples at a steady rate but is stamped with jitter (by a host, over a bus) says more about its times
//! by counting than by any single stamp. A Kalman filter over (time of the last sample, period) follows the count: with
//! jitter `s` and a rate that wanders slowly, the smoothed stamps are good to a few hundredths of `s` within a minute.

use super::EstimatorSpec;
use crate::time::{Span, Stamp};

/// Wander of a sensor's rate, relative, per square root of a second: 0.2 ppm, a quartz in a room.
const RATE_WALK_PER_SQRT_S: f64 = 2e-7;
/// So many stamps in a row far from the count mean that the count is wrong.
const STRIKES: usize = 5;
/// A sensor may have no period when its stamps scatter about a line by more than this multiple of it, and has none when
/// the variance of `n` intervals is more than this fraction of `n` times that of one.
/// Stamps are delayed where their skewness about a line is above the first (that of an exponential delay is 2); then a
/// late stamp has the second times the variance of the jitter, an early one the third.
const DELAYED: (f64, f64, f64) = (0.8, 30.0, 0.03);
/// A stamp that is later than this is behind a gap, not delayed, s.
const LONGEST_DELAY_S: f64 = 0.12;
/// Of so many late stamps in a row the least late is on time.
const LATE_IN_A_ROW: usize = 25;
/// Of fewer stamps the skewness says nothing.
const DELAYED_FROM: usize = 30;
/// Samples were lost where a line with losses fits the stamps better by this factor.
const LOSSES_FIT: f64 = 0.8;
/// Iterations of the line below delayed stamps.
const ENVELOPE_ITERATIONS: usize = 30;
/// Stamps come in bursts where the median interval is less than this fraction of the mean.
const BURST: f64 = 0.3;
const APERIODIC: (f64, f64) = (0.2, 0.4);

/// Follows the stamps of a regular sensor. Seconds on the sensor's own clock.
#[derive(Debug, Clone)]
pub(super) struct StampFilter {
    last_s: f64,
    period_s: f64,
    covariance: [f64; 3],
    jitter2: f64,
    strikes: usize,
    started: bool,
    off: bool,
    /// Whether stamps are delayed, so that the earliest are the truest.
    delayed: bool,
    /// How many stamps in a row are late, and the least delay among them, s.
    late: (usize, f64),
}

impl StampFilter {
    /// A filter for a sensor whose first stamps showed `regularity`, and that jitters by at least `jitter_s`; zero
    /// passes every stamp as it is, and so does a sensor without a period.
    pub(super) fn new(regularity: Regularity, jitter_s: f64) -> Self {
        let Regularity { period_s, jitter_s: seen_s, periodic, delayed } = regularity;
        let off = jitter_s <= 0.0 || !periodic;
        let jitter_s = jitter_s.max(seen_s);
        Self {
            last_s: 0.0,
            period_s,
            covariance: [jitter_s * jitter_s, 0.0, (0.01 * period_s).powi(2)],
            jitter2: jitter_s * jitter_s,
            strikes: 0,
            started: false,
            off,
            delayed,
            late: (0, f64::INFINITY),
        }
    }

    /// The sensor's period as far as known, s.
    pub(super) fn period_s(&self) -> f64 {
        self.period_s
    }

    /// When the next sample, stamped `raw_s`, was really taken.
    pub(super) fn smooth(&mut self, raw_s: f64) -> f64 {
        if self.off || !self.started {
            self.started = true;
            self.last_s = raw_s;
            return raw_s;
        }
        let since = raw_s - self.last_s;
        // One period unless the stamp is far off: a late stamp must not be taken for a lost sample.
        let tolerance = (0.5 * self.period_s).max(4.0 * self.jitter2.sqrt());
        let is_one = (since - self.period_s).abs() < tolerance || (self.delayed && since < LONGEST_DELAY_S);
        let periods = if is_one { 1.0 } else { (since / self.period_s).round().max(0.0) };
        self.predict(periods);
        if self.delayed {
            self.follow_envelope(raw_s);
            return self.last_s;
        }
        let innovation = raw_s - self.last_s;
        if innovation.abs() > tolerance {
            // One such stamp is a chance, many are a jitter that has grown.
            self.jitter2 += 0.01 * (tolerance * tolerance - self.jitter2);
            self.strikes += 1;
            if self.strikes >= STRIKES || innovation.abs() > 20.0 * tolerance {
                self.strikes = 0;
                self.last_s = raw_s;
                self.covariance[0] = self.jitter2;
                self.covariance[1] = 0.0;
            }
            return self.last_s;
        }
        self.strikes = 0;
        self.correct(innovation, 1.0);
        self.last_s
    }

    /// Delays only ever make a stamp late: an early one lies near the truth, a late one says little, but the least late
    /// of many in a row is on time. Where that is late by periods, samples were lost.
    fn follow_envelope(&mut self, raw_s: f64) {
        let delay_s = raw_s - self.last_s;
        let (count, least_s) = (self.late.0 + 1, self.late.1.min(delay_s));
        if delay_s > 0.0 && count < LATE_IN_A_ROW {
            self.late = (count, least_s);
            self.correct(delay_s, DELAYED.1);
            return;
        }
        self.late = (0, f64::INFINITY);
        let lost = (least_s / self.period_s).round().max(0.0);
        self.predict(lost);
        self.correct(least_s.min(delay_s) - lost * self.period_s, DELAYED.2);
    }

    fn predict(&mut self, periods: f64) {
        let [xx, xp, pp] = self.covariance;
        self.last_s += periods * self.period_s;
        let walk = (RATE_WALK_PER_SQRT_S * self.period_s).powi(2) * periods * self.period_s;
        self.covariance = [xx + 2.0 * periods * xp + periods * periods * pp, xp + periods * pp, pp + walk];
    }

    /// By a stamp with so many times the variance of the jitter.
    fn correct(&mut self, innovation: f64, share: f64) {
        // The jitter is measured as it comes; never believed below 10 us.
        self.jitter2 += 0.01 * (innovation * innovation - self.jitter2);
        let [xx, xp, pp] = self.covariance;
        let total = xx + share * self.jitter2.max(1e-10);
        let (gain_x, gain_p) = (xx / total, xp / total);
        self.last_s += gain_x * innovation;
        self.period_s += gain_p * innovation;
        self.covariance = [xx * (1.0 - gain_x), xp * (1.0 - gain_x), pp - gain_p * xp];
    }
}

/// What the first stamps of a regular sensor show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Regularity {
    /// From sample to sample, s.
    pub(super) period_s: f64,
    /// Standard deviation of the stamps about a line through them, s.
    pub(super) jitter_s: f64,
    /// Whether the stamps scatter to one side: they are delayed by a host or a bus.
    pub(super) delayed: bool,
    /// Whether the samples follow a period at all; if not, `period_s` is the median interval.
    pub(super) periodic: bool,
}

impl Regularity {
    /// Of stamps in order: a line through stamps over counts, the counts being such that the stamps lie closest to it.
    /// Where samples were lost, the intervals tell the count; where stamps jitter by as much as the period, only their
    /// number does. `None` for fewer than three stamps, or for stamps that do not advance.
    pub(super) fn of(stamps_s: &[f64]) -> Option<Self> {
        let mut intervals: Vec<f64> = stamps_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let without_losses = Self::about_line(stamps_s.iter().copied().zip(0..).map(|(s, k)| (f64::from(k), s)));
        intervals.retain(|dt| *dt > 0.0);
        if intervals.len() < 2 {
            return None;
        }
        intervals.sort_by(f64::total_cmp);
        let median = intervals[intervals.len() / 2];
        if median < BURST * intervals.iter().sum::<f64>() / intervals.len() as f64 {
            // Stamps in bursts: the intervals within them say nothing of the period, the number of samples does.
            return without_losses;
        }
        let (mut count, mut before) = (-1.0, stamps_s[0]);
        let counted = stamps_s.iter().map(|stamp| {
            count += ((stamp - before) / median).round().max(1.0);
            before = *stamp;
            (count, *stamp)
        });
        let by_intervals = Self::about_line(counted);
        let line = match (by_intervals, without_losses) {
            // A long delay passes for a loss, which chance may make fit a little better.
            (Some(a), Some(b)) => {
                if a.jitter_s < LOSSES_FIT * b.jitter_s {
                    a
                } else {
                    b
                }
            }
            (a, b) => a.or(b)?,
        };
        if line.jitter_s > APERIODIC.0 * line.period_s && wanders(stamps_s) {
            return Some(Self { period_s: median, jitter_s: 0.0, periodic: false, delayed: false });
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
        let delayed = points.len() >= DELAYED_FROM && skewness > DELAYED.0 && jitter_s > 1e-4;
        let period_s = if delayed { Self::lower_envelope(&points, period_s) } else { period_s };
        let is_line = points.len() > 2 && period_s > 0.0 && jitter_s.is_finite();
        is_line.then_some(Self { period_s, jitter_s, periodic: true, delayed })
    }

    /// The slope of a line below points (count, stamp): least squares in which points above it count for little
    /// (expectile regression, Newey and Powell, Econometrica 55, 1987), begun from `slope`.
    fn lower_envelope(points: &[(f64, f64)], slope: f64) -> f64 {
        let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / points.len() as f64;
        let (mut slope, mut offset) = (slope, mean(|p| p.1) - slope * mean(|p| p.0));
        for _ in 0..ENVELOPE_ITERATIONS {
            let mut sums = [0.0; 5];
            for (x, y) in points {
                let weight = if *y > slope * x + offset { DELAYED.2 / DELAYED.1 } else { 1.0 };
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

/// When the samples of a regular sensor were really taken, as the estimator takes it: their stamps, in the order in
/// which they came, smoothed by these settings. Whoever projects beams by an estimate needs the times that it used.
pub fn smoothed_stamps(stamps: &[Stamp], spec: &EstimatorSpec) -> Vec<Stamp> {
    let Some(first) = stamps.first() else { return Vec::new() };
    let seconds: Vec<f64> = stamps.iter().map(|stamp| stamp.seconds_since(*first)).collect();
    let learning = seconds.partition_point(|s| *s <= spec.inertial.rest_s + spec.step_s);
    let Some(regularity) = Regularity::of(&seconds[..learning]) else { return stamps.to_vec() };
    let mut filter = StampFilter::new(regularity, spec.clock.jitter_s);
    seconds.iter().map(|raw_s| *first + Span::from_seconds(filter.smooth(*raw_s))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// Stamps of a sensor of period 10 ms and 20 ppm whose jitter is Gaussian (sum of twelve uniform numbers).
    fn stamps(count: usize, jitter_s: f64) -> Vec<(f64, f64)> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
        (0..count).map(|k| k as f64 * 0.01 * (1.0 + 20e-6)).map(|t| (t, t + jitter_s * normal())).collect()
    }

    fn error_after(stamps: &[(f64, f64)], from: usize) -> f64 {
        let raw: Vec<f64> = stamps.iter().take(100).map(|(_, raw)| *raw).collect();
        let mut filter = StampFilter::new(Regularity::of(&raw).unwrap(), 5e-4);
        let errors = stamps.iter().map(|(t, raw)| filter.smooth(*raw) - t);
        let late: Vec<f64> = errors.skip(from).collect();
        (late.iter().map(|e| e * e).sum::<f64>() / late.len() as f64).sqrt()
    }

    #[test]
    fn jitter_of_two_milliseconds_is_smoothed_to_a_tenth_of_one() {
        // A line through 3000 stamps would know its end to 2 * 2 ms / sqrt(3000) = 0.07 ms.
        assert!(error_after(&stamps(6000, 2e-3), 3000) < 1.5e-4);
        assert!(error_after(&stamps(6000, 1e-4), 500) < 2e-5);
    }

    #[test]
    fn jitter_as_long_as_the_period_is_smoothed_too() {
        // A driver passes samples on in order, with stamps that increase.
        let mut noisy = stamps(6000, 1e-2);
        let mut raw: Vec<f64> = noisy.iter().map(|(_, raw)| *raw).collect();
        raw.sort_by(f64::total_cmp);
        noisy.iter_mut().zip(raw).for_each(|(stamp, raw)| stamp.1 = raw);
        // A line through 3000 stamps would know its end to 2 * 10 ms / sqrt(3000) = 0.37 ms.
        let error_s = error_after(&noisy, 3000);
        assert!(error_s < 7e-4, "{error_s}");
    }

    /// USB and operating systems delay stamps by an exponential time, and keep their order.
    #[test]
    fn delayed_stamps_are_followed_along_their_lower_envelope() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(8);
        let mut last = 0.0_f64;
        let delayed: Vec<(f64, f64)> = (0..6000)
            .map(|k| {
                let t = f64::from(k) * 0.01 * (1.0 + 20e-6);
                last = (t - 5e-3 * (1.0 - random.random::<f64>()).ln()).max(last + 1e-6);
                (t, last)
            })
            .collect();
        let raw: Vec<f64> = delayed.iter().take(150).map(|(_, raw)| *raw).collect();
        let regularity = Regularity::of(&raw).unwrap();
        assert!(regularity.delayed);
        let mut filter = StampFilter::new(regularity, 5e-4);
        let errors: Vec<f64> = delayed.iter().map(|(t, raw)| filter.smooth(*raw) - t).collect();
        // A constant delay is the clock offset's to find; what counts is how far it wanders.
        let spread = |errors: &[f64]| {
            let mean = errors.iter().sum::<f64>() / errors.len() as f64;
            (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / errors.len() as f64).sqrt()
        };
        assert!(spread(&errors[3000..]) < 1e-4, "{}", spread(&errors[3000..]));
        assert!(spread(&errors[150..]) < 4e-4, "{}", spread(&errors[150..]));
    }

    /// A period that was learnt wrong by a percent is learnt anew, though hardly a stamp is early then.
    #[test]
    fn delayed_stamps_correct_a_period_that_is_too_short() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(8);
        let delayed: Vec<(f64, f64)> = (0..2000)
            .map(|k| f64::from(k) * 0.01)
            .map(|t| (t, t - 4e-3 * (1.0 - random.random::<f64>()).ln()))
            .collect();
        let regularity = Regularity { period_s: 0.0099, jitter_s: 4e-3, periodic: true, delayed: true };
        let mut filter = StampFilter::new(regularity, 5e-4);
        let errors: Vec<f64> = delayed.iter().map(|(t, raw)| filter.smooth(*raw) - t).collect();
        assert!(errors[500..].iter().all(|error| error.abs() < 2e-3), "{:?}", &errors[500..510]);
    }

    #[test]
    fn stamps_in_bursts_have_the_period_of_the_samples() {
        let bursts: Vec<f64> = (0..160).map(|k| f64::from(k / 4) * 0.04 + f64::from(k % 4) * 1e-6).collect();
        let regularity = Regularity::of(&bursts).unwrap();
        assert!((regularity.period_s - 0.01).abs() < 2e-4 && regularity.periodic, "{regularity:?}");
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
        assert!(!Regularity::of(&irregular).unwrap().periodic);
        let noisy: Vec<f64> = stamps(150, 8e-3).iter().map(|(_, raw)| *raw).collect();
        assert!(Regularity::of(&noisy).unwrap().periodic);
    }

    #[test]
    fn jitter_that_grows_is_followed() {
        let (calm, wild) = (stamps(1000, 1e-4), stamps(6000, 8e-3));
        let grown: Vec<(f64, f64)> = calm.into_iter().chain(wild.into_iter().skip(1000)).collect();
        let error_s = error_after(&grown, 4000);
        assert!(error_s < 7e-4, "{error_s}");
    }

    #[test]
    fn lost_samples_do_not_shift_the_count() {
        let mut kept = stamps(6000, 3e-4);
        let mut index = 0;
        kept.retain(|_| {
            index += 1;
            index % 10 != 3 && !(4000..4100).contains(&index)
        });
        assert!(error_after(&kept, 1000) < 1e-4);
    }

    #[test]
    fn a_clock_that_jumps_is_followed() {
        let mut jumped = stamps(2000, 1e-4);
        for (t, raw) in &mut jumped[1000..] {
            *t += 0.5;
            *raw += 0.5;
        }
        assert!(error_after(&jumped, 1500) < 1e-4);
    }

    #[test]
    fn the_period_is_found_in_spite_of_losses() {
        let mut kept: Vec<f64> = stamps(200, 1e-4).iter().map(|(_, raw)| *raw).collect();
        kept.retain(|raw| ((raw / 0.01) as usize) % 7 != 2);
        assert!((Regularity::of(&kept).unwrap().period_s - 0.01).abs() < 2e-6);
        assert_eq!(Regularity::of(&[1.0, 1.0, 1.0]), None);
    }
}
