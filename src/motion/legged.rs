//! A legged robot that follows a route; each stride moves the body periodically.

use super::jet::{Jet, PoseJet};
use super::oscillator::BandLimitedNoise;
use super::sines::{SineSum, SpectralLine};
use super::walk::{RouteMotion, WalkSpec};
use super::{BaseMotion, MotionError};
use nalgebra::Complex;
use serde::{Deserialize, Serialize};
use zsim_base::geometry::{Kinematics, Route};
use zsim_base::random::Seed;
use zsim_base::spec::Source;
use zsim_base::spec::checked::{Finite, FiniteArray, NonNegative, Positive};

/// A legged robot that carries the base.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LeggedSpec {
    /// Time at rest at the start, s.
    #[serde(default = "crate::usual::still_s", with = "NonNegative")]
    pub still_s: f64,
    /// Height of the base above the floor, m.
    #[serde(with = "Finite")]
    pub height_m: f64,
    /// How the robot follows the route.
    pub follow: WalkSpec,
    /// Stride frequency, Hz. A stride is one full cycle of all legs.
    #[serde(with = "Positive")]
    pub stride_hz: f64,
    /// Phase noise of the strides, turns rms, with power up to a tenth of the stride frequency.
    #[serde(default, with = "NonNegative")]
    pub irregularity_turns: f64,
    /// Harmonics of the body motion in a stride. Their amplitudes apply at full speed and scale with the speed.
    #[serde(default)]
    pub harmonics: Vec<StrideSpec>,
}

/// A harmonic of a stride: the body moves by `amplitude cos(2 pi order strides + phase)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StrideSpec {
    /// Cycles per stride: 2 for the bounce of a trot, 4 for a walk on four legs.
    #[serde(with = "Positive")]
    pub order: f64,
    /// Amplitudes forward, left and up, m.
    #[serde(default, with = "FiniteArray::<3>")]
    pub position_m: [f64; 3],
    /// Phases of these amplitudes, degrees.
    #[serde(default, with = "FiniteArray::<3>")]
    pub position_phase_deg: [f64; 3],
    /// Amplitudes of roll, pitch and yaw, degrees.
    #[serde(default, with = "FiniteArray::<3>")]
    pub rotation_deg: [f64; 3],
    /// Phases of these amplitudes, degrees.
    #[serde(default, with = "FiniteArray::<3>")]
    pub rotation_phase_deg: [f64; 3],
}

impl StrideSpec {
    fn line(&self) -> SpectralLine<6> {
        let amplitude = |size: f64, phase_deg: f64| Complex::from_polar(size, phase_deg.to_radians());
        let amplitudes = std::array::from_fn(|k| match k {
            0..3 => amplitude(self.position_m[k], self.position_phase_deg[k]),
            _ => amplitude(self.rotation_deg[k - 3].to_radians(), self.rotation_phase_deg[k - 3]),
        });
        SpectralLine { cycles: self.order, amplitudes }
    }
}

/// Motion of a legged robot.
pub(super) struct Legged {
    walk: RouteMotion,
    height_m: f64,
    stride_hz: f64,
    irregularity_turns: f64,
    phase_noise: BandLimitedNoise,
    /// Offsets forward, left, up, in roll, pitch and yaw, over the number of strides.
    stride: SineSum<6>,
}

impl Legged {
    pub fn new(
        spec: &LeggedSpec,
        source: &Source,
        route: Option<&Route>,
        duration_s: f64,
        seed: Seed,
    ) -> Result<Self, MotionError> {
        spec.follow.check(source)?;
        let route = route.ok_or_else(|| MotionError::NoRoute { motion: source.name.clone() })?;
        Ok(Self {
            walk: spec.follow.along(route, spec.still_s, duration_s)?,
            height_m: spec.height_m,
            stride_hz: spec.stride_hz,
            irregularity_turns: spec.irregularity_turns,
            phase_noise: BandLimitedNoise::new(spec.stride_hz / 10.0, &mut seed.stream("motion/legged/stride")),
            stride: SineSum::new(spec.harmonics.iter().map(StrideSpec::line)),
        })
    }
}

impl BaseMotion for Legged {
    fn at(&self, t_s: f64) -> Kinematics {
        let mut position = self.walk.path.at(t_s);
        let heading = self.walk.heading.at(t_s);
        let fraction = self.walk.speed_fraction.at(t_s);
        let strides = Jet::linear(t_s, self.stride_hz, 0.0) + self.phase_noise.at(t_s) * self.irregularity_turns;
        let [ahead, left, up, roll, pitch, yaw] = self.stride.at(strides.x).map(|jet| jet.compose(strides) * fraction);
        let (sin, cos) = heading.sin_cos();
        position[0] += ahead * cos - left * sin;
        position[1] += ahead * sin + left * cos;
        position[2] += up + Jet::constant(self.height_m);
        PoseJet { position, roll, pitch, yaw: heading + yaw }.kinematics()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{MotionSpec, load};
    use approx::assert_relative_eq;
    use zsim_base::geometry::Vector;
    use zsim_base::signal::{Segments, power_density};

    #[test]
    fn a_trot_bounces_twice_a_stride() {
        let (spec, source) = load("legged").unwrap();
        let MotionSpec::Legged(mut spec) = spec else { panic!("legged.ron is not a legged motion") };
        spec.irregularity_turns = 0.0;
        let straight = Route { points_in_world: vec![Vector::zeros(), Vector::x() * 500.0], closed: false };
        let machine = Legged::new(&spec, &source, Some(&straight), 60.0, Seed(1)).unwrap();
        let height: Vec<f64> =
            (0..5000).map(|k| machine.at(10.0 + 0.01 * f64::from(k)).world_from_body.translation.z).collect();
        let spectrum = power_density(&height, 100.0, Segments::hann(1000)).unwrap();
        let trot = &spec.harmonics[1];
        assert_eq!(trot.order, 2.0);
        let near = spec.stride_hz * 2.0;
        // A cosine of amplitude a has the power a^2 / 2.
        assert_relative_eq!(
            spectrum.power_between(near - 0.3, near + 0.3),
            trot.position_m[2].powi(2) / 2.0,
            max_relative = 1e-3
        );
    }
}
