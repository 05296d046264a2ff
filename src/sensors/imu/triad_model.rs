//! Error model of the three axes of a gyroscope or an accelerometer.

use std::f64::consts::{LN_2, PI};

/// Shortest correlation time of the processes whose sum is flicker noise, s; white noise covers shorter times.
const SHORTEST_S: f64 = 1.0;
/// Ratio of successive correlation times.
const RATIO: f64 = 4.0;
/// Number of processes; the longest correlation time is 18 hours.
const PROCESSES: usize = 9;
/// Time over which an estimator uses the bias, s.
const EXPECTED_OVER_S: f64 = 100.0;

/// Error model of three axes of the same kind, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TriadModel {
    pub density: f64,
    pub turn_on: f64,
    pub walk: f64,
    pub gauss_markov: Option<GaussMarkov>,
    /// Bias instability B: flicker noise with an Allan deviation of `sqrt(2 ln 2 / pi) B`.
    pub instability: f64,
    pub scale: f64,
    pub misalignment: f64,
    pub limit: f64,
    pub resolution: f64,
    /// Standard deviation of the change of the bias while the sensor warms up, and its time constant.
    pub warm_up: WarmUp,
}

impl TriadModel {
    /// All Gauss-Markov processes of the bias.
    ///
    /// Flicker noise of one-sided density `B^2 / (pi f)` (IEEE Std 952, bias instability) is the sum of independent ones with
    /// correlation times in the ratio r: one of standard deviation s has `4 s^2 T / (1 + (2 pi f T)^2)`, and the sum over T
    /// is `s^2 / (f ln r)`, so that `s^2 = B^2 ln(r) / pi`.
    pub fn processes(&self) -> impl Iterator<Item = GaussMarkov> {
        let sigma = self.instability * (RATIO.ln() / PI).sqrt();
        let times = std::iter::successors(Some(SHORTEST_S), |time_s| Some(time_s * RATIO));
        let flicker = times.map(move |time_s| GaussMarkov { sigma, time_s });
        let count = if sigma > 0.0 { PROCESSES } else { 0 };
        self.gauss_markov.into_iter().chain(flicker.take(count))
    }

    /// The random walk of the bias that an estimator should expect, unit of the sensor per square root of a second.
    ///
    /// A Gauss-Markov process walks with `s sqrt(2 / T)` over times below T; of bias instability, the walk with the same Allan
    /// deviation at [`EXPECTED_OVER_S`] is taken, and of the warming-up the one with the same change over the first [`EXPECTED_OVER_S`].
    pub fn expected_walk(&self) -> f64 {
        let gauss_markov = self.gauss_markov.map_or(0.0, |process| 2.0 * process.sigma.powi(2) / process.time_s);
        let instability = 3.0 / EXPECTED_OVER_S * (2.0 * LN_2 / PI) * self.instability.powi(2);
        let warming = self.warm_up.sigma * (1.0 - (-EXPECTED_OVER_S / self.warm_up.time_s).exp());
        (self.walk.powi(2) + gauss_markov + instability + warming.powi(2) / EXPECTED_OVER_S).sqrt()
    }
}

/// Exponential change of the bias after the start, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WarmUp {
    pub sigma: f64,
    pub time_s: f64,
}

/// A first-order Gauss-Markov process in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GaussMarkov {
    pub sigma: f64,
    pub time_s: f64,
}
