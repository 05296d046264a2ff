//! Road roughness after ISO 8608.
//!
//! The displacement density of a road of one class is `G_d(n) = G_d(n0) (n / n0)^-2` over the spatial frequency n, with
//! n0 = 0.1 cycles/m; the standard's classes A to E have the geometric means 16, 64, 256, 1024 and 4096 (x 1e-6 m^3) of
//! G_d(n0) (ISO 8608:2016, annex C). Two tracks of one road are alike in long waves and not in short ones: for a
//! surface whose statistics are the same in every direction the coherence between tracks b apart follows from the
//! density alone, `x K_1(x)` with `x = 2 pi n b` (Kamash and Robson 1978; Basset's integral of the two-dimensional
//! spectrum).

use crate::motion::sines::{Line, Part, geometric_parts};
use crate::random::Stream;

use nalgebra::Complex;
use rand::RngExt;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// How rough a road is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum RoadSpec {
    /// A class of ISO 8608.
    Class(RoadClass),
    /// Any other road, or floor.
    Roughness {
        /// The displacement density at 0.1 cycles/m, 1e-6 m^3.
        #[serde(with = "crate::spec::checked::NonNegative")]
        at_n0_1e6_m3: f64,
    },
}

/// The classes of ISO 8608, from very good to very poor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum RoadClass {
    /// A motorway in good repair.
    A,
    /// A good road.
    B,
    /// An average road.
    C,
    /// A poor road.
    D,
    /// A very poor road, or a track.
    E,
}

/// Spatial frequencies of a road, cycles/m: those that the standard covers.
const BAND_PER_M: (f64, f64) = (0.01, 10.0);

/// Sinusoids in a road: 80 a decade.
const LINES: usize = 240;

impl RoadSpec {
    /// The one-sided displacement density at `n` cycles/m, m^3.
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

    /// A random road of two tracks `track_m` apart: heights, m, of the left and the right one over the distance along
    /// it, m.
    ///
    /// Either track has the full power in every line; the right one's phase is ahead of the left one's, or behind, by
    /// the angle whose cosine is the coherence, so that the cross-spectrum is right too.
    pub(super) fn tracks(self, track_m: f64, stream: &mut Stream) -> Vec<Line<2>> {
        let parts = geometric_parts(BAND_PER_M, LINES, stream);
        let line = |part: &Part| {
            let left = part.amplitude(self.density(part.at));
            let apart = coherence(TAU * part.at * track_m).acos();
            let right = left * Complex::from_polar(1.0, if stream.random() { apart } else { -apart });
            Line { cycles: part.at, amplitudes: [left, right] }
        };
        parts.iter().map(line).collect()
    }
}

/// `x K_1(x)`, with the modified Bessel function as `K_1(x) = int_0^inf exp(-x cosh t) cosh t dt` by the trapezoid
/// rule, which converges faster than any power of the step for this integrand.
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
    use crate::motion::sines::Sines;
    use crate::random::Seed;
    use crate::signal::{Segments, power_density, transfer_function};
    use approx::assert_relative_eq;

    /// Heights of both tracks every 5 cm over 5 km, and how they are cut.
    fn heights(class: RoadClass) -> ([Vec<f64>; 2], Segments) {
        let road = Sines::new(RoadSpec::Class(class).tracks(1.5, &mut Seed(3).stream("road")));
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
        // The integral of G_d(n) = 256e-6 m^3 (n / 0.1)^-2, class C, over octaves. An octave has 24 sinusoids, and half
        // of one more or less.
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
    fn tracks_are_alike_in_long_waves_alone() {
        // The real part of the cross-spectrum over the left track's is x K_1(x): 0.98 at a wave of 90 m (x = 0.105),
        // 0.5 at 7.6 m (x = 1.24), under 0.01 at 1.5 m.
        let (tracks, segments) = heights(RoadClass::A);
        let points = transfer_function(&tracks[0], &tracks[1], 20.0, segments).unwrap();
        for (low, high) in [(0.03, 0.05), (0.1, 0.16), (0.2, 0.3), (0.5, 1.0)] {
            let near: Vec<_> = points.iter().filter(|point| (low..high).contains(&point.freq_hz)).collect();
            let power: f64 = near.iter().map(|point| point.input_density).sum();
            let told: f64 = near.iter().map(|point| point.response.re * point.input_density).sum::<f64>() / power;
            let expected: f64 =
                near.iter().map(|point| coherence(TAU * point.freq_hz * 1.5) * point.input_density).sum::<f64>()
                    / power;
            assert_relative_eq!(told, expected, epsilon = 0.05);
        }
    }
}
