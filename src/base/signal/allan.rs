//! Overlapping Allan deviation with equivalent degrees of freedom and confidence interval.
//!
//! Formulas: W. J. Riley, Handbook of Frequency Stability Analysis, NIST Special Publication 1065 (2008). The rate of a
//! gyroscope (or the specific force of an accelerometer) takes the role of fractional frequency, the integral that of
//! phase.

use super::chi_squared_quantile;

/// The Allan deviation at one averaging time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AllanPoint {
    /// Averaging time, s.
    pub tau_s: f64,
    /// Allan deviation, in the unit of the samples.
    pub deviation: f64,
    /// Equivalent degrees of freedom of the estimated variance.
    pub edf: f64,
}

impl AllanPoint {
    /// The interval of the true deviation at the given `confidence`, for example 0.95.
    ///
    /// From the chi-squared distribution of the estimate: `edf s^2 / sigma^2 ~ chi^2(edf)` (SP 1065, eq. 45).
    pub fn confidence_interval(&self, confidence: f64) -> (f64, f64) {
        let tail = (1.0 - confidence) / 2.0;
        let bound = |p: f64| self.deviation * (self.edf / chi_squared_quantile(p, self.edf)).sqrt();
        (bound(1.0 - tail), bound(tail))
    }
}

/// The overlapping Allan deviation of `samples` at `rate_hz`, at the times `averaging[i] / rate_hz`.
///
/// `sigma^2(m tau0) = sum_k (x[k+2m] - 2 x[k+m] + x[k])^2 / (2 (m tau0)^2 (n - 2m))` over the `n` points of the
/// integral x (SP 1065, eq. 11). The result has no point for an averaging factor m of zero or with `2 m` above the
/// number of samples.
///
/// The degrees of freedom depend on the type of noise. It is identified at each averaging time from the autocorrelation
/// of the averaged samples (SP 1065, section 5.5.6); with too few averages, the type of the last averaging time with
/// enough of them is used.
pub fn allan_deviation(samples: &[f64], rate_hz: f64, averaging: &[usize]) -> Vec<AllanPoint> {
    let integral = integral_of(samples);
    let mut noise = Noise::White;
    let mut points = Vec::with_capacity(averaging.len());
    for &m in averaging.iter().filter(|m| **m > 0 && samples.len() >= 2 * **m) {
        noise = Noise::identify(&integral, m).unwrap_or(noise);
        let differences = integral.iter().zip(&integral[m..]).zip(&integral[2 * m..]);
        let count = integral.len() - 2 * m;
        let sum: f64 = differences.map(|((a, b), c)| (c - 2.0 * b + a).powi(2)).sum();
        let variance = sum / (2.0 * (m as f64).powi(2) * count as f64);
        let edf = noise.edf(integral.len() as f64, m as f64).max(1.0);
        points.push(AllanPoint { tau_s: m as f64 / rate_hz, deviation: variance.sqrt(), edf });
    }
    points
}

/// The integral of `samples` minus their mean, from 0, in units of the sampling interval.
///
/// The Allan deviation does not depend on the mean; removing it avoids loss of precision over hours of data.
fn integral_of(samples: &[f64]) -> Vec<f64> {
    let mean = samples.iter().sum::<f64>() / samples.len().max(1) as f64;
    let mut sum = 0.0;
    let sums = samples.iter().map(|sample| {
        sum += sample - mean;
        sum
    });
    std::iter::once(0.0).chain(sums).collect()
}

/// Types of noise by the exponent of frequency in the spectrum of the rate.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Noise {
    /// f^2: quantisation of the integral.
    WhitePhase,
    /// f^1.
    FlickerPhase,
    /// f^0: angle random walk.
    White,
    /// f^-1: bias instability.
    Flicker,
    /// f^-2: rate random walk.
    RandomWalk,
}

impl Noise {
    /// Minimum number of averaged samples for the identification of the noise type.
    const MIN_SAMPLES: usize = 30;

    /// Identifies the noise type at averaging factor `m`; `None` with too few averages.
    ///
    /// Uses the lag-1 autocorrelation r of the averages, differenced d times until stationary: the exponent is -2 (d +
    /// r / (1 + r)) (SP 1065, section 5.5.6).
    fn identify(integral: &[f64], m: usize) -> Option<Self> {
        let phases: Vec<f64> = integral.iter().step_by(m).copied().collect();
        let mut series: Vec<f64> = phases.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if series.len() < Self::MIN_SAMPLES {
            return None;
        }
        let mut differences = 0.0;
        loop {
            let r = lag_one_autocorrelation(&series);
            let delta = r / (1.0 + r);
            if delta < 0.25 || differences >= 2.0 {
                return Some(Self::from_exponent(-2.0 * (delta + differences)));
            }
            series = series.windows(2).map(|pair| pair[1] - pair[0]).collect();
            differences += 1.0;
        }
    }

    fn from_exponent(exponent: f64) -> Self {
        match exponent.round() {
            e if e >= 2.0 => Noise::WhitePhase,
            e if e >= 1.0 => Noise::FlickerPhase,
            e if e <= -2.0 => Noise::RandomWalk,
            e if e <= -1.0 => Noise::Flicker,
            _ => Noise::White,
        }
    }

    /// Degrees of freedom of the overlapping Allan variance (SP 1065, table 5).
    ///
    /// `n` points of the integral, averaging factor `m`.
    fn edf(self, n: f64, m: f64) -> f64 {
        match self {
            Noise::WhitePhase => (n + 1.0) * (n - 2.0 * m) / (2.0 * (n - m)),
            Noise::FlickerPhase => {
                let product = ((n - 1.0) / (2.0 * m)).ln() * ((2.0 * m + 1.0) * (n - 1.0) / 4.0).ln();
                product.max(0.0).sqrt().exp()
            }
            Noise::White => {
                let periods = 3.0 * (n - 1.0) / (2.0 * m) - 2.0 * (n - 2.0) / n;
                periods * 4.0 * m * m / (4.0 * m * m + 5.0)
            }
            Noise::Flicker if m < 2.0 => 2.0 * (n - 2.0).powi(2) / (2.3 * n - 4.9),
            Noise::Flicker => 5.0 * n * n / (4.0 * m * (n + 3.0 * m)),
            Noise::RandomWalk => {
                let spread = (n - 1.0).powi(2) - 3.0 * m * (n - 1.0) + 4.0 * m * m;
                (n - 2.0) / m * spread / (n - 3.0).powi(2)
            }
        }
    }
}

fn lag_one_autocorrelation(series: &[f64]) -> f64 {
    let mean = series.iter().sum::<f64>() / series.len() as f64;
    let power: f64 = series.iter().map(|x| (x - mean).powi(2)).sum();
    let lagged: f64 = series.windows(2).map(|pair| (pair[0] - mean) * (pair[1] - mean)).sum();
    if power > 0.0 { lagged / power } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Seed;
    use approx::assert_relative_eq;
    use rand_distr::{Distribution, StandardNormal};

    fn white(seed: u64, count: usize) -> Vec<f64> {
        StandardNormal.sample_iter(Seed(seed).stream("white")).take(count).collect()
    }

    fn random_walk(seed: u64, count: usize) -> Vec<f64> {
        let mut level = 0.0;
        let step = |x: f64| {
            level += x;
            level
        };
        white(seed, count).into_iter().map(step).collect()
    }

    #[test]
    fn a_ramp_has_the_deviation_of_its_slope() {
        // Averages over tau of a ramp of slope s differ by s tau, so the deviation is s tau / sqrt(2).
        let ramp: Vec<f64> = (0..1000).map(|k| 0.3 * f64::from(k) / 100.0).collect();
        for point in allan_deviation(&ramp, 100.0, &[1, 7, 50, 400]) {
            assert_relative_eq!(point.deviation, 0.3 * point.tau_s / 2_f64.sqrt(), max_relative = 1e-9);
        }
    }

    #[test]
    fn nist_test_data_give_the_handbook_results() {
        // SP 1065, section 12.4: 1000 points of the generator n[i+1] = 16807 n[i] mod 2147483647 from 1234567890, over
        // the modulus; overlapping Allan deviation at m = 1, 10, 100 as printed in table 31.
        let mut n: u64 = 1_234_567_890;
        let samples: Vec<f64> = (0..1000)
            .map(|_| {
                let x = n as f64 / 2_147_483_647.0;
                n = 16_807 * n % 2_147_483_647;
                x
            })
            .collect();
        let points = allan_deviation(&samples, 1.0, &[1, 10, 100]);
        let deviations: Vec<f64> = points.iter().map(|point| point.deviation).collect();
        assert_relative_eq!(deviations[0], 2.922_319e-1, epsilon = 1e-7);
        assert_relative_eq!(deviations[1], 9.159_953e-2, epsilon = 1e-8);
        assert_relative_eq!(deviations[2], 3.241_343e-2, epsilon = 1e-8);
        // Uniform noise is white; the handbook's worked example of error bars for these data has edf 146.177 at m = 10.
        assert_relative_eq!(points[1].edf, 146.177, epsilon = 0.01);
    }

    #[test]
    fn white_noise_falls_and_a_random_walk_rises_with_the_root_of_time() {
        // Unit white samples averaged over m: sigma = 1 / sqrt(m). A walk of unit steps: sigma^2 = (2 m^2 + 1) / (6 m),
        // exact for sampled averages. Four standard errors of a deviation are 4 / sqrt(2 edf).
        let within = |point: &AllanPoint, expected: f64| {
            assert_relative_eq!(point.deviation, expected, max_relative = 4.0 / (2.0 * point.edf).sqrt());
        };
        for point in allan_deviation(&white(1, 100_000), 1.0, &[1, 10, 100, 1000]) {
            within(&point, 1.0 / point.tau_s.sqrt());
        }
        for point in allan_deviation(&random_walk(2, 100_000), 1.0, &[1, 10, 100, 1000]) {
            within(&point, ((2.0 * point.tau_s.powi(2) + 1.0) / (6.0 * point.tau_s)).sqrt());
        }
    }

    #[test]
    fn degrees_of_freedom_agree_with_repeated_trials() {
        // By definition edf = 2 E[s^2]^2 / Var[s^2]; 1500 trials determine the variance to 4 %, the formulas are
        // accurate to some 5 %.
        for (draw, m) in [(white as fn(u64, usize) -> Vec<f64>, 8), (random_walk, 8), (white, 40), (random_walk, 40)] {
            let points: Vec<AllanPoint> =
                (0..1500).map(|seed| allan_deviation(&draw(seed, 400), 1.0, &[1, m])[1]).collect();
            let variances: Vec<f64> = points.iter().map(|point| point.deviation.powi(2)).collect();
            let mean = variances.iter().sum::<f64>() / 1500.0;
            let spread = variances.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 1499.0;
            let mut edfs: Vec<f64> = points.iter().map(|point| point.edf).collect();
            edfs.sort_by(f64::total_cmp);
            assert_relative_eq!(edfs[750], 2.0 * mean * mean / spread, max_relative = 0.15);
        }
    }

    #[test]
    fn averages_longer_than_half_the_record_have_no_point() {
        let points = allan_deviation(&white(3, 100), 100.0, &[0, 1, 50, 51]);
        let taus: Vec<f64> = points.iter().map(|point| point.tau_s).collect();
        assert_eq!(taus, [0.01, 0.5]);
        assert!(allan_deviation(&[], 100.0, &[1]).is_empty());
        let (low, high) = points[0].confidence_interval(0.95);
        assert!(low < points[0].deviation && points[0].deviation < high);
    }
}
