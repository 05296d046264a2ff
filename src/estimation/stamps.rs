//! Smoothing of a regular sensor's stamps.
//!
//! A sensor that samples at a steady rate but is stamped with jitter (by a host, over a bus) says more about its times
//! by counting than by any single stamp. A Kalman filter over (time of the last sample, period) follows the count: with
//! jitter `s` and a rate that wanders slowly, the smoothed stamps are good to a few hundredths of `s` within a minute.

use super::EstimatorSpec;
use crate::signal::{Regularity, StampPattern};
use crate::time::{Span, Stamp};

/// Wander of a sensor's rate, relative, per square root of a second: 0.2 ppm, a quartz in a room.
const RATE_WALK_PER_SQRT_S: f64 = 2e-7;
/// So many stamps in a row far from the count mean that the count is wrong.
const STRIKES: usize = 5;
/// Variance of the least late of many delayed stamps, as a multiple of that of the jitter.
const ON_TIME: f64 = 0.1;
/// Relative standard deviation of a period that was learnt from jittered stamps, and from delayed ones, whose lower
/// envelope is a line to 0.02 %. A larger one lets the first stamp's own delay pass for a wrong period.
const LEARNT: (f64, f64) = (0.01, 5e-4);
/// A stamp that is later than this is behind a gap, not delayed, s.
const LONGEST_DELAY_S: f64 = 0.12;
/// Of so many late stamps in a row the least late is on time.
const LATE_IN_A_ROW: usize = 25;

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
        let Regularity { period_s, jitter_s: seen_s, pattern } = regularity;
        let off = jitter_s <= 0.0 || pattern == StampPattern::Irregular;
        let jitter_s = jitter_s.max(seen_s);
        let learnt = if pattern == StampPattern::Delayed { LEARNT.1 } else { LEARNT.0 };
        Self {
            last_s: 0.0,
            period_s,
            covariance: [jitter_s * jitter_s, 0.0, (learnt * period_s).powi(2)],
            jitter2: jitter_s * jitter_s,
            strikes: 0,
            started: false,
            off,
            delayed: pattern == StampPattern::Delayed,
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

    /// Delays only ever make a stamp late: an early one lies near the truth, a late one says nothing, but the least
    /// late of many in a row is on time. Where that is late by periods, samples were lost.
    fn follow_envelope(&mut self, raw_s: f64) {
        let delay_s = raw_s - self.last_s;
        let (count, least_s) = (self.late.0 + 1, self.late.1.min(delay_s));
        if delay_s > 0.0 && count < LATE_IN_A_ROW {
            self.late = (count, least_s);
            self.measure_jitter(delay_s);
            return;
        }
        self.late = (0, f64::INFINITY);
        let lost = (least_s / self.period_s).round().max(0.0);
        self.predict(lost);
        self.correct(least_s - lost * self.period_s, ON_TIME);
    }

    fn predict(&mut self, periods: f64) {
        let [xx, xp, pp] = self.covariance;
        self.last_s += periods * self.period_s;
        let walk = (RATE_WALK_PER_SQRT_S * self.period_s).powi(2) * periods * self.period_s;
        self.covariance = [xx + 2.0 * periods * xp + periods * periods * pp, xp + periods * pp, pp + walk];
    }

    /// By a stamp with so many times the variance of the jitter.
    fn correct(&mut self, innovation: f64, share: f64) {
        self.measure_jitter(innovation);
        let [xx, xp, pp] = self.covariance;
        // Never believed below 10 us.
        let total = xx + share * self.jitter2.max(1e-10);
        let (gain_x, gain_p) = (xx / total, xp / total);
        self.last_s += gain_x * innovation;
        self.period_s += gain_p * innovation;
        self.covariance = [xx * (1.0 - gain_x), xp * (1.0 - gain_x), pp - gain_p * xp];
    }

    fn measure_jitter(&mut self, innovation: f64) {
        self.jitter2 += 0.01 * (innovation * innovation - self.jitter2);
    }
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
        assert_eq!(regularity.pattern, StampPattern::Delayed);
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

    /// The first stamps' own delays must not pass for another period: forty recordings of 15 s.
    #[test]
    fn delayed_stamps_are_followed_from_the_start_whatever_the_first_delays() {
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
            let errors: Vec<f64> = delayed.iter().map(|(t, raw)| filter.smooth(*raw) - t).collect();
            let mean = errors[150..].iter().sum::<f64>() / 1350.0;
            let spread = (errors[150..].iter().map(|e| (e - mean).powi(2)).sum::<f64>() / 1350.0).sqrt();
            assert!(spread < 6e-4, "{seed}: {spread}");
        }
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
}
