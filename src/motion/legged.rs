//! A legged machine: it follows the route, and every stride shakes its body in the same way, more or less.

use super::jet::{Jet, PoseJet};
use super::rhythm::Wander;
use super::sines::{Line, Sines};
use super::walk::{Walk, WalkSpec};
use super::{BaseMotion, MotionError};
use crate::geometry::{Kinematics, Route};
use crate::random::Seed;
use crate::spec::Source;
use crate::spec::checked::{Finite, FiniteArray, NonNegative, Positive};
use nalgebra::Complex;
use serde::{Deserialize, Serialize};

/// A legged machine that carries the base.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LeggedSpec {
    /// How long everything is at rest first, s.
    #[serde(with = "NonNegative")]
    pub still_s: f64,
    /// Height of the base above the floor, m.
    #[serde(with = "Finite")]
    pub height_m: f64,
    /// How it walks along the route.
    pub follow: WalkSpec,
    /// Strides a second, Hz: a stride is a whole cycle of all legs.
    #[serde(with = "Positive")]
    pub stride_hz: f64,
    /// How far the strides wander off their beat, turns rms, at up to a tenth of their frequency.
    #[serde(with = "NonNegative")]
    pub irregularity_turns: f64,
    /// What a stride does to the body, as its harmonics; all grow with the speed, to the amplitudes given at full
    /// speed.
    pub harmonics: Vec<StrideSpec>,
}

/// A harmonic of a stride: the body moves by `amplitude cos(2 pi order strides + phase)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StrideSpec {
    /// Cycles a stride: a trot bounces twice, a walk on four legs four times.
    #[serde(with = "Positive")]
    pub order: f64,
    /// Amplitudes forward, to the left and up, m.
    #[serde(with = "FiniteArray::<3>")]
    pub position_m: [f64; 3],
    /// Their phases, degrees.
    #[serde(with = "FiniteArray::<3>")]
    pub position_phase_deg: [f64; 3],
    /// Amplitudes of roll, pitch and yaw, degrees.
    #[serde(with = "FiniteArray::<3>")]
    pub rotation_deg: [f64; 3],
    /// Their phases, degrees.
    #[serde(with = "FiniteArray::<3>")]
    pub rotation_phase_deg: [f64; 3],
}

impl StrideSpec {
    fn line(&self) -> Line<6> {
        let amplitude = |size: f64, phase_deg: f64| Complex::from_polar(size, phase_deg.to_radians());
        let amplitudes = std::array::from_fn(|k| match k {
            0..3 => amplitude(self.position_m[k], self.position_phase_deg[k]),
            _ => amplitude(self.rotation_deg[k - 3].to_radians(), self.rotation_phase_deg[k - 3]),
        });
        Line { cycles: self.order, amplitudes }
    }
}

/// A machine that walks.
pub(super) struct Legged {
    walk: Walk,
    height_m: f64,
    stride_hz: f64,
    irregularity_turns: f64,
    wander: Wander,
    /// Offsets forward, left, up, in roll, pitch and yaw, over strides.
    stride: Sines<6>,
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
            wander: Wander::new(spec.stride_hz / 10.0, &mut seed.stream("motion/legged/stride")),
            stride: Sines::new(spec.harmonics.iter().map(StrideSpec::line)),
        })
    }
}

impl BaseMotion for Legged {
    fn at(&self, t_s: f64) -> Kinematics {
        let mut position = self.walk.way.at(t_s);
        let heading = self.walk.heading.at(t_s);
        let share = self.walk.speed_share.at(t_s);
        let strides = Jet::linear(t_s, self.stride_hz, 0.0) + self.wander.at(t_s) * self.irregularity_turns;
        let [ahead, left, up, roll, pitch, yaw] = self.stride.at(strides.x).map(|jet| jet.of(strides) * share);
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
    use crate::geometry::Vector;
    use crate::motion::{MotionSpec, load};
    use crate::signal::{Segments, power_density};
    use approx::assert_relative_eq;

    #[test]
    fn a_trot_bounces_twice_a_stride() {
        let (spec, source) = load("legged").unwrap();
        let MotionSpec::Legged(mut spec) = spec else { panic!("legged.ron is no legged machine") };
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
