//! Engine vibration: harmonics of the engine speed.

use crate::jet::Jet;
use crate::oscillator::BandLimitedNoise;
use crate::sines::{SineSum, SpectralLine};
use nalgebra::Complex;
use rand::RngExt;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use zsim_base::random::Stream;
use zsim_base::spec::checked::{FiniteArray, NonNegative, Positive};

/// An engine at nearly constant speed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EngineSpec {
    /// Engine speed, rev/min.
    #[serde(with = "Positive")]
    pub speed_rpm: f64,
    /// Phase noise, turns rms, with power up to 0.5 Hz.
    #[serde(default, with = "NonNegative")]
    pub irregularity_turns: f64,
    /// The harmonics.
    pub orders: Vec<OrderSpec>,
}

/// A harmonic of the engine speed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OrderSpec {
    /// Cycles per revolution: 1 for imbalance; n / 2 for the firing of a four-stroke engine with n cylinders.
    #[serde(with = "Positive")]
    pub order: f64,
    /// Amplitude of acceleration forward, left and up, m/s^2.
    #[serde(with = "FiniteArray::<3>")]
    pub acceleration_m_per_s2: [f64; 3],
}

/// Vibration of a body by the engine.
pub(super) struct Engine {
    turns_per_s: f64,
    irregularity_turns: f64,
    phase_noise: BandLimitedNoise,
    /// Displacement forward, left and up, m, over the number of revolutions.
    shaking: SineSum<3>,
}

impl Engine {
    pub fn new(spec: &EngineSpec, stream: &mut Stream) -> Self {
        let turns_per_s = spec.speed_rpm / 60.0;
        let line = |order: &OrderSpec| {
            let square = (TAU * order.order * turns_per_s).powi(2);
            let phase = Complex::from_polar(1.0, TAU * stream.random::<f64>());
            SpectralLine { cycles: order.order, amplitudes: order.acceleration_m_per_s2.map(|a| phase * (a / square)) }
        };
        let shaking = SineSum::new(spec.orders.iter().map(line));
        let phase_noise = BandLimitedNoise::new(0.5, stream);
        Self { turns_per_s, irregularity_turns: spec.irregularity_turns, phase_noise, shaking }
    }

    /// Displacement forward, left and up, m.
    pub fn at(&self, t_s: f64) -> [Jet; 3] {
        let turns = Jet::linear(t_s, self.turns_per_s, 0.0) + self.phase_noise.at(t_s) * self.irregularity_turns;
        self.shaking.at(turns.x).map(|jet| jet.compose(turns))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::random::Seed;
    use zsim_base::signal::{Segments, power_density};

    #[test]
    fn harmonics_have_their_amplitude_at_multiples_of_the_engine_speed() {
        // 1500 rpm is 25 Hz: order 1 at 25 Hz, order 2 at 50 Hz; a sine of amplitude a has the power a^2 / 2.
        let order = |order, up| OrderSpec { order, acceleration_m_per_s2: [0.0, 0.0, up] };
        let orders = vec![order(1.0, 0.5), order(2.0, 2.0)];
        let spec = EngineSpec { speed_rpm: 1500.0, irregularity_turns: 0.0, orders };
        let engine = Engine::new(&spec, &mut Seed(1).stream("engine"));
        let up: Vec<f64> = (0..20_000).map(|k| engine.at(1e-3 * f64::from(k))[2].dd).collect();
        let spectrum = power_density(&up, 1000.0, Segments::hann(2000)).unwrap();
        assert_relative_eq!(spectrum.power_between(23.0, 27.0), 0.125, max_relative = 1e-3);
        assert_relative_eq!(spectrum.power_between(48.0, 52.0), 2.0, max_relative = 1e-3);
        assert_relative_eq!(spectrum.power_between(0.0, 501.0), 2.125, max_relative = 1e-3);
    }
}
