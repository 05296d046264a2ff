//! Smoothing of the stamps of a sensor with a constant sampling rate.
//!
//! If stamps have jitter (from the host or the bus), the number of samples determines the time better than a single
//! stamp. A Kalman filter with the states time of the last sample and period combines both. With jitter `s` and a slowly
//! drifting rate, the error of the smoothed stamps is a few hundredths of `s` after a minute.

use super::EstimatorSpec;
use zsim_base::signal::{Regularity, StampPattern, first_on_time_s, lost_before};
use zsim_base::time::{Span, Stamp};

/// Random walk of the sampling rate, relative, per square root of a second: 0.2 ppm, as of a quartz at room temperature.
const RATE_WALK_PER_SQRT_S: f64 = 2e-7;
/// Number of consecutive outlying stamps after which the filter is reset: samples were lost, or the clock was set.
const MAX_OUTLIERS: usize = 5;
/// Variance of the smallest of many delays, as a multiple of the jitter variance.
const MIN_DELAY_VARIANCE: f64 = 0.1;
/// Relative standard deviation of the initial period, from stamps with jitter and from delayed stamps.
///
/// The lower envelope of delayed stamps is a line to 0.02 %. A larger value would let the delay of the first stamp change
/// the period.
const INITIAL_PERIOD_SIGMA: (f64, f64) = (0.01, 5e-4);
/// Number of consecutive late stamps of which the one with the smallest delay counts as on time.
const MAX_LATE: usize = 25;

/// Kalman filter of the stamps of a sensor, in seconds of the sensor clock.
#[derive(Debug, Clone)]
pub(super) struct StampFilter {
    last_s: f64,
    period_s: f64,
    covariance: [f64; 3],
    jitter2: f64,
    outliers: usize,
    started: bool,
    off: bool,
    /// Whether the sensor has no period.
    irregular: bool,
    /// Whether stamps are only delayed, so that the earliest ones are accurate.
    delayed: bool,
    /// Number of consecutive late stamps, and the smallest delay of them, s.
    late: (usize, f64),
}

impl StampFilter {
    /// A filter with period and jitter from `regularity`, and a jitter of at least `jitter_s`.
    ///
    /// A `jitter_s` of 0, or an irregular sensor, disables the filter.
    pub(super) fn new(regularity: Regularity, jitter_s: f64) -> Self {
        let Regularity { period_s, jitter_s: seen_s, pattern } = regularity;
        let off = jitter_s <= 0.0 || pattern == StampPattern::Irregular;
        let jitter_s = jitter_s.max(seen_s);
        let period_sigma =
            if pattern == StampPattern::Delayed { INITIAL_PERIOD_SIGMA.1 } else { INITIAL_PERIOD_SIGMA.0 };
        Self {
            last_s: 0.0,
            period_s,
            covariance: [jitter_s * jitter_s, 0.0, (period_sigma * period_s).powi(2)],
            jitter2: jitter_s * jitter_s,
            outliers: 0,
            started: false,
            off,
            irregular: pattern == StampPattern::Irregular,
            delayed: pattern == StampPattern::Delayed,
            late: (0, f64::INFINITY),
        }
    }

    /// Whether the sensor has no period; `period_s` is then the median interval.
    pub(super) fn is_irregular(&self) -> bool {
        self.irregular
    }

    /// Estimated sampling period, s.
    pub(super) fn period_s(&self) -> f64 {
        self.period_s
    }

    /// The smoothed time of the next sample, stamped `raw_s`, s; `later_s` are the stamps of the samples after it.
    pub(super) fn smooth(&mut self, raw_s: f64, later_s: impl Iterator<Item = f64>) -> f64 {
        let stamps_s = std::iter::once(raw_s).chain(later_s);
        if self.off || !self.started {
            let is_late = self.delayed && !self.off;
            self.started = true;
            self.last_s = if is_late { first_on_time_s(stamps_s, self.period_s) } else { raw_s };
            return self.last_s;
        }
        if self.delayed {
            let line = (self.period_s, self.jitter2.sqrt());
            self.predict(1.0 + lost_before(stamps_s, self.last_s + self.period_s, line));
            self.follow_envelope(raw_s);
            return self.last_s;
        }
        let since = raw_s - self.last_s;
        // One period unless the stamp is an outlier: a late stamp must not count as a lost sample.
        let tolerance = (0.5 * self.period_s).max(4.0 * self.jitter2.sqrt());
        let is_one = (since - self.period_s).abs() < tolerance;
        let periods = if is_one { 1.0 } else { (since / self.period_s).round().max(0.0) };
        self.predict(periods);
        let innovation = raw_s - self.last_s;
        if innovation.abs() > tolerance {
            // Many outliers are an increase of the jitter.
            self.jitter2 += 0.01 * (tolerance * tolerance - self.jitter2);
            self.outliers += 1;
            if self.outliers >= MAX_OUTLIERS || innovation.abs() > 20.0 * tolerance {
                self.outliers = 0;
                self.last_s = raw_s;
                self.covariance[0] = self.jitter2;
                self.covariance[1] = 0.0;
            }
            return self.last_s;
        }
        self.outliers = 0;
        self.correct(innovation, 1.0);
        self.last_s
    }

    /// Follows the lower envelope of delayed stamps.
    ///
    /// An early stamp is accurate, a late one is not used. Of many consecutive late stamps, the one with the smallest delay
    /// counts as on time; if that delay is several periods, samples were lost.
    fn follow_envelope(&mut self, raw_s: f64) {
        let delay_s = raw_s - self.last_s;
        let (count, least_s) = (self.late.0 + 1, self.late.1.min(delay_s));
        if delay_s > 0.0 && count < MAX_LATE {
            self.late = (count, least_s);
            self.measure_jitter(delay_s);
            return;
        }
        self.late = (0, f64::INFINITY);
        let lost = (least_s / self.period_s).round().max(0.0);
        self.predict(lost);
        self.correct(least_s - lost * self.period_s, MIN_DELAY_VARIANCE);
    }

    /// Kalman prediction over a number of periods.
    fn predict(&mut self, periods: f64) {
        let [xx, xp, pp] = self.covariance;
        self.last_s += periods * self.period_s;
        let walk = (RATE_WALK_PER_SQRT_S * self.period_s).powi(2) * periods * self.period_s;
        self.covariance = [xx + 2.0 * periods * xp + periods * periods * pp, xp + periods * pp, pp + walk];
    }

    /// Kalman update with a stamp of variance `factor` times the jitter variance.
    fn correct(&mut self, innovation: f64, factor: f64) {
        self.measure_jitter(innovation);
        let [xx, xp, pp] = self.covariance;
        // The jitter is at least 10 us.
        let total = xx + factor * self.jitter2.max(1e-10);
        let (gain_x, gain_p) = (xx / total, xp / total);
        self.last_s += gain_x * innovation;
        self.period_s += gain_p * innovation;
        self.covariance = [xx * (1.0 - gain_x), xp * (1.0 - gain_x), pp - gain_p * xp];
    }

    /// Updates the jitter estimate.
    fn measure_jitter(&mut self, innovation: f64) {
        self.jitter2 += 0.01 * (innovation * innovation - self.jitter2);
    }
}

/// Smooths the stamps of a regular sensor in the same way as the estimator.
///
/// They are in order of arrival. A projection of beams with the estimated trajectory needs these times.
pub fn smoothed_stamps(stamps: &[Stamp], spec: &EstimatorSpec) -> Vec<Stamp> {
    let Some(first) = stamps.first() else { return Vec::new() };
    let seconds: Vec<f64> = stamps.iter().map(|stamp| stamp.seconds_since(*first)).collect();
    let initial = seconds.partition_point(|s| *s <= spec.inertial.rest_s + spec.step_s);
    let Some(regularity) = Regularity::of(&seconds[..initial]) else { return stamps.to_vec() };
    let mut filter = StampFilter::new(regularity, spec.clock.jitter_s);
    let later = |k: usize| seconds[k + 1..].iter().copied();
    let smoothed = seconds.iter().enumerate().map(|(k, raw_s)| filter.smooth(*raw_s, later(k)));
    smoothed.map(|seconds| *first + Span::from_seconds(seconds)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// True times and stamps of a sensor with a period of 10 ms and 20 ppm, and Gaussian jitter (sum of 12 uniform numbers).
    fn stamps(count: usize, jitter_s: f64) -> Vec<(f64, f64)> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
        (0..count).map(|k| k as f64 * 0.01 * (1.0 + 20e-6)).map(|t| (t, t + jitter_s * normal())).collect()
    }

    /// Error of each smoothed stamp, s.
    fn errors(filter: &mut StampFilter, stamps: &[(f64, f64)]) -> Vec<f64> {
        let later = |k: usize| stamps[k + 1..].iter().map(|(_, raw)| *raw);
        stamps.iter().enumerate().map(|(k, (t, raw))| filter.smooth(*raw, later(k)) - t).collect()
    }

    fn error_after(stamps: &[(f64, f64)], from: usize) -> f64 {
        let raw: Vec<f64> = stamps.iter().take(100).map(|(_, raw)| *raw).collect();
        let mut filter = StampFilter::new(Regularity::of(&raw).unwrap(), 5e-4);
        let late = errors(&mut filter, stamps).split_off(from);
        (late.iter().map(|e| e * e).sum::<f64>() / late.len() as f64).sqrt()
    }

    #[test]
    fn jitter_of_two_milliseconds_is_smoothed_to_a_tenth_of_one() {
        // A line fit through 3000 stamps has an error at the end of 2 * 2 ms / sqrt(3000) = 0.07 ms.
        assert!(error_after(&stamps(6000, 2e-3), 3000) < 1.5e-4);
        assert!(error_after(&stamps(6000, 1e-4), 500) < 2e-5);
    }

    #[test]
    fn jitter_as_long_as_the_period_is_smoothed_too() {
        // The driver outputs samples in order, with increasing stamps.
        let mut noisy = stamps(6000, 1e-2);
        let mut raw: Vec<f64> = noisy.iter().map(|(_, raw)| *raw).collect();
        raw.sort_by(f64::total_cmp);
        noisy.iter_mut().zip(raw).for_each(|(stamp, raw)| stamp.1 = raw);
        // A line fit through 3000 stamps has an error at the end of 2 * 10 ms / sqrt(3000) = 0.37 ms.
        let error_s = error_after(&noisy, 3000);
        assert!(error_s < 7e-4, "{error_s}");
    }

    /// USB and operating system delay stamps by an exponentially distributed time, without changing their order.
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
        assert_eq!(regularity.pattern, StampPattern::Delayed);
        let mut filter = StampFilter::new(regularity, 5e-4);
        let errors = errors(&mut filter, &delayed);
        // A constant delay is part of the clock offset; only its variation matters.
        let spread = |errors: &[f64]| {
            let mean = errors.iter().sum::<f64>() / errors.len() as f64;
            (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / errors.len() as f64).sqrt()
        };
        assert!(spread(&errors[3000..]) < 1e-4, "{}", spread(&errors[3000..]));
        assert!(spread(&errors[150..]) < 4e-4, "{}", spread(&errors[150..]));
    }

    /// Standard deviation of the errors of the stamps of a sensor whose stamps are delayed and whose samples are lost, s.
    fn spread_of_delayed_and_lost(seed: u64, (period_s, mean_s, lost): (f64, f64, f64)) -> f64 {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut last = 0.0_f64;
        let mut stamps: Vec<(f64, f64)> = (0..3000)
            .map(|k| {
                let t = f64::from(k) * period_s * (1.0 + 20e-6);
                last = (t - mean_s * (1.0 - random.random::<f64>()).ln()).max(last + 1e-6);
                (t, last)
            })
            .collect();
        stamps.retain(|_| random.random::<f64>() > lost);
        let first: Vec<f64> = stamps.iter().map(|(_, raw)| *raw).take_while(|raw| *raw < 1.5).collect();
        let mut filter = StampFilter::new(Regularity::of(&first).unwrap(), 5e-4);
        let errors = errors(&mut filter, &stamps);
        let errors = &errors[first.len()..];
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / errors.len() as f64).sqrt()
    }

    /// Sampling period, mean delay, and probability of a loss; 40 recordings of each sensor.
    #[test]
    fn lost_samples_do_not_shift_the_count_of_delayed_stamps() {
        let sensors =
            [(0.01, 2e-3, 0.01), (0.01, 4e-3, 0.02), (0.01, 2e-3, 0.1), (0.025, 3e-3, 0.05), (5e-3, 2e-3, 0.05)];
        for sensor in sensors {
            let mut spreads: Vec<f64> = (0..40).map(|seed| spread_of_delayed_and_lost(seed, sensor)).collect();
            spreads.sort_by(f64::total_cmp);
            // Without smoothing, the standard deviation of an exponential delay is its mean.
            let (median, ninth_decile) = (spreads[20] / sensor.1, spreads[36] / sensor.1);
            assert!(median < 0.9 && ninth_decile < 2.8, "{sensor:?}: {median}, {ninth_decile}");
        }
    }

    /// The delays of the first stamps must not change the period: forty recordings of 15 s.
    #[test]
    fn delayed_stamps_are_followed_from_the_start_for_any_first_delays() {
        for seed in 0..40 {
            let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
            let mut last = 0.0_f64;
            let mut delayed = |k: i32| {
                let t = f64::from(k) * 0.01;
                last = (t - 4e-3 * (1.0 - random.random::<f64>()).ln()).max(last + 1e-6);
                (t, last)
            };
            let delayed: Vec<(f64, f64)> = (0..1500).map(&mut delayed).collect();
            let raw: Vec<f64> = delayed.iter().take(150).map(|(_, raw)| *raw).collect();
            let mut filter = StampFilter::new(Regularity::of(&raw).unwrap(), 5e-4);
            let errors = errors(&mut filter, &delayed);
            let mean = errors[150..].iter().sum::<f64>() / 1350.0;
            let spread = (errors[150..].iter().map(|e| (e - mean).powi(2)).sum::<f64>() / 1350.0).sqrt();
            assert!(spread < 6e-4, "{seed}: {spread}");
        }
    }

    #[test]
    fn increasing_jitter_is_followed() {
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
    fn a_step_of_the_clock_is_followed() {
        let mut jumped = stamps(2000, 1e-4);
        for (t, raw) in &mut jumped[1000..] {
            *t += 0.5;
            *raw += 0.5;
        }
        assert!(error_after(&jumped, 1500) < 1e-4);
    }
}
