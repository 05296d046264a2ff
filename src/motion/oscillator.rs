//! Irregular oscillation: a sine wave whose amplitude and phase vary at random within a low band.

use super::jet::Jet;
use super::sines::{FrequencyBin, SineSum, SpectralLine, linear_bins};
use std::f64::consts::TAU;
use zsim_base::random::Stream;

/// Sinusoids in a band-limited noise: with random frequencies, six do not repeat visibly within a run.
const TERMS: usize = 6;

/// A random process of zero mean and unit variance, with power below a bandwidth only.
///
/// It is the sum of a few sinusoids of random phase. The band is divided into equal parts, and each sinusoid has a
/// random frequency in its part, so that the sum does not repeat within a run.
#[derive(Debug, Clone)]
pub(super) struct BandLimitedNoise(SineSum<1>);

impl BandLimitedNoise {
    /// A process with power from 0 to `bandwidth_hz`.
    pub fn new(bandwidth_hz: f64, stream: &mut Stream) -> Self {
        let bins = linear_bins((0.0, bandwidth_hz), TERMS, stream);
        let line = |bin: FrequencyBin| SpectralLine { cycles: bin.at, amplitudes: [bin.amplitude(1.0 / bandwidth_hz)] };
        Self(SineSum::new(bins.into_iter().map(line)))
    }

    /// The process at `t_s`.
    pub fn at(&self, t_s: f64) -> Jet {
        let [jet] = self.0.at(t_s);
        jet
    }
}

/// Random variation of an oscillation: standard deviations and bandwidth.
pub(super) struct Variation {
    /// Standard deviation of the relative amplitude, whose mean is 1.
    pub strength: f64,
    /// Standard deviation of the phase, rad.
    pub phase_rad: f64,
    /// Upper frequency limit of both variations, Hz.
    pub bandwidth_hz: f64,
}

/// A sinusoid whose amplitude and phase vary at random.
#[derive(Debug, Clone)]
pub(super) struct Oscillator {
    rate: f64,
    strength_spread: f64,
    strength: BandLimitedNoise,
    phase_spread: f64,
    phase: BandLimitedNoise,
}

impl Oscillator {
    /// An oscillator at `frequency_hz`.
    pub fn new(frequency_hz: f64, variation: &Variation, stream: &mut Stream) -> Self {
        let strength = BandLimitedNoise::new(variation.bandwidth_hz, stream);
        let phase = BandLimitedNoise::new(variation.bandwidth_hz, stream);
        Self {
            rate: TAU * frequency_hz,
            strength_spread: variation.strength,
            strength,
            phase_spread: variation.phase_rad,
            phase,
        }
    }

    /// Relative amplitude (about 1) and phase, rad, at `t_s`.
    pub fn at(&self, t_s: f64) -> (Jet, Jet) {
        let strength = Jet::constant(1.0) + self.strength.at(t_s) * self.strength_spread;
        (strength, Jet::linear(t_s, self.rate, 0.0) + self.phase.at(t_s) * self.phase_spread)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::random::Seed;

    #[test]
    fn band_limited_noise_has_unit_variance_and_stays_in_its_band() {
        let noise = BandLimitedNoise::new(0.5, &mut Seed(1).stream("wander"));
        // Over 5000 s the sinusoids are nearly orthogonal: the mean square is 1 within 1 %. The mean square of the
        // derivative is below that of a process with all power at the band edge, (2 pi 0.5)^2 = 9.87, and close to a
        // third of it.
        let jets: Vec<Jet> = (0..100_000).map(|k| noise.at(0.05 * f64::from(k))).collect();
        let mean = |component: fn(&Jet) -> f64| jets.iter().map(component).sum::<f64>() / jets.len() as f64;
        assert_relative_eq!(mean(|jet| jet.x), 0.0, epsilon = 0.03);
        assert_relative_eq!(mean(|jet| jet.x * jet.x), 1.0, epsilon = 0.02);
        assert_relative_eq!(mean(|jet| jet.d * jet.d), 9.87 / 3.0, max_relative = 0.25);
    }
}
