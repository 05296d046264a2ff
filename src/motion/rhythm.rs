//! Irregular rhythms: band-limited random processes as sums of few sinusoids.

use super::jet::Jet;
use super::sines::{Line, Part, Sines, even_parts};
use crate::random::Stream;
use std::f64::consts::TAU;

/// Sinusoids in a wander.
const TERMS: usize = 6;

/// A random process of zero mean and unit variance, with power below a bandwidth alone: few sinusoids of random phase,
/// one frequency drawn in each of as many equal parts of the band, so that it does not repeat within a run.
#[derive(Debug, Clone)]
pub(super) struct Wander(Sines<1>);

impl Wander {
    /// A process with power up to `bandwidth_hz`.
    pub fn new(bandwidth_hz: f64, stream: &mut Stream) -> Self {
        let parts = even_parts((0.0, bandwidth_hz), TERMS, stream);
        let line = |part: Part| Line { cycles: part.at, amplitudes: [part.amplitude(1.0 / bandwidth_hz)] };
        Self(Sines::new(parts.into_iter().map(line)))
    }

    /// The process at an instant.
    pub fn at(&self, t_s: f64) -> Jet {
        let [jet] = self.0.at(t_s);
        jet
    }
}

/// A carrier whose strength and phase wander.
#[derive(Debug, Clone)]
pub(super) struct Rhythm {
    rate: f64,
    strength_spread: f64,
    strength: Wander,
    phase_spread: f64,
    phase: Wander,
}

impl Rhythm {
    /// A carrier at `frequency_hz` whose strength, 1 on average, has the standard deviation `strength_spread`, and
    /// whose phase wanders by `phase_spread` radians rms, both with power up to `bandwidth_hz`.
    pub fn new(frequency_hz: f64, spreads: (f64, f64), bandwidth_hz: f64, stream: &mut Stream) -> Self {
        let (strength_spread, phase_spread) = spreads;
        let strength = Wander::new(bandwidth_hz, stream);
        let phase = Wander::new(bandwidth_hz, stream);
        Self { rate: TAU * frequency_hz, strength_spread, strength, phase_spread, phase }
    }

    /// Strength (about 1) and phase, rad, at an instant.
    pub fn at(&self, t_s: f64) -> (Jet, Jet) {
        let strength = Jet::constant(1.0) + self.strength.at(t_s) * self.strength_spread;
        (strength, Jet::linear(t_s, self.rate, 0.0) + self.phase.at(t_s) * self.phase_spread)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Seed;
    use approx::assert_relative_eq;

    #[test]
    fn a_wander_has_unit_variance_and_stays_in_its_band() {
        let wander = Wander::new(0.5, &mut Seed(1).stream("wander"));
        // Over 5000 s the sinusoids are near orthogonal: the mean square is 1 to a per cent. The mean square of the
        // derivative is below that of all power at the band's edge, (2 pi 0.5)^2 = 9.87, and near a third of it.
        let jets: Vec<Jet> = (0..100_000).map(|k| wander.at(0.05 * f64::from(k))).collect();
        let mean = |of: fn(&Jet) -> f64| jets.iter().map(of).sum::<f64>() / jets.len() as f64;
        assert_relative_eq!(mean(|jet| jet.x), 0.0, epsilon = 0.03);
        assert_relative_eq!(mean(|jet| jet.x * jet.x), 1.0, epsilon = 0.02);
        assert_relative_eq!(mean(|jet| jet.d * jet.d), 9.87 / 3.0, max_relative = 0.25);
    }
}
