use super::{Lidar, LidarErrorsSpec, Switch, echo::Echo};
use crate::measurement::LidarNoise;
use crate::random::{Seed, Stream};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};

/// Reflectance of the white sheet that data sheets measure with (Kent sheet).
const WHITE: f64 = 0.9;
/// Echoes whose chance of being missed is less than one in this many are taken as seen.
const SURELY: f64 = 1e6;
/// Odds, most draws' are less, at which the power that passes the threshold is worked out once.
const MOST_ODDS: f64 = 100.0;

/// What a seed makes of a lidar's errors.
#[derive(Debug, Clone)]
pub struct LidarErrors {
    seed: Seed,
    /// The bias that all ranges of the run share, m.
    bias_m: f64,
    sigma: LidarNoise,
    spec: LidarErrorsSpec,
    /// Power that is detected half of the time, 1/m^2.
    half_power: f64,
    /// Power that is surely detected, 1/m^2.
    sure_power: f64,
    /// Power that is detected at odds of [`MOST_ODDS`], 1/m^2.
    most_power: f64,
    cos_grazing: f64,
    on: bool,
}

/// The draws of one scan. Each beam takes the same number from each stream, whatever it meets, so that a change in one
/// beam's surroundings changes no other beam's noise.
pub(super) struct ScanDraws {
    range: Stream,
    later: Stream,
    threshold: Stream,
    glass: Stream,
}

/// The draws of one beam.
pub(super) struct BeamDraws {
    pub range: f64,
    pub threshold: f64,
    pub glass: f64,
}

impl LidarErrors {
    /// The errors of `lidar` in the run of `seed`.
    pub fn new(lidar: &Lidar, seed: Seed) -> Self {
        let spec = lidar.spec().errors.clone();
        let z: f64 = StandardNormal.sample(&mut seed.stream("lidar/bias"));
        let half_power = WHITE / spec.detection.white_reach_m.powi(2);
        Self {
            seed,
            bias_m: spec.range.bias_sigma_m * z,
            sigma: lidar.noise(),
            half_power,
            sure_power: half_power * SURELY.powf(spec.detection.softness),
            most_power: half_power * MOST_ODDS.powf(spec.detection.softness),
            cos_grazing: spec.grazing.from_deg.to_radians().cos(),
            on: lidar.spec().noise == Switch::On,
            spec,
        }
    }

    /// The bias that all ranges of the run share, m.
    pub fn bias_m(&self) -> f64 {
        if self.on { self.bias_m } else { 0.0 }
    }

    /// The draws of a scan, or `None` where the errors are switched off.
    pub(super) fn of_scan(&self, scan: u64) -> Option<ScanDraws> {
        let part = |name: &str| self.seed.part(name, scan);
        self.on.then(|| ScanDraws {
            range: part("lidar/range"),
            later: part("lidar/range/later_echoes"),
            threshold: part("lidar/threshold"),
            glass: part("lidar/glass"),
        })
    }

    /// Whether an echo passes the detector's threshold at its draw, uniform in 0..1.
    pub(super) fn detects(&self, echo: &Echo, draw: f64) -> bool {
        let odds = draw / (1.0 - draw);
        if echo.power >= self.sure_power || (echo.power > self.most_power && odds <= MOST_ODDS) {
            return true;
        }
        // P(power > half_power (u / (1 - u))^softness) is logistic in ln(power / half_power) / softness.
        echo.power > self.half_power * odds.powf(self.spec.detection.softness)
    }

    /// The range that is reported for an echo, m, before rounding; `z` is standard normal.
    pub(super) fn range_m(&self, echo: &Echo, z: f64) -> f64 {
        let weak = self.spec.detection.weak_bias_m * (self.half_power / echo.power).min(1.0);
        let grazing = self.spec.grazing.bias_m * (1.0 - echo.cos_incidence / self.cos_grazing).max(0.0);
        echo.range_m + self.bias_m + weak + grazing + self.sigma.sigma_m(echo.range_m) * z
    }

    /// A range as the sensor rounds it, m.
    pub(super) fn rounded_m(&self, range_m: f64) -> f64 {
        let step = self.spec.range.resolution_m;
        if step > 0.0 { (range_m / step).round() * step } else { range_m }
    }
}

impl ScanDraws {
    pub fn of_beam(&mut self) -> BeamDraws {
        BeamDraws {
            range: StandardNormal.sample(&mut self.range),
            threshold: f64::from(self.threshold.random::<f32>()),
            glass: f64::from(self.glass.random::<f32>()),
        }
    }

    /// For an echo after a beam's first.
    pub fn of_later_echo(&mut self) -> f64 {
        StandardNormal.sample(&mut self.later)
    }
}
