//! A small vessel in waves.
//!
//! The sea is a sum of plane waves in deep water (`w^2 = g k`), with a JONSWAP spectrum; a peakedness of 1 makes it the
//! one of Pierson and Moskowitz. The vessel follows the waves that are long against it, and the shorter the less:
//! heave, pitch and roll are the surface's height and slopes averaged over its waterplane and taken off with depth,
//! roll besides with its own resonance; surge and sway are those of the water.

use super::jet::{Jet, PoseJet};
use super::sines::{Line, Part, Sines, geometric_parts};
use super::smooth::Steps;
use super::stand::standpoint;
use super::{BaseMotion, MotionError};
use crate::geometry::{Kinematics, Pose, Route, STANDARD_GRAVITY_M_PER_S2};
use crate::random::{Seed, Stream};
use crate::spec::checked::{Finite, FiniteArray, NonNegative, Positive};
use crate::spec::{Source, SpecError};
use nalgebra::Complex;
use rand::RngExt;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, TAU};

/// A vessel that lies in waves and carries the base.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MarineSpec {
    /// How long everything is at rest first, s.
    #[serde(with = "NonNegative")]
    pub still_s: f64,
    /// How long the waves take to reach their full height, s.
    #[serde(with = "Positive")]
    pub onset_s: f64,
    /// Where the base is, from the middle of the waterplane: forward, to the left, up, m.
    #[serde(with = "FiniteArray::<3>")]
    pub base_m: [f64; 3],
    /// The waves.
    pub sea: SeaSpec,
    /// The vessel.
    pub hull: HullSpec,
}

/// A random sea.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SeaSpec {
    /// Significant wave height, m: four times the standard deviation of the surface.
    #[serde(with = "Positive")]
    pub significant_height_m: f64,
    /// Period of the spectrum's peak, s.
    #[serde(with = "Positive")]
    pub peak_period_s: f64,
    /// JONSWAP's peak enhancement: 3.3 in a growing wind sea, 1 for Pierson and Moskowitz's fully developed one.
    #[serde(with = "Positive")]
    pub peakedness: f64,
    /// Where the waves go to, against the bow, degrees to the left: 0 from astern, 180 on the bow.
    #[serde(with = "Finite")]
    pub going_deg: f64,
    /// The exponent s of the spreading `cos^2s` of single waves about that direction.
    #[serde(with = "NonNegative")]
    pub spreading: f64,
}

/// A vessel's shape, and its roll.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HullSpec {
    /// Length of the waterplane, m.
    #[serde(with = "NonNegative")]
    pub length_m: f64,
    /// Its breadth, m.
    #[serde(with = "NonNegative")]
    pub beam_m: f64,
    /// How deep it lies, m.
    #[serde(with = "NonNegative")]
    pub draught_m: f64,
    /// Natural period of roll, s.
    #[serde(with = "Positive")]
    pub roll_period_s: f64,
    /// Damping ratio of roll.
    #[serde(with = "Positive")]
    pub roll_damping: f64,
}

/// Waves in a sea.
const WAVES: usize = 200;

impl SeaSpec {
    /// Checks what the formulas are made for.
    fn check(&self, source: &Source) -> Result<(), SpecError> {
        if !(1.0..=7.0).contains(&self.peakedness) {
            let message = format!("JONSWAP's peakedness lies from 1 to 7 (DNV-RP-C205), not at {}", self.peakedness);
            return Err(SpecError::about(source, "peakedness", message));
        }
        if self.spreading > 1000.0 {
            let message = format!("waves spread as cos^2s with s up to 1000, not {}", self.spreading);
            return Err(SpecError::about(source, "spreading", message));
        }
        Ok(())
    }

    /// The one-sided density of the surface's height at `freq_hz`, m^2/Hz: `S(f) = A 5/16 Hs^2 fp^4 f^-5
    /// exp(-5/4 (f/fp)^-4) G^b` with `b = exp(-(f/fp - 1)^2 / (2 s^2))`, s = 0.07 below the peak and 0.09 above, and
    /// `A = 1 - 0.287 ln G` (DNV-RP-C205, section 3.5.5, there over the angular frequency).
    pub(super) fn density(&self, freq_hz: f64) -> f64 {
        let r = freq_hz * self.peak_period_s;
        let width = if r <= 1.0 { 0.07 } else { 0.09 };
        let peak = self.peakedness.powf((-0.5 * ((r - 1.0) / width).powi(2)).exp());
        let share = 1.0 - 0.287 * self.peakedness.ln();
        let moskowitz = 0.3125 * self.significant_height_m.powi(2) * self.peak_period_s * r.powi(-5);
        share * moskowitz * (-1.25 * r.powi(-4)).exp() * peak
    }

    /// Plane waves from half to five times the peak's frequency: frequency, complex amplitude, direction (rad).
    fn waves(&self, stream: &mut Stream) -> Vec<(f64, Complex<f64>, f64)> {
        let peak_hz = 1.0 / self.peak_period_s;
        let parts = geometric_parts((0.5 * peak_hz, 5.0 * peak_hz), WAVES, stream);
        let mean = self.going_deg.to_radians();
        let wave = |part: &Part| (part.at, part.amplitude(self.density(part.at)), mean + self.deviation(stream));
        parts.iter().map(wave).collect()
    }

    /// A direction drawn from `cos^2s` on either side of the mean, by rejection.
    fn deviation(&self, stream: &mut Stream) -> f64 {
        loop {
            let angle = FRAC_PI_2 * (2.0 * stream.random::<f64>() - 1.0);
            if stream.random::<f64>() < angle.cos().powf(2.0 * self.spreading) {
                return angle;
            }
        }
    }
}

impl HullSpec {
    /// How the hull follows a plane wave: surge, sway, heave (m), roll and pitch (rad).
    ///
    /// With the height `Re(a exp(i w t - i k (x cos d + y sin d)))` the slopes forward and to the left are `-i k cos d
    /// a` and `-i k sin d a`, and the water's own displacement is `-i a` along the wave. A slope up forward lifts the
    /// bow (pitch is its negative), one up to the left lifts that side (roll is it).
    fn follows(&self, (freq_hz, height, direction): (f64, Complex<f64>, f64)) -> Line<5> {
        let rate = TAU * freq_hz;
        let k = rate * rate / STANDARD_GRAVITY_M_PER_S2;
        let (sin, cos) = direction.sin_cos();
        let averaged = sinc(0.5 * k * self.length_m * cos) * sinc(0.5 * k * self.beam_m * sin);
        let felt = height * (averaged * (-k * self.draught_m).exp());
        let r = freq_hz * self.roll_period_s;
        let resonance = Complex::new(1.0 - r * r, 2.0 * self.roll_damping * r).inv();
        let quarter = Complex::new(0.0, -1.0);
        let amplitudes = [
            felt * quarter * cos,
            felt * quarter * sin,
            felt,
            felt * quarter * (k * sin) * resonance,
            -felt * quarter * (k * cos),
        ];
        Line { cycles: freq_hz, amplitudes }
    }
}

fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-6 { 1.0 } else { x.sin() / x }
}

/// A vessel that moves with the waves.
pub(super) struct Marine {
    rest: PoseJet,
    start_s: f64,
    onset: Steps,
    /// Surge, sway, heave, roll and pitch.
    waves: Sines<5>,
    waterplane_from_base: Pose,
}

impl Marine {
    pub fn new(spec: &MarineSpec, source: &Source, route: Option<&Route>, seed: Seed) -> Result<Self, MotionError> {
        spec.sea.check(source)?;
        let (water, heading) = standpoint(route);
        let waves = spec.sea.waves(&mut seed.stream("motion/marine/sea"));
        let mut onset = Steps::from_level(0.0);
        onset.push(spec.still_s + spec.onset_s / 2.0, spec.onset_s / 2.0, 1.0);
        let [x, y, z] = spec.base_m;
        Ok(Self {
            rest: PoseJet::at_rest(&water, heading),
            start_s: spec.still_s,
            onset,
            waves: Sines::new(waves.into_iter().map(|wave| spec.hull.follows(wave))),
            waterplane_from_base: Pose::translation(x, y, z),
        })
    }
}

impl BaseMotion for Marine {
    fn at(&self, t_s: f64) -> Kinematics {
        let mut pose = self.rest;
        if t_s > self.start_s {
            let share: Jet = self.onset.at(t_s);
            let [surge, sway, heave, roll, pitch] = self.waves.at(t_s).map(|jet| jet * share);
            let (sin, cos) = pose.yaw.x.sin_cos();
            pose.position[0] += surge * cos - sway * sin;
            pose.position[1] += surge * sin + sway * cos;
            pose.position[2] += heave;
            (pose.roll, pose.pitch) = (roll, pitch);
        }
        pose.kinematics().of_frame(&self.waterplane_from_base)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{Segments, power_density};
    use approx::assert_relative_eq;

    fn sea(peakedness: f64) -> SeaSpec {
        SeaSpec { significant_height_m: 2.0, peak_period_s: 8.0, peakedness, going_deg: 0.0, spreading: 50.0 }
    }

    /// A raft so small that it goes with the water.
    const RAFT: HullSpec =
        HullSpec { length_m: 0.0, beam_m: 0.0, draught_m: 0.0, roll_period_s: 1e-3, roll_damping: 1.0 };

    #[test]
    fn moskowitz_has_its_published_form() {
        // S(w) = 5/16 Hs^2 wp^4 w^-5 exp(-5/4 (w/wp)^-4) (DNV-RP-C205, 3.5.5.1), S(f) = 2 pi S(w).
        let f = 0.16;
        let (w, wp) = (TAU * f, TAU / 8.0);
        let expected = TAU * 5.0 / 16.0 * 4.0 * wp.powi(4) * w.powi(-5) * (-1.25 * (w / wp).powi(-4)).exp();
        assert_relative_eq!(sea(1.0).density(f), expected, max_relative = 1e-12);
        // At the peak JONSWAP is higher by the peakedness, times the normalising share.
        let ratio = sea(3.3).density(0.125) / sea(1.0).density(0.125);
        assert_relative_eq!(ratio, 3.3 * (1.0 - 0.287 * 3.3_f64.ln()), max_relative = 1e-12);
    }

    #[test]
    fn a_raft_heaves_with_the_spectrum_of_the_standard() {
        for peakedness in [1.0, 3.3] {
            let spec = MarineSpec { still_s: 0.0, onset_s: 1.0, base_m: [0.0; 3], sea: sea(peakedness), hull: RAFT };
            let raft = Marine::new(&spec, &Source::in_memory("raft", ""), None, Seed(2)).unwrap();
            let height: Vec<f64> =
                (0..40_000).map(|k| raft.at(10.0 + 0.5 * f64::from(k)).world_from_body.translation.z).collect();
            let spectrum = power_density(&height, 2.0, Segments::hann(2048)).unwrap();
            // Hs = 4 sqrt(m0): JONSWAP's share is a fit, good to a per cent or two.
            assert_relative_eq!(4.0 * spectrum.power_between(0.0, 1.1).sqrt(), 2.0, max_relative = 0.02);
            // Bands of a fifth of the peak's frequency, each of several waves, against the formula's integral.
            for band in 0..12 {
                let low = 0.1 + 0.025 * f64::from(band);
                let steps = 1000;
                let h = 0.025 / f64::from(steps);
                let expected: f64 = (0..steps).map(|k| spec.sea.density(low + h * (f64::from(k) + 0.5)) * h).sum();
                assert_relative_eq!(spectrum.power_between(low, low + 0.025), expected, max_relative = 0.25);
            }
        }
    }

    #[test]
    fn a_following_sea_lifts_the_stern_first_and_the_surface_is_followed() {
        // One wave of 100 m from astern, amplitude 1 m: when the surface rises the crest is behind, so the bow is down.
        let k = TAU / 100.0;
        let freq_hz = (STANDARD_GRAVITY_M_PER_S2 * k).sqrt() / TAU;
        let line = RAFT.follows((freq_hz, Complex::new(1.0, 0.0), 0.0));
        // A quarter of a period before the crest: exp(-i pi / 2).
        let rising = Complex::new(0.0, -1.0);
        let [surge, sway, heave, roll, pitch] = line.amplitudes.map(|a| (a * rising).re);
        assert_relative_eq!(heave, 0.0, epsilon = 1e-12);
        assert_relative_eq!(pitch, k, epsilon = 1e-12);
        assert_relative_eq!(surge, -1.0, epsilon = 1e-12);
        assert_eq!((sway.abs() < 1e-12, roll.abs() < 1e-12), (true, true));
        // A long hull averages the wave away: half a wave along 50 m leaves 2/pi, times pitch and heave alike.
        let ship = HullSpec { length_m: 50.0, ..RAFT };
        let heave = ship.follows((freq_hz, Complex::new(1.0, 0.0), 0.0)).amplitudes[2].re;
        assert_relative_eq!(heave, std::f64::consts::FRAC_2_PI, epsilon = 1e-9);
    }
}
