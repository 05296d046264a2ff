use super::draws::ScanDraws;
use super::echo::Echo;
use super::{Lidar, LidarErrorsSpec, Switch};
use crate::measurement::LidarNoise;
use crate::random::Seed;
use rand_distr::{Distribution, StandardNormal};

/// Reflectance of the white target (Kent sheet) with which data sheets specify range.
const WHITE_REFLECTANCE: f64 = 0.9;
/// Detection odds above which an echo counts as certain: fewer than one miss in a million.
const CERTAIN_ODDS: f64 = 1e6;
/// Detection odds for which the power threshold is precomputed: most draws are below, so most beams need no `powf`.
const FAST_PATH_ODDS: f64 = 100.0;

/// Errors of a lidar in one run, sampled with a seed.
#[derive(Debug, Clone)]
pub struct LidarErrors {
    seed: Seed,
    /// Bias common to all ranges of the run, m.
    bias_m: f64,
    sigma: LidarNoise,
    spec: LidarErrorsSpec,
    /// Power that is detected with probability 1/2, 1/m^2.
    half_power: f64,
    /// Power above which detection is certain, 1/m^2.
    certain_power: f64,
    /// Power detected at odds of [`FAST_PATH_ODDS`], 1/m^2.
    fast_path_power: f64,
    cos_grazing: f64,
    on: bool,
}

impl LidarErrors {
    /// The errors of `lidar` in the run with `seed`.
    pub fn new(lidar: &Lidar, seed: Seed) -> Self {
        let spec = lidar.spec().errors.clone();
        let z: f64 = StandardNormal.sample(&mut seed.stream("lidar/bias"));
        let half_power = WHITE_REFLECTANCE / spec.detection.white_reach_m.powi(2);
        Self {
            seed,
            bias_m: spec.range.bias_sigma_m * z,
            sigma: lidar.noise(),
            half_power,
            certain_power: half_power * CERTAIN_ODDS.powf(spec.detection.softness),
            fast_path_power: half_power * FAST_PATH_ODDS.powf(spec.detection.softness),
            cos_grazing: spec.grazing.from_deg.to_radians().cos(),
            on: lidar.spec().noise == Switch::On,
            spec,
        }
    }

    /// Bias common to all ranges of the run, m.
    pub fn bias_m(&self) -> f64 {
        if self.on { self.bias_m } else { 0.0 }
    }

    /// Random numbers of a scan; `None` if the errors are switched off.
    pub(super) fn scan_draws(&self, scan: u64) -> Option<ScanDraws> {
        self.on.then(|| ScanDraws::of(&self.seed, scan))
    }

    /// Whether an echo is detected, given a draw uniform in 0..1.
    pub(super) fn detects(&self, echo: &Echo, draw: f64) -> bool {
        let odds = draw / (1.0 - draw);
        if echo.power >= self.certain_power || (echo.power > self.fast_path_power && odds <= FAST_PATH_ODDS) {
            return true;
        }
        // P(power > half_power (u / (1 - u))^softness) is logistic in ln(power / half_power) / softness.
        echo.power > self.half_power * odds.powf(self.spec.detection.softness)
    }

    /// The reported range of an echo before rounding, m; `z` is standard normal.
    pub(super) fn range_m(&self, echo: &Echo, z: f64) -> f64 {
        let weak = self.spec.detection.weak_bias_m * (self.half_power / echo.power).min(1.0);
        let grazing = self.spec.grazing.bias_m * (1.0 - echo.cos_incidence / self.cos_grazing).max(0.0);
        echo.range_m + self.bias_m + weak + grazing + self.sigma.sigma_m(echo.range_m) * z
    }

    /// A range rounded to the resolution of the sensor, m.
    pub(super) fn quantised_m(&self, range_m: f64) -> f64 {
        let step = self.spec.range.resolution_m;
        if step > 0.0 { (range_m / step).round() * step } else { range_m }
    }
}
