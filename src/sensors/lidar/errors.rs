use super::draws::ScanDraws;
use super::echo::Echo;
use super::{Lidar, LidarErrorsSpec, Switch};
use rand_distr::{Distribution, StandardNormal};
use zsim_base::measurement::LidarNoise;
use zsim_base::random::Seed;

/// Reflectance of the white target (Kent sheet) with which data sheets specify range.
const WHITE_REFLECTANCE: f64 = 0.9;
/// Detection odds above which an echo counts as certain: fewer than one miss in a million.
const CERTAIN_ODDS: f64 = 1e6;
/// The powers that are detected at odds of `2^k` are precomputed for `k` from minus this number to this number: for most beams
/// the two around their odds decide, without `powf`.
const OCTAVES: i32 = 24;

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
    /// Powers detected at odds of 0 and of `2^k` for each octave, and infinity, 1/m^2.
    octave_powers: Vec<f64>,
    cos_grazing: f64,
    on: bool,
}

impl LidarErrors {
    /// The errors of `lidar` in the run with `seed`.
    pub fn new(lidar: &Lidar, seed: Seed) -> Self {
        let spec = lidar.spec().errors.clone();
        let z: f64 = StandardNormal.sample(&mut seed.stream("lidar/bias"));
        let half_power = WHITE_REFLECTANCE / spec.detection.white_reach_m.powi(2);
        let octaves = (-OCTAVES..=OCTAVES).map(|k| half_power * 2.0_f64.powi(k).powf(spec.detection.softness));
        Self {
            seed,
            bias_m: spec.range.bias_sigma_m * z,
            sigma: lidar.noise(),
            half_power,
            certain_power: half_power * CERTAIN_ODDS.powf(spec.detection.softness),
            octave_powers: [0.0].into_iter().chain(octaves).chain([f64::INFINITY]).collect(),
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
        let above = octave_above(odds);
        if echo.power >= self.certain_power || echo.power > self.octave_powers[above] {
            return true;
        }
        if echo.power <= self.octave_powers[above - 1] {
            return false;
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

/// Index in [`LidarErrors::octave_powers`] of the least power that is detected at any odds up to the next octave's.
fn octave_above(odds: f64) -> usize {
    // The exponent of a floating-point number, with a bias of 1023.
    let exponent = (odds.to_bits() >> 52) as i32 - 1023;
    (exponent.clamp(-OCTAVES - 1, OCTAVES) + OCTAVES + 2) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LidarSpec;
    use zsim_base::spec::{Kind, find, parse};

    #[test]
    fn octaves_decide_as_the_logistic_law() {
        let source = find(Kind::Lidar, "utm30lx").unwrap();
        let lidar = Lidar::new(&parse::<LidarSpec>(&source).unwrap(), &source).unwrap();
        let errors = LidarErrors::new(&lidar, Seed(3));
        let softness = errors.spec.detection.softness;
        let (mut detected, mut all) = (0, 0);
        for k in 0..4000 {
            // Draws close to 0 and to 1 too, and powers around that of half of the detections.
            let draw = 0.5 * (1.0 + (f64::from(k) * 0.7).sin()).powi(3).min(1.99999);
            let power = errors.half_power * 10.0_f64.powf(3.0 * (f64::from(k) * 1.1).sin());
            let echo = Echo { range_m: 5.0, power, cos_incidence: 1.0 };
            let by_law =
                power >= errors.certain_power || power > errors.half_power * (draw / (1.0 - draw)).powf(softness);
            assert_eq!(errors.detects(&echo, draw), by_law, "power {power}, draw {draw}");
            (detected, all) = (detected + usize::from(by_law), all + 1);
        }
        assert!((all / 4..3 * all / 4).contains(&detected), "{detected} of {all}");
        assert!(!errors.detects(&Echo::default(), 0.0), "no light is never detected");
    }
}
