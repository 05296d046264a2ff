//! Rotor vibration: each rotor has a different speed, an imbalance, and a blade-pass oscillation.

use crate::jet::Jet;
use crate::sines::{SineSum, SpectralLine};
use nalgebra::Complex;
use rand::RngExt;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use zsim_base::random::Stream;
use zsim_base::spec::checked::{NonNegative, Positive};

/// Rotors of a multirotor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotorSpec {
    /// Number of rotors, up to 255.
    pub count: u8,
    /// Mean rotor speed, revolutions/s.
    #[serde(with = "Positive")]
    pub speed_hz: f64,
    /// Maximum deviation of a rotor's speed from the mean, as a fraction of it; uniformly distributed.
    #[serde(default, with = "zsim_base::spec::checked::Fraction")]
    pub speed_spread: f64,
    /// Blades per rotor.
    pub blades: u8,
    /// Acceleration of the craft due to the imbalance of one rotor, rotating in the horizontal plane, m/s^2.
    #[serde(with = "NonNegative")]
    pub imbalance_m_per_s2: f64,
    /// Vertical acceleration of the craft at the blade-pass frequency of one rotor, amplitude, m/s^2.
    #[serde(with = "NonNegative")]
    pub beat_m_per_s2: f64,
}

/// Vibration of the craft by the rotors.
pub(super) struct Rotors(SineSum<3>);

impl Rotors {
    pub fn new(spec: &RotorSpec, stream: &mut Stream) -> Self {
        let mut lines = Vec::new();
        for rotor in 0..spec.count {
            let spread = spec.speed_spread * (2.0 * stream.random::<f64>() - 1.0);
            let speed_hz = spec.speed_hz * (1.0 + spread);
            let mut phase = || Complex::from_polar(1.0, TAU * stream.random::<f64>());
            let displacement = |acceleration: f64, freq_hz: f64| -acceleration / (TAU * freq_hz).powi(2);
            let circle = phase() * displacement(spec.imbalance_m_per_s2, speed_hz);
            // Neighbouring rotors turn in opposite directions.
            let quarter = Complex::new(0.0, if rotor.is_multiple_of(2) { -1.0 } else { 1.0 });
            lines.push(SpectralLine { cycles: speed_hz, amplitudes: [circle, circle * quarter, Complex::default()] });
            let beating_hz = speed_hz * f64::from(spec.blades.max(1));
            let beat = phase() * displacement(spec.beat_m_per_s2, beating_hz);
            lines.push(SpectralLine { cycles: beating_hz, amplitudes: [Complex::default(), Complex::default(), beat] });
        }
        Self(SineSum::new(lines))
    }

    /// Displacement forward, left and up, m.
    pub fn at(&self, t_s: f64) -> [Jet; 3] {
        self.0.at(t_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::random::Seed;

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
        // With two blades the frequency is 180 Hz, so z'' = -(2 pi 180)^2 z.
        let [_, _, z] = samples[7];
        assert_relative_eq!(z.dd, -(TAU * 180.0).powi(2) * z.x, epsilon = 1e-9);
    }
}
