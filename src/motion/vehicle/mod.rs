//! A wheeled vehicle: a cart, a robot, a car.
//!
//! It follows the route on a rough road with a suspension and an engine; the body pitches when it accelerates and
//! brakes, and rolls in turns.
//!
//! Road excitation is a function of the distance driven, so it slows down and stops with the vehicle. The suspension
//! response is evaluated at the cruising speed throughout.

mod engine;
mod road;
mod suspension;

pub use engine::{EngineSpec, OrderSpec};
pub use road::{RoadClass, RoadSpec};
pub use suspension::SuspensionSpec;

use super::jet::{Jet, PoseJet};
use super::sines::SineSum;
use super::smooth::{SmoothPath, SmoothSteps};
use super::walk::{RouteMotion, WalkSpec};
use super::{BaseMotion, MotionError};
use engine::Engine;
use serde::{Deserialize, Serialize};
use zsim_base::geometry::{Kinematics, Pose, Route};
use zsim_base::random::Seed;
use zsim_base::spec::checked::{FiniteArray, NonNegative};
use zsim_base::spec::{Source, SpecError};

/// A wheeled vehicle that carries the base. It turns on the spot at sharp corners, as a skid-steered vehicle does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VehicleSpec {
    /// Time at rest at the start, s.
    #[serde(default = "crate::usual::still_s", with = "NonNegative")]
    pub still_s: f64,
    /// Position of the base relative to the body's centre of mass: forward, left, up, m.
    #[serde(default, with = "FiniteArray::<3>")]
    pub base_m: [f64; 3],
    /// How the vehicle follows the route.
    pub follow: WalkSpec,
    /// Road roughness.
    pub road: RoadSpec,
    /// The body and the suspension.
    pub suspension: SuspensionSpec,
    /// The engine, started at the end of the rest; `None` for no engine.
    pub engine: Option<EngineSpec>,
}

/// Motion of a wheeled vehicle.
pub(super) struct Vehicle {
    drive: RouteMotion,
    speed_m_per_s: f64,
    odometer: SmoothPath,
    /// Heave, roll and pitch over the distance driven.
    road: SineSum<3>,
    /// Heave, roll and pitch at the start.
    road_at_rest: [f64; 3],
    centre_height_m: f64,
    lean: (f64, f64),
    engine: Option<(Engine, SmoothSteps)>,
    centre_from_base: Pose,
}

impl Vehicle {
    pub fn new(
        spec: &VehicleSpec,
        source: &Source,
        route: Option<&Route>,
        duration_s: f64,
        seed: Seed,
    ) -> Result<Self, MotionError> {
        spec.follow.check(source)?;
        if !spec.suspension.is_stable() {
            let message = "the springs do not support the body: its weight tips it over; increase the stiffness, or lower the centre of mass";
            return Err(SpecError::about(source, "spring_n_per_m", message).into());
        }
        let route = route.ok_or_else(|| MotionError::NoRoute { motion: source.name.clone() })?;
        let drive = spec.follow.along(route, spec.still_s, duration_s)?;
        let speed_m_per_s = spec.follow.speed_m_per_s;
        let tracks = spec.road.tracks(spec.suspension.track_m, &mut seed.stream("motion/vehicle/road"));
        let road = SineSum::new(spec.suspension.response(&tracks, speed_m_per_s));
        let engine = spec.engine.as_ref().map(|engine| {
            let mut running = SmoothSteps::from_level(0.0);
            running.push(spec.still_s + ENGINE_START_S / 2.0, ENGINE_START_S / 2.0, 1.0);
            (Engine::new(engine, &mut seed.stream("motion/vehicle/engine")), running)
        });
        let [x, y, z] = spec.base_m;
        Ok(Self {
            odometer: drive.path.odometer(),
            drive,
            speed_m_per_s,
            road_at_rest: road.at(0.0).map(|jet| jet.x),
            road,
            centre_height_m: spec.suspension.centre_height_m,
            lean: spec.suspension.lean(),
            engine,
            centre_from_base: Pose::translation(x, y, z),
        })
    }
}

/// Time in which the engine reaches full speed, s.
const ENGINE_START_S: f64 = 1.0;

impl BaseMotion for Vehicle {
    fn at(&self, t_s: f64) -> Kinematics {
        let mut position = self.drive.path.at(t_s);
        let yaw = self.drive.heading.at(t_s);
        let [distance, ..] = self.odometer.at(t_s);
        let [mut heave, mut roll, mut pitch] = self.road.at(distance.x).map(|jet| jet.compose(distance));
        heave += Jet::constant(self.centre_height_m - self.road_at_rest[0]);
        roll += Jet::constant(-self.road_at_rest[1]);
        pitch += Jet::constant(-self.road_at_rest[2]);

        let speed = self.drive.speed_fraction.at(t_s) * self.speed_m_per_s;
        roll += speed * self.drive.heading.rate_at(t_s) * self.lean.0;
        pitch += self.drive.speed_fraction.rate_at(t_s) * (self.speed_m_per_s * self.lean.1);

        if let Some((engine, running)) = &self.engine {
            let running = running.at(t_s);
            let [ahead, left, up] = engine.at(t_s).map(|jet| jet * running);
            let (sin, cos) = yaw.sin_cos();
            position[0] += ahead * cos - left * sin;
            position[1] += ahead * sin + left * cos;
            heave += up;
        }
        position[2] += heave;
        PoseJet { position, roll, pitch, yaw }.kinematics().of_frame(&self.centre_from_base)
    }
}
