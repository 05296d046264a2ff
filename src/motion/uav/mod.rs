//! A small multirotor: it follows the route, tilts to accelerate, and is disturbed by gusts and rotor vibration.
//!
//! Gusts are Dryden gusts in the low-altitude form of MIL-F-8785C. Position control acts as a damped oscillator; an
//! acceleration `a` that it commands needs a tilt of `a / g`.

mod gust;
mod rotors;
mod spec;

pub use rotors::RotorSpec;
pub use spec::{GustSpec, UavSpec};

use super::jet::{Jet, PoseJet};
use super::sines::SineSum;
use super::smooth::SmoothSteps;
use super::walk::RouteMotion;
use super::{BaseMotion, MotionError};
use gust::{horizontal, vertical};
use rotors::Rotors;
use zsim_base::geometry::{Kinematics, Route, STANDARD_GRAVITY_M_PER_S2};
use zsim_base::random::Seed;
use zsim_base::spec::Source;

/// Motion of a multirotor.
pub(super) struct Uav {
    flight: RouteMotion,
    speed_m_per_s: f64,
    height_m: f64,
    start_s: f64,
    onset: SmoothSteps,
    /// Displacement and tilt due to gusts: forward, then left.
    gusts: [SineSum<2>; 2],
    /// Vertical displacement due to gusts.
    heave: SineSum<1>,
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
        let mut onset = SmoothSteps::from_level(0.0);
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
        let mut position = self.flight.path.at(t_s);
        position[2] += Jet::constant(self.height_m);
        let yaw = self.flight.heading.at(t_s);
        // The craft tilts into its own accelerations: forward to speed up, left to turn left (positive roll is to the
        // right).
        let speed = self.flight.speed_fraction.at(t_s) * self.speed_m_per_s;
        let ahead = self.flight.speed_fraction.rate_at(t_s) * self.speed_m_per_s;
        let left = speed * self.flight.heading.rate_at(t_s);
        let mut pitch = ahead * (1.0 / STANDARD_GRAVITY_M_PER_S2);
        let mut roll = left * (-1.0 / STANDARD_GRAVITY_M_PER_S2);
        if t_s > self.start_s {
            let fraction = self.onset.at(t_s);
            let t_s = t_s - self.start_s;
            let [ahead, forward] = self.gusts[0].at(t_s).map(|jet| jet * fraction);
            let [left, leftward] = self.gusts[1].at(t_s).map(|jet| jet * fraction);
            let [up] = self.heave.at(t_s);
            let shaking = self.rotors.at(t_s).map(|jet| jet * fraction);
            let (sin, cos) = yaw.sin_cos();
            let (ahead, left) = (ahead + shaking[0], left + shaking[1]);
            position[0] += ahead * cos - left * sin;
            position[1] += ahead * sin + left * cos;
            position[2] += up * fraction + shaking[2];
            pitch += forward;
            roll += -leftward;
        }
        PoseJet { position, roll, pitch, yaw }.kinematics()
    }
}
