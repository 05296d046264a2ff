//! A small multirotor: it flies along the route, tilts to accelerate, is pushed about by gusts, and shaken by its
//! rotors.
//!
//! Gusts are Dryden's in the low-altitude form of MIL-F-8785C. The craft holds its place like a damped oscillator; what
//! its controller commands, it does by tilting: `a / g` for an acceleration a.

mod gust;
mod rotors;

pub use gust::GustSpec;
pub use rotors::RotorSpec;

use super::jet::{Jet, PoseJet};
use super::sines::Sines;
use super::smooth::Steps;
use super::walk::{Walk, WalkSpec};
use super::{BaseMotion, MotionError};
use crate::geometry::{Kinematics, Route, STANDARD_GRAVITY_M_PER_S2};
use crate::random::Seed;
use crate::spec::Source;
use crate::spec::checked::{NonNegative, Positive};
use gust::{horizontal, vertical};
use rotors::Rotors;
use serde::{Deserialize, Serialize};

/// A small multirotor that carries the base.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UavSpec {
    /// How long everything is at rest first, s.
    #[serde(with = "NonNegative")]
    pub still_s: f64,
    /// How long gusts and vibration take to reach their full strength, s.
    #[serde(with = "Positive")]
    pub onset_s: f64,
    /// Height of the base above the route's floor, m.
    #[serde(with = "Positive")]
    pub height_m: f64,
    /// How it flies along the route.
    pub follow: WalkSpec,
    /// The wind.
    pub gust: GustSpec,
    /// Natural frequency with which it holds its place, Hz.
    #[serde(with = "Positive")]
    pub hold_hz: f64,
    /// Damping ratio of that.
    #[serde(with = "Positive")]
    pub hold_damping: f64,
    /// How the air drags it: acceleration for each m/s of wind, 1/s.
    #[serde(with = "NonNegative")]
    pub drag_per_s: f64,
    /// The rotors.
    pub rotors: RotorSpec,
}

/// A multirotor in flight.
pub(super) struct Uav {
    flight: Walk,
    speed_m_per_s: f64,
    height_m: f64,
    start_s: f64,
    onset: Steps,
    /// Displacement and tilt by gusts forward, then to the left.
    gusts: [Sines<2>; 2],
    /// Displacement by gusts upwards.
    heave: Sines<1>,
    rotors: Rotors,
}

impl Uav {
    pub fn new(
        spec: &UavSpec,
        source: &Source,
        route: Option<&Route>,
        duration_s: f64,
        seed: Seed,
    ) -> Result<Self, MotionError> {
        spec.follow.check(source)?;
        let route = route.ok_or_else(|| MotionError::NoRoute { motion: source.name.clone() })?;
        let mut onset = Steps::from_level(0.0);
        onset.push(spec.still_s + spec.onset_s / 2.0, spec.onset_s / 2.0, 1.0);
        let stream = |name: &str| seed.stream(&format!("motion/uav/{name}"));
        Ok(Self {
            flight: spec.follow.along(route, spec.still_s, duration_s)?,
            speed_m_per_s: spec.follow.speed_m_per_s,
            height_m: spec.height_m,
            start_s: spec.still_s,
            onset,
            gusts: [
                horizontal(spec, gust::Axis::Along, &mut stream("u")),
                horizontal(spec, gust::Axis::Across, &mut stream("v")),
            ],
            heave: vertical(spec, &mut stream("w")),
            rotors: Rotors::new(&spec.rotors, &mut stream("rotors")),
        })
    }
}

impl BaseMotion for Uav {
    fn at(&self, t_s: f64) -> Kinematics {
        let mut position = self.flight.way.at(t_s);
        position[2] += Jet::constant(self.height_m);
        let yaw = self.flight.heading.at(t_s);
        // It leans into its own accelerations: forward to speed up, to the left to turn left (roll is positive to the
        // right).
        let speed = self.flight.speed_share.at(t_s) * self.speed_m_per_s;
        let ahead = self.flight.speed_share.rate_at(t_s) * self.speed_m_per_s;
        let left = speed * self.flight.heading.rate_at(t_s);
        let mut pitch = ahead * (1.0 / STANDARD_GRAVITY_M_PER_S2);
        let mut roll = left * (-1.0 / STANDARD_GRAVITY_M_PER_S2);
        if t_s > self.start_s {
            let share = self.onset.at(t_s);
            let t_s = t_s - self.start_s;
            let [ahead, forward] = self.gusts[0].at(t_s).map(|jet| jet * share);
            let [left, leftward] = self.gusts[1].at(t_s).map(|jet| jet * share);
            let [up] = self.heave.at(t_s);
            let shaking = self.rotors.at(t_s).map(|jet| jet * share);
            let (sin, cos) = yaw.sin_cos();
            let (ahead, left) = (ahead + shaking[0], left + shaking[1]);
            position[0] += ahead * cos - left * sin;
            position[1] += ahead * sin + left * cos;
            position[2] += up * share + shaking[2];
            pitch += forward;
            roll += -leftward;
        }
        PoseJet { position, roll, pitch, yaw }.kinematics()
    }
}
