use super::{Beam, PatternSpec};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::ops::RangeInclusive;
use zsim_base::geometry::Vector;
use zsim_base::measurement::LidarNoise;
use zsim_base::spec::{Source, SpecError, checked};

/// Accepted scan rates, Hz.
const RATES_HZ: RangeInclusive<f64> = 0.1..=1000.0;
/// Maximum beams per second: a hundred times those of a spinning lidar with 16 channels.
const MAX_BEAMS_PER_S: f64 = 3e7;

/// A lidar, by the data sheet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LidarSpec {
    /// Directions and times of the beams of a scan.
    pub pattern: PatternSpec,
    /// Scans per second, Hz.
    #[serde(with = "checked::Positive")]
    pub rate_hz: f64,
    /// Minimum reported range, m. Nearer echoes are reported as too near.
    #[serde(default = "usual::range_min_m", with = "checked::NonNegative")]
    pub range_min_m: f64,
    /// Maximum reported range, m. Rays end there.
    #[serde(with = "checked::Positive")]
    pub range_max_m: f64,
    /// Number of rays that represent a beam.
    #[serde(default)]
    pub beam: BeamModel,
    /// Half-angle of the beam divergence at 1/e^2 of the intensity, mrad. A larger value gives more mixed pixels.
    #[serde(default, with = "checked::NonNegative")]
    pub divergence_half_angle_mrad: f64,
    /// Pulse length, m: echoes of one beam within this distance merge into a mixed pixel.
    #[serde(default, with = "checked::NonNegative")]
    pub pulse_length_m: f64,
    /// Maximum number of reported echoes per beam, strongest first; 1..=7.
    #[serde(default = "usual::echoes")]
    pub echoes: u8,
    /// Intensity of the echo of a white surface at 1 m and normal incidence.
    #[serde(with = "checked::NonNegative")]
    pub intensity_at_1_m: f64,
    /// Whether the errors below are applied.
    #[serde(default)]
    pub noise: Switch,
    /// Range errors.
    pub errors: LidarErrorsSpec,
}

/// Number of rays that represent a beam.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BeamModel {
    /// One ray: no mixed pixels.
    #[default]
    Single,
    /// Seven rays over the cross-section of the beam: mixed pixels at edges, several echoes.
    Divergent,
}

/// On or off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Switch {
    /// On.
    #[default]
    On,
    /// Off.
    Off,
}

/// Range errors of a lidar.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LidarErrorsSpec {
    /// Noise, bias and resolution.
    pub range: RangeNoiseSpec,
    /// Detection threshold, and range bias of weak echoes.
    pub detection: DetectionSpec,
    /// Range bias at grazing incidence.
    #[serde(default)]
    pub grazing: GrazingSpec,
    /// Reflection and delay by glass.
    #[serde(default)]
    pub glass: GlassSpec,
}

/// Noise, bias and resolution of a range.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RangeNoiseSpec {
    /// Standard deviation up to `near_m`, m; at all ranges without the keys of the far range.
    #[serde(with = "checked::NonNegative")]
    pub near_sigma_m: f64,
    /// Range up to which `near_sigma_m` applies, m.
    #[serde(default, with = "checked::NonNegative")]
    pub near_m: f64,
    /// Standard deviation at `far_m`, m; linear in range beyond `near_m`. By default that up to `near_m`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub far_sigma_m: Option<RangeSigma>,
    /// Range at which `far_sigma_m` applies, m; `range_max_m` by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub far_m: Option<FarRange>,
    /// Standard deviation over runs of a bias that is constant within a run, m.
    #[serde(default, with = "checked::NonNegative")]
    pub bias_sigma_m: f64,
    /// Resolution, m: ranges are rounded to a multiple of it; 0 disables the rounding.
    #[serde(default, with = "checked::NonNegative")]
    pub resolution_m: f64,
}

/// A standard deviation, m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(transparent)]
pub struct RangeSigma(#[serde(with = "checked::NonNegative")] pub f64);

/// A range above zero, m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(transparent)]
pub struct FarRange(#[serde(with = "checked::Positive")] pub f64);

/// Detection of echoes. The power of an echo is `reflectance cos(incidence) / range^2`, for a Lambertian surface wider
/// than the beam; the detection probability is logistic in the logarithm of the power.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DetectionSpec {
    /// Range at which half of the echoes of a white target (reflectance 0.9) at normal incidence are detected, m.
    #[serde(with = "checked::Positive")]
    pub white_reach_m: f64,
    /// Width of the threshold: the change of the logarithm of the power that changes the detection odds by a factor of
    /// e.
    #[serde(with = "checked::Positive")]
    pub softness: f64,
    /// Range bias of an echo at the threshold, m, positive for too long; inversely proportional to the power.
    #[serde(default, with = "checked::Finite")]
    pub weak_bias_m: f64,
}

/// Range bias at grazing incidence; none by default.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GrazingSpec {
    /// Angle of incidence above which ranges are biased, degrees from the normal.
    #[serde(with = "checked::NonNegative")]
    pub from_deg: f64,
    /// Bias at 90 degrees, m, negative for too short; linear in the cosine of incidence.
    #[serde(with = "checked::Finite")]
    pub bias_m: f64,
}

/// Effects of glass, in addition to the attenuation by transmission in both directions; none by default.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GlassSpec {
    /// Fraction of beams that the glass itself reflects at normal incidence; proportional to the cosine of incidence.
    #[serde(with = "checked::Fraction")]
    pub echo: f64,
    /// Range bias of surfaces seen through the glass, m: thickness times (refractive index - 1).
    #[serde(with = "checked::NonNegative")]
    pub delay_m: f64,
}

/// The values of keys that are omitted.
mod usual {
    pub fn range_min_m() -> f64 {
        0.1
    }

    pub fn echoes() -> u8 {
        1
    }
}

impl LidarSpec {
    /// Range noise.
    pub(super) fn range_noise(&self) -> LidarNoise {
        let RangeNoiseSpec { near_sigma_m, near_m, far_sigma_m, far_m, .. } = self.errors.range;
        LidarNoise {
            near_sigma_m,
            near_m,
            far_sigma_m: far_sigma_m.map_or(near_sigma_m, |sigma| sigma.0),
            far_m: far_m.map_or(self.range_max_m, |range| range.0),
        }
    }

    /// Checks the relations between fields.
    pub(super) fn check(&self, source: &Source) -> Result<(), SpecError> {
        let refuse = |key: &str, message: String| Err(SpecError::about(source, key, message));
        if !RATES_HZ.contains(&self.rate_hz) {
            let message = format!("{} scans a second; give {} to {}", self.rate_hz, RATES_HZ.start(), RATES_HZ.end());
            return refuse("rate_hz", message);
        }
        if self.range_min_m >= self.range_max_m {
            let message = format!("range_min_m {} is not below range_max_m {}", self.range_min_m, self.range_max_m);
            return refuse("range_min_m", message);
        }
        let LidarNoise { near_m, far_m, .. } = self.range_noise();
        if near_m >= far_m {
            return refuse("near_m", format!("near_m {near_m} is not below far_m {far_m}"));
        }
        if !(1..=7).contains(&self.echoes) {
            return refuse("echoes", format!("{} echoes a beam; give 1 to 7", self.echoes));
        }
        if self.divergence_half_angle_mrad > 100.0 {
            let message =
                format!("a divergence of {} mrad is too large; give at most 100", self.divergence_half_angle_mrad);
            return refuse("divergence_half_angle_mrad", message);
        }
        if self.errors.grazing.from_deg >= 90.0 {
            return refuse("from_deg", "grazing incidence must start below 90 degrees".to_owned());
        }
        Ok(())
    }

    /// Checks the number of beams per second, with `beams` per scan.
    pub(super) fn check_beams(&self, beams: usize, source: &Source) -> Result<(), SpecError> {
        let per_s = beams as f64 * self.rate_hz;
        if per_s <= MAX_BEAMS_PER_S {
            return Ok(());
        }
        let message = format!(
            "{beams} beams a scan at {} Hz are {per_s:.3e} beams a second; {MAX_BEAMS_PER_S:.0e} at most",
            self.rate_hz
        );
        Err(SpecError::about(source, "rate_hz", message))
    }

    /// The rays, grouped by beam, and the weight of each ray of a beam.
    ///
    /// A divergent beam is Gaussian with half-angle `d` at 1/e^2: one ray of weight 1/2 on the axis and six of weight
    /// 1/12 at `d` around it. This quadrature is exact for moments up to the fifth order (Stroud's E2 5-1: the mean
    /// squared radius is d^2/2, the mean fourth power d^4/2).
    pub(super) fn rays(&self, beams: &[Beam]) -> (Vec<Vector>, &'static [f64]) {
        const TWELFTH: f64 = 1.0 / 12.0;
        if self.beam == BeamModel::Single {
            return (beams.iter().map(|beam| beam.direction_in_laser).collect(), &[1.0]);
        }
        let slope = (self.divergence_half_angle_mrad * 1e-3).tan();
        let rays = beams.iter().flat_map(|beam| {
            let axis = beam.direction_in_laser;
            // The axis of a planar lidar lies in the plane z = 0, and so does one of the two transverse directions.
            let sideways = if axis.z.abs() < 0.9 { Vector::z().cross(&axis) } else { Vector::x().cross(&axis) };
            let (left, up) = (sideways.normalize(), axis.cross(&sideways).normalize());
            let around = (0..6).map(move |k| {
                let (sin, cos) = (f64::from(k) * TAU / 6.0).sin_cos();
                (axis + (left * cos + up * sin) * slope).normalize()
            });
            std::iter::once(axis).chain(around)
        });
        (rays.collect(), &[0.5, TWELFTH, TWELFTH, TWELFTH, TWELFTH, TWELFTH, TWELFTH])
    }
}
