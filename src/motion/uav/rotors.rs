//! Vibration by rotors: each turns at its own speed, unbalanced, its blades beating the air.

use crate::motion::jet::Jet;
use crate::motion::sines::{Line, Sines};
use crate::random::Stream;
use crate::spec::checked::{NonNegative, Positive};
use nalgebra::Complex;
use rand::RngExt;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Rotors of a craft.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotorSpec {
    /// How many, up to 255.
    pub count: u8,
    /// Their mean speed, turns/s.
    #[serde(with = "Positive")]
    pub speed_hz: f64,
    /// By how much their speeds differ, as a share of the mean, either way.
    #[serde(with = "crate::spec::checked::Fraction")]
    pub speed_spread: f64,
    /// Blades of a rotor.
    pub blades: u8,
    /// What the imbalance of one shakes the craft with: a circle in the level, m/s^2.
    #[serde(with = "NonNegative")]
    pub imbalance_m_per_s2: f64,
    /// What the blades of one beat the craft with, up and down, m/s^2.
    #[serde(with = "NonNegative")]
    pub beat_m_per_s2: f64,
}

/// Rotors that turn.
pub(super) struct Rotors(Sines<3>);

impl Rotors {
    pub fn new(spec: &RotorSpec, stream: &mut Stream) -> Self {
        let mut lines = Vec::new();
        for rotor in 0..spec.count {
            let spread = spec.speed_spread * (2.0 * stream.random::<f64>() - 1.0);
            let speed_hz = spec.speed_hz * (1.0 + spread);
            let mut phase = || Complex::from_polar(1.0, TAU * stream.random::<f64>());
            let displacement = |acceleration: f64, freq_hz: f64| -acceleration / (TAU * freq_hz).powi(2);
            let circle = phase() * displacement(spec.imbalance_m_per_s2, speed_hz);
            // Neighbours turn against each other: the circle's sense alternates.
            let quarter = Complex::new(0.0, if rotor.is_multiple_of(2) { -1.0 } else { 1.0 });
            lines.push(Line { cycles: speed_hz, amplitudes: [circle, circle * quarter, Complex::default()] });
            let beating_hz = speed_hz * f64::from(spec.blades.max(1));
            let beat = phase() * displacement(spec.beat_m_per_s2, beating_hz);
            lines.push(Line { cycles: beating_hz, amplitudes: [Complex::default(), Complex::default(), beat] });
        }
        Self(Sines::new(lines))
    }

    /// Displacement forward, to the left and up, m.
    pub fn at(&self, t_s: f64) -> [Jet; 3] {
        self.0.at(t_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Seed;
    use approx::assert_relative_eq;

    #[test]
    fn one_rotor_shakes_in_a_circle_and_its_blades_beat_upwards() {
        let spec = RotorSpec {
            count: 1,
            speed_hz: 90.0,
            speed_spread: 0.0,
            blades: 2,
            imbalance_m_per_s2: 3.0,
            beat_m_per_s2: 2.0,
        };
        let rotors = Rotors::new(&spec, &mut Seed(1).stream("rotors"));
        let samples: Vec<[Jet; 3]> = (0..1000).map(|k| rotors.at(1.234e-4 * f64::from(k))).collect();
        let mut beat: f64 = 0.0;
        for [x, y, z] in &samples {
            assert_relative_eq!(x.dd.hypot(y.dd), 3.0, epsilon = 1e-9);
            beat = beat.max(z.dd.abs());
        }
        assert_relative_eq!(beat, 2.0, epsilon = 0.01);
        // Two blades: 180 Hz, so that z'' = -(2 pi 180)^2 z.
        let [_, _, z] = samples[7];
        assert_relative_eq!(z.dd, -(TAU * 180.0).powi(2) * z.x, epsilon = 1e-9);
    }
}
