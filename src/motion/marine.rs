//! A small vessel in waves.
//!
//! The sea is a sum of plane waves in deep water (`w^2 = g k`) with a JONSWAP spectrum; a peakedness of 1 gives the
//! Pierson-Moskowitz spectrum. The vessel follows waves that are long compared with the hull. Heave, pitch and roll are
//! the height and the slopes of the surface, averaged over the waterplane and attenuated with draught; roll also has
//! a resonance. Surge and sway are the displacement of the water.

use super::jet::{Jet, PoseJet};
use super::sines::{FrequencyBin, SineSum, SpectralLine, log_bins};
use super::smooth::SmoothSteps;
use super::stand::start_on_route;
use super::{BaseMotion, MotionError};
use nalgebra::Complex;
use rand::RngExt;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, TAU};
use zsim_base::geometry::{Kinematics, Pose, Route, STANDARD_GRAVITY_M_PER_S2};
use zsim_base::random::{Seed, Stream};
use zsim_base::spec::checked::{Finite, FiniteArray, NonNegative, Positive};
use zsim_base::spec::{Source, SpecError};

/// A vessel in waves that carries the base.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MarineSpec {
    /// Time at rest at the start, s.
    #[serde(default = "crate::usual::still_s", with = "NonNegative")]
    pub still_s: f64,
    /// Time in which the waves rise to their full height, s.
    #[serde(default = "crate::usual::onset_s", with = "Positive")]
    pub onset_s: f64,
    /// Position of the base relative to the centre of the waterplane: forward, left, up, m.
    #[serde(default, with = "FiniteArray::<3>")]
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
    /// Period of the spectral peak, s.
    #[serde(with = "Positive")]
    pub peak_period_s: f64,
    /// JONSWAP peak enhancement factor: 3.3 in a growing wind sea, 1 in a fully developed sea (Pierson-Moskowitz).
    #[serde(default = "crate::usual::peakedness", with = "Positive")]
    pub peakedness: f64,
    /// Mean direction of propagation relative to the bow, degrees to the left: 0 for waves from astern, 180 for head
    /// seas.
    #[serde(default, with = "Finite")]
    pub going_deg: f64,
    /// Exponent s of the directional spreading `cos^2s`. A larger value gives longer crests.
    #[serde(with = "NonNegative")]
    pub spreading: f64,
}

/// Hull dimensions and roll dynamics of a vessel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HullSpec {
    /// Length of the waterplane, m.
    #[serde(with = "NonNegative")]
    pub length_m: f64,
    /// Breadth of the waterplane, m.
    #[serde(with = "NonNegative")]
    pub beam_m: f64,
    /// Draught, m.
    #[serde(with = "NonNegative")]
    pub draught_m: f64,
    /// Natural period of roll, s.
    #[serde(with = "Positive")]
    pub roll_period_s: f64,
    /// Damping ratio of roll.
    #[serde(with = "Positive")]
    pub roll_damping: f64,
}

/// Plane waves in a sea.
const WAVES: usize = 200;

impl SeaSpec {
    /// Checks that the values are within the range of the formulas.
    fn check(&self, source: &Source) -> Result<(), SpecError> {
        if !(1.0..=7.0).contains(&self.peakedness) {
            let message = format!("JONSWAP's peakedness must be from 1 to 7 (DNV-RP-C205), not {}", self.peakedness);
            return Err(SpecError::about(source, "peakedness", message));
        }
        if self.spreading > 1000.0 {
            let message = format!("the spreading exponent s of cos^2s can be up to 1000, not {}", self.spreading);
            return Err(SpecError::about(source, "spreading", message));
        }
        Ok(())
    }

    /// One-sided spectral density of the surface height at `freq_hz`, m^2/Hz.
    ///
    /// `S(f) = A 5/16 Hs^2 fp^4 f^-5 exp(-5/4 (f/fp)^-4) G^b` with `b = exp(-(f/fp - 1)^2 / (2 s^2))`, s = 0.07 below
    /// the peak and 0.09 above, and `A = 1 - 0.287 ln G` (DNV-RP-C205, section 3.5.5, given there over the angular
    /// frequency).
    pub(super) fn density(&self, freq_hz: f64) -> f64 {
        let r = freq_hz * self.peak_period_s;
        let width = if r <= 1.0 { 0.07 } else { 0.09 };
        let peak = self.peakedness.powf((-0.5 * ((r - 1.0) / width).powi(2)).exp());
        let normalisation = 1.0 - 0.287 * self.peakedness.ln();
        let moskowitz = 0.3125 * self.significant_height_m.powi(2) * self.peak_period_s * r.powi(-5);
        normalisation * moskowitz * (-1.25 * r.powi(-4)).exp() * peak
    }

    /// Plane waves from 0.5 to 5 times the peak frequency.
    fn waves(&self, stream: &mut Stream) -> Vec<PlaneWave> {
        let peak_hz = 1.0 / self.peak_period_s;
        let bins = log_bins((0.5 * peak_hz, 5.0 * peak_hz), WAVES, stream);
        let mean = self.going_deg.to_radians();
        let wave = |bin: &FrequencyBin| PlaneWave {
            freq_hz: bin.at,
            height_m: bin.amplitude(self.density(bin.at)),
            direction_rad: mean + self.draw_spreading(stream),
        };
        bins.iter().map(wave).collect()
    }

    /// Draws a deviation from the mean direction, rad, distributed as `cos^2s`, by rejection.
    fn draw_spreading(&self, stream: &mut Stream) -> f64 {
        loop {
            let angle = FRAC_PI_2 * (2.0 * stream.random::<f64>() - 1.0);
            if stream.random::<f64>() < angle.cos().powf(2.0 * self.spreading) {
                return angle;
            }
        }
    }
}

/// A plane wave of the sea.
struct PlaneWave {
    freq_hz: f64,
    /// Complex amplitude of the height, m.
    height_m: Complex<f64>,
    /// Direction in which the wave travels, rad.
    direction_rad: f64,
}

impl HullSpec {
    /// Response of the hull to a plane wave: surge, sway, heave (m), roll and pitch (rad).
    ///
    /// For the height `Re(a exp(i w t - i k (x cos d + y sin d)))` the slopes forward and to the left are
    /// `-i k cos d a` and `-i k sin d a`, and the displacement of the water is `-i a` along the wave. A slope that
    /// rises forward lifts the bow: pitch is the negative. A slope that rises to the left lifts the left side: roll
    /// equals it.
    fn wave_response(&self, wave: &PlaneWave) -> SpectralLine<5> {
        let PlaneWave { freq_hz, height_m, direction_rad } = *wave;
        let rate = TAU * freq_hz;
        let k = rate * rate / STANDARD_GRAVITY_M_PER_S2;
        let (sin, cos) = direction_rad.sin_cos();
        let averaging = sinc(0.5 * k * self.length_m * cos) * sinc(0.5 * k * self.beam_m * sin);
        let effective = height_m * (averaging * (-k * self.draught_m).exp());
        let r = freq_hz * self.roll_period_s;
        let resonance = Complex::new(1.0 - r * r, 2.0 * self.roll_damping * r).inv();
        let quarter = Complex::new(0.0, -1.0);
        let amplitudes = [
            effective * quarter * cos,
            effective * quarter * sin,
            effective,
            effective * quarter * (k * sin) * resonance,
            -effective * quarter * (k * cos),
        ];
        SpectralLine { cycles: freq_hz, amplitudes }
    }
}

fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-6 { 1.0 } else { x.sin() / x }
}

/// Motion of a vessel in waves.
pub(super) struct Marine {
    rest: PoseJet,
    start_s: f64,
    onset: SmoothSteps,
    /// Surge, sway, heave, roll and pitch.
    waves: SineSum<5>,
    waterplane_from_base: Pose,
}

impl Marine {
    pub fn new(spec: &MarineSpec, source: &Source, route: Option<&Route>, seed: Seed) -> Result<Self, MotionError> {
        spec.sea.check(source)?;
        let (water, heading) = start_on_route(route);
        let waves = spec.sea.waves(&mut seed.stream("motion/marine/sea"));
        let mut onset = SmoothSteps::from_level(0.0);
        onset.push(spec.still_s + spec.onset_s / 2.0, spec.onset_s / 2.0, 1.0);
        let [x, y, z] = spec.base_m;
        Ok(Self {
            rest: PoseJet::at_rest(&water, heading),
            start_s: spec.still_s,
            onset,
            waves: SineSum::new(waves.iter().map(|wave| spec.hull.wave_response(wave))),
            waterplane_from_base: Pose::translation(x, y, z),
        })
    }
}

impl BaseMotion for Marine {
    fn at(&self, t_s: f64) -> Kinematics {
        let mut pose = self.rest;
        if t_s > self.start_s {
            let fraction: Jet = self.onset.at(t_s);
            let [surge, sway, heave, roll, pitch] = self.waves.at(t_s).map(|jet| jet * fraction);
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
    use approx::assert_relative_eq;
    use zsim_base::signal::{Segments, power_density};

    fn sea(peakedness: f64) -> SeaSpec {
        SeaSpec { significant_height_m: 2.0, peak_period_s: 8.0, peakedness, going_deg: 0.0, spreading: 50.0 }
    }

    /// A raft so small that it moves with the water.
    const RAFT: HullSpec =
        HullSpec { length_m: 0.0, beam_m: 0.0, draught_m: 0.0, roll_period_s: 1e-3, roll_damping: 1.0 };

    #[test]
    fn moskowitz_has_its_published_form() {
        // S(w) = 5/16 Hs^2 wp^4 w^-5 exp(-5/4 (w/wp)^-4) (DNV-RP-C205, 3.5.5.1), S(f) = 2 pi S(w).
        let f = 0.16;
        let (w, wp) = (TAU * f, TAU / 8.0);
        let expected = TAU * 5.0 / 16.0 * 4.0 * wp.powi(4) * w.powi(-5) * (-1.25 * (w / wp).powi(-4)).exp();
        assert_relative_eq!(sea(1.0).density(f), expected, max_relative = 1e-12);
        // At the peak JONSWAP is higher by the peakedness times the normalisation.
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
            // Hs = 4 sqrt(m0). The normalisation of JONSWAP is a fit, good to 1 or 2 %.
            assert_relative_eq!(4.0 * spectrum.power_between(0.0, 1.1).sqrt(), 2.0, max_relative = 0.02);
            // Compares bands of a fifth of the peak frequency, with several waves each, with the integral of the
            // formula.
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
    fn a_raft_follows_the_surface_of_a_wave_from_astern() {
        // One wave of 100 m from astern, amplitude 1 m: when the surface rises, the crest is astern and the bow is
        // down.
        let k = TAU / 100.0;
        let freq_hz = (STANDARD_GRAVITY_M_PER_S2 * k).sqrt() / TAU;
        let wave = PlaneWave { freq_hz, height_m: Complex::new(1.0, 0.0), direction_rad: 0.0 };
        let line = RAFT.wave_response(&wave);
        // A quarter of a period before the crest: exp(-i pi / 2).
        let rising = Complex::new(0.0, -1.0);
        let [surge, sway, heave, roll, pitch] = line.amplitudes.map(|a| (a * rising).re);
        assert_relative_eq!(heave, 0.0, epsilon = 1e-12);
        assert_relative_eq!(pitch, k, epsilon = 1e-12);
        assert_relative_eq!(surge, -1.0, epsilon = 1e-12);
        assert_eq!((sway.abs() < 1e-12, roll.abs() < 1e-12), (true, true));
        // A long hull averages the wave: half a wavelength along 50 m leaves 2/pi of heave and pitch.
        let ship = HullSpec { length_m: 50.0, ..RAFT };
        let heave = ship.wave_response(&wave).amplitudes[2].re;
        assert_relative_eq!(heave, std::f64::consts::FRAC_2_PI, epsilon = 1e-9);
    }
}
