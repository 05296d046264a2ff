//! Road roughness after ISO 8608.
//!
//! The displacement density of a road is `G_d(n) = G_d(n0) (n / n0)^-2` over the spatial frequency n, with n0 = 0.1
//! cycles/m. The geometric means of G_d(n0) for the classes A to E are 16, 64, 256, 1024 and 4096 (x 1e-6 m^3) (ISO
//! 8608:2016, annex C). The two wheel tracks are correlated at long wavelengths only: for an isotropic surface the
//! coherence of tracks at a distance b is `x K_1(x)` with `x = 2 pi n b` (Kamash and Robson 1978; Basset's integral of
//! the two-dimensional spectrum).

use crate::sines::{FrequencyBin, SpectralLine, log_bins};
use zsim_base::random::Stream;

use nalgebra::Complex;
use rand::RngExt;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Road roughness.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum RoadSpec {
    /// A road class of ISO 8608.
    Class(RoadClass),
    /// Another road or floor, by roughness.
    Roughness {
        /// Displacement density at 0.1 cycles/m, 1e-6 m^3. A larger value is rougher.
        #[serde(with = "zsim_base::spec::checked::NonNegative")]
        at_n0_1e6_m3: f64,
    },
}

/// Road classes of ISO 8608, from very good to very poor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum RoadClass {
    /// Very good: a motorway in good repair.
    A,
    /// Good.
    B,
    /// Average.
    C,
    /// Poor.
    D,
    /// Very poor, or a track.
    E,
}

/// Range of spatial frequencies, cycles/m: the range of the standard.
const BAND_PER_M: (f64, f64) = (0.01, 10.0);

/// Sinusoids in a road: 80 per decade.
const LINES: usize = 240;

impl RoadSpec {
    /// One-sided displacement density at `n` cycles/m, m^3.
    pub(super) fn density(self, n_per_m: f64) -> f64 {
        let at_n0 = match self {
            RoadSpec::Class(RoadClass::A) => 16.0,
            RoadSpec::Class(RoadClass::B) => 64.0,
            RoadSpec::Class(RoadClass::C) => 256.0,
            RoadSpec::Class(RoadClass::D) => 1024.0,
            RoadSpec::Class(RoadClass::E) => 4096.0,
            RoadSpec::Roughness { at_n0_1e6_m3 } => at_n0_1e6_m3,
        };
        at_n0 * 1e-6 * (n_per_m / 0.1).powi(-2)
    }

    /// A random road with two wheel tracks `track_m` apart: heights of the left and the right track, m, over distance,
    /// m.
    ///
    /// Both tracks have the full power in every line. Their phase difference is plus or minus the angle whose cosine is
    /// the coherence, so that the expected cross-spectrum is correct.
    pub(super) fn tracks(self, track_m: f64, stream: &mut Stream) -> Vec<SpectralLine<2>> {
        let bins = log_bins(BAND_PER_M, LINES, stream);
        let line = |bin: &FrequencyBin| {
            let left = bin.amplitude(self.density(bin.at));
            let apart = coherence(TAU * bin.at * track_m).acos();
            let right = left * Complex::from_polar(1.0, if stream.random() { apart } else { -apart });
            SpectralLine { cycles: bin.at, amplitudes: [left, right] }
        };
        bins.iter().map(line).collect()
    }
}

/// The coherence `x K_1(x)`.
///
/// The modified Bessel function is `K_1(x) = int_0^inf exp(-x cosh t) cosh t dt`, by the trapezoidal rule, which
/// converges faster than any power of the step for this integrand.
fn coherence(x: f64) -> f64 {
    const STEP: f64 = 0.05;
    let term = |k: i32| {
        let cosh = (STEP * f64::from(k)).cosh();
        cosh * (-x * cosh).exp()
    };
    let sum: f64 = 0.5 * term(0) + (1..400).map(term).take_while(|term| *term > 0.0).sum::<f64>();
    (x * STEP * sum).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sines::SineSum;
    use approx::assert_relative_eq;
    use zsim_base::random::Seed;
    use zsim_base::signal::{Segments, power_density, transfer_function};

    /// Heights of both tracks every 5 cm over 5 km, and the segments of the spectral estimate.
    fn heights(class: RoadClass) -> ([Vec<f64>; 2], Segments) {
        let road = SineSum::new(RoadSpec::Class(class).tracks(1.5, &mut Seed(3).stream("road")));
        let samples: Vec<[f64; 2]> = (0..100_000).map(|k| road.at(0.05 * f64::from(k)).map(|jet| jet.x)).collect();
        ([0, 1].map(|track| samples.iter().map(|both| both[track]).collect()), Segments::hann(4096))
    }

    #[test]
    fn bessel_function_matches_its_table() {
        // Abramowitz & Stegun, table 9.8: x K_1(x) = 0.9955 at 0.1 (9.85384 * 0.1), 0.601907 at 1, 0.0202 at 5.
        assert_relative_eq!(coherence(0.1), 0.985_384, epsilon = 1e-5);
        assert_relative_eq!(coherence(1.0), 0.601_907, epsilon = 1e-6);
        assert_relative_eq!(coherence(5.0), 5.0 * 4.044_613e-3, epsilon = 1e-8);
        assert_relative_eq!(coherence(1e-4), 1.0, epsilon = 1e-6);
    }

    #[test]
    fn both_tracks_have_the_density_of_the_standard() {
        // The integral of G_d(n) = 256e-6 m^3 (n / 0.1)^-2, class C, over octaves. An octave has 24 sinusoids, give or
        // take half of one.
        let (tracks, segments) = heights(RoadClass::C);
        for track in tracks {
            let spectrum = power_density(&track, 20.0, segments).unwrap();
            for octave in 0..7 {
                let low = 0.06 * f64::from(1 << octave);
                let expected = 256e-6 * 0.1 * 0.1 * (1.0 / low - 0.5 / low);
                assert_relative_eq!(spectrum.power_between(low, 2.0 * low), expected, max_relative = 0.08);
            }
        }
    }

    #[test]
    fn the_tracks_are_coherent_at_long_wavelengths_only() {
        // The real part of the cross-spectrum over the spectrum of the left track is x K_1(x): 0.98 at a wavelength of
        // 90 m (x = 0.105), 0.5 at 7.6 m (x = 1.24), below 0.01 at 1.5 m.
        let (tracks, segments) = heights(RoadClass::A);
        let points = transfer_function(&tracks[0], &tracks[1], 20.0, segments).unwrap();
        for (low, high) in [(0.03, 0.05), (0.1, 0.16), (0.2, 0.3), (0.5, 1.0)] {
            let in_band: Vec<_> = points.iter().filter(|point| (low..high).contains(&point.freq_hz)).collect();
            let power: f64 = in_band.iter().map(|point| point.input_density).sum();
            let estimated: f64 =
                in_band.iter().map(|point| point.response.re * point.input_density).sum::<f64>() / power;
            let expected: f64 =
                in_band.iter().map(|point| coherence(TAU * point.freq_hz * 1.5) * point.input_density).sum::<f64>()
                    / power;
            assert_relative_eq!(estimated, expected, epsilon = 0.05);
        }
    }
}
