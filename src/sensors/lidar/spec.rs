use super::{Beam, PatternSpec};
use crate::geometry::Vector;
use crate::spec::{Source, SpecError, checked};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::ops::RangeInclusive;

/// Scans a second of any lidar that is simulated, Hz.
const RATES_HZ: RangeInclusive<f64> = 0.1..=1000.0;
/// Most beams a second: a hundred times those of a spinning lidar with 16 channels.
const MOST_BEAMS_PER_S: f64 = 3e7;

/// A lidar, as its data sheet has it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LidarSpec {
    /// Where and when the beams of a scan are fired.
    pub pattern: PatternSpec,
    /// Scans a second.
    #[serde(with = "checked::Positive")]
    pub rate_hz: f64,
    /// Least range that is reported, m.
    #[serde(with = "checked::NonNegative")]
    pub range_min_m: f64,
    /// Greatest range that is reported, m.
    #[serde(with = "checked::Positive")]
    pub range_max_m: f64,
    /// How many rays stand for a beam.
    pub beam: Rays,
    /// Angle from a beam's axis to where its light has fallen to 1/e^2, mrad.
    #[serde(with = "checked::NonNegative")]
    pub divergence_half_angle_mrad: f64,
    /// Surfaces within one beam that are nearer to each other than this, along it, give one mixed echo, m.
    #[serde(with = "checked::NonNegative")]
    pub pulse_length_m: f64,
    /// How many echoes of a beam are reported at most, the strongest first choice; 1..=7.
    pub echoes: u8,
    /// Intensity of the echo of a white surface, met squarely at 1 m.
    #[serde(with = "checked::NonNegative")]
    pub intensity_at_1_m: f64,
    /// Whether the errors below act.
    pub noise: Switch,
    /// The errors of ranges.
    pub errors: LidarErrorsSpec,
}

/// How many rays stand for a beam.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Rays {
    /// One: no mixed pixels.
    Single,
    /// Seven over the beam's cross-section: mixed pixels at edges, several echoes.
    Divergent,
}

/// On or off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Switch {
    /// On.
    On,
    /// Off.
    Off,
}

/// The errors of a lidar's ranges.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LidarErrorsSpec {
    /// Noise, bias and resolution of any range.
    pub range: RangeNoiseSpec,
    /// Which echoes are too weak, and what weakness does to a range.
    pub detection: DetectionSpec,
    /// What grazing incidence does to a range.
    pub grazing: GrazingSpec,
    /// What glass does.
    pub glass: GlassSpec,
}

/// Noise, bias and resolution of a range.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RangeNoiseSpec {
    /// Standard deviation up to `near_m`, m.
    #[serde(with = "checked::NonNegative")]
    pub near_sigma_m: f64,
    /// Up to where it holds, m.
    #[serde(with = "checked::NonNegative")]
    pub near_m: f64,
    /// Standard deviation at `far_m`, to which it rises linearly, m.
    #[serde(with = "checked::NonNegative")]
    pub far_sigma_m: f64,
    /// Where that holds, m.
    #[serde(with = "checked::Positive")]
    pub far_m: f64,
    /// Standard deviation, over runs, of the bias that all ranges of a run share, m.
    #[serde(with = "checked::NonNegative")]
    pub bias_sigma_m: f64,
    /// What ranges are rounded to a multiple of, m; 0 for none.
    #[serde(with = "checked::NonNegative")]
    pub resolution_m: f64,
}

/// Which echoes are detected. The power of an echo is `reflectance cos(incidence) / range^2`, as of a surface that
/// scatters evenly and is wider than the beam; whether it passes the detector's threshold is logistic in its logarithm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DetectionSpec {
    /// Range at which half of the echoes of a white sheet (reflectance 0.9), met squarely, are detected, m.
    #[serde(with = "checked::Positive")]
    pub white_reach_m: f64,
    /// Change of the logarithm of the power over which the odds of detection change by e.
    #[serde(with = "checked::Positive")]
    pub softness: f64,
    /// How much too long the range of an echo at the threshold is, m; inversely proportional to power.
    #[serde(with = "checked::Finite")]
    pub weak_bias_m: f64,
}

/// What grazing incidence does to a range.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GrazingSpec {
    /// Incidence from which on ranges are biased, degrees from the normal.
    #[serde(with = "checked::NonNegative")]
    pub from_deg: f64,
    /// Bias at 90 degrees, m, to which it grows linearly in the cosine; negative for too short.
    #[serde(with = "checked::Finite")]
    pub bias_m: f64,
}

/// What a surface of glass does, beside weakening light by its material's transmission, there and back.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GlassSpec {
    /// Share of beams, met squarely, that come back from the glass itself; in proportion to the cosine of incidence.
    #[serde(with = "checked::Fraction")]
    pub echo: f64,
    /// How much farther what stands behind it seems, m: thickness times (refractive index - 1).
    #[serde(with = "checked::NonNegative")]
    pub delay_m: f64,
}

impl LidarSpec {
    /// Checks what concerns several fields.
    pub(super) fn check(&self, source: &Source) -> Result<(), SpecError> {
        let refuse = |key: &str, message: String| Err(SpecError::about(source, key, message));
        if !RATES_HZ.contains(&self.rate_hz) {
            let message =
                format!("{} scans a second; a lidar makes {} to {}", self.rate_hz, RATES_HZ.start(), RATES_HZ.end());
            return refuse("rate_hz", message);
        }
        if self.range_min_m >= self.range_max_m {
            let message = format!("range_min_m {} is not below range_max_m {}", self.range_min_m, self.range_max_m);
            return refuse("range_min_m", message);
        }
        let range = &self.errors.range;
        if range.near_m >= range.far_m {
            return refuse("near_m", format!("near_m {} is not below far_m {}", range.near_m, range.far_m));
        }
        if !(1..=7).contains(&self.echoes) {
            return refuse("echoes", format!("{} echoes a beam; a lidar reports 1 to 7", self.echoes));
        }
        if self.divergence_half_angle_mrad > 100.0 {
            let message = format!("a beam of {} mrad is no beam; 100 at most", self.divergence_half_angle_mrad);
            return refuse("divergence_half_angle_mrad", message);
        }
        if self.errors.grazing.from_deg >= 90.0 {
            return refuse("from_deg", "grazing incidence begins below 90 degrees".to_owned());
        }
        Ok(())
    }

    /// Checks how many beams a second there are, `beams` of them in a scan.
    pub(super) fn check_beams(&self, beams: usize, source: &Source) -> Result<(), SpecError> {
        let per_s = beams as f64 * self.rate_hz;
        if per_s <= MOST_BEAMS_PER_S {
            return Ok(());
        }
        let message = format!(
            "{beams} beams a scan at {} Hz are {per_s:.3e} beams a second; {MOST_BEAMS_PER_S:.0e} at most",
            self.rate_hz
        );
        Err(SpecError::about(source, "rate_hz", message))
    }

    /// The rays of each beam in turn, and the weight of each ray of a beam.
    ///
    /// A divergent beam is a Gaussian one of half angle `d` at 1/e^2: half of it in the axis, a twelfth in each of six
    /// rays at `d` about it. This rule has the beam's moments up to the fifth order (Stroud's E2 5-1: mean square of
    /// the radius d^2/2, of its square d^4/2).
    pub(super) fn rays_of(&self, beams: &[Beam]) -> (Vec<Vector>, &'static [f64]) {
        const TWELFTH: f64 = 1.0 / 12.0;
        if self.beam == Rays::Single {
            return (beams.iter().map(|beam| beam.direction_in_laser).collect(), &[1.0]);
        }
        let slope = (self.divergence_half_angle_mrad * 1e-3).tan();
        let rays = beams.iter().flat_map(|beam| {
            let axis = beam.direction_in_laser;
            // The plane z = 0 holds the axis of a planar lidar: one sideways direction lies in it.
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
