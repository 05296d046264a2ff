use super::cruise::{Cruise, CruiseSpec};
use super::hand::{Hand, HandSpec};
use super::legged::{Legged, LeggedSpec};
use super::marine::{Marine, MarineSpec};
use super::replay::{Replay, ReplaySpec};
use super::shaker::{Shaker, ShakerSpec};
use super::stand::{Stand, StandSpec};
use super::uav::{Uav, UavSpec};
use super::vehicle::{Vehicle, VehicleSpec};
use super::{BaseMotion, MAX_DURATION_S, MotionError};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use zsim_base::geometry::{Route, Vector};
use zsim_base::random::Seed;
use zsim_base::spec::{Kind, NamedSpec, Source, SpecError, find, parse_named};

/// Motion of the base, as written in a file of `specs/motions/`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum MotionSpec {
    /// Stationary base.
    Stand(StandSpec),
    /// Straight motion at constant velocity.
    Cruise(CruiseSpec),
    /// Handheld: a walker shakes the base with the wrist.
    Hand(Box<HandSpec>),
    /// Wheeled vehicle.
    Vehicle(Box<VehicleSpec>),
    /// Legged robot.
    Legged(Box<LeggedSpec>),
    /// Small multirotor.
    Uav(Box<UavSpec>),
    /// Vessel in waves.
    Marine(Box<MarineSpec>),
    /// Replay of a recorded trajectory.
    Replay(ReplaySpec),
    /// Shaker: test signals along or about the axes of the base.
    Shaker(ShakerSpec),
}

/// Finds and parses the motion called `name`: a path, or a name in the library.
///
/// Returns the source too, for the errors of [`MotionSpec::build`].
///
/// # Errors
/// If there is no such motion, or the spec is invalid.
pub fn load(name: &str) -> Result<(MotionSpec, Source), SpecError> {
    let source = find(Kind::Motion, name)?;
    Ok((MotionSpec::parse(&source)?, source))
}

/// A route that any motion can follow: around a hall of 20 m by 10 m.
pub fn any_route() -> Route {
    let corners = [(0.0, 0.0), (20.0, 0.0), (20.0, 10.0), (0.0, 10.0)];
    Route { points_in_world: corners.map(|(x, y)| Vector::new(x, y, 0.0)).to_vec(), closed: true }
}

impl MotionSpec {
    /// The file, or the folder of a recording, from which a replay reads; `source` is the spec's text.
    pub fn recorded_file(&self, source: &Source) -> Option<PathBuf> {
        match self {
            MotionSpec::Replay(spec) => spec.poses.file(source),
            _ => None,
        }
    }

    /// Builds the motion for a run of `duration_s`.
    ///
    /// `route` is in metres on the floor. All random numbers derive from `seed`. Errors point into `source`, the text
    /// of the spec.
    ///
    /// # Errors
    /// If values of the spec contradict each other, if the route is missing or cannot be followed, or if the duration
    /// is not above 0 s and at most [`MAX_DURATION_S`].
    pub fn build(
        &self,
        source: &Source,
        route: Option<&Route>,
        duration_s: f64,
        seed: Seed,
    ) -> Result<Box<dyn BaseMotion>, MotionError> {
        if !(duration_s > 0.0 && duration_s <= MAX_DURATION_S) {
            return Err(MotionError::Duration { duration_s });
        }
        Ok(match self {
            MotionSpec::Stand(spec) => Box::new(Stand::new(spec, route)),
            MotionSpec::Cruise(spec) => Box::new(Cruise::new(spec, route)),
            MotionSpec::Vehicle(spec) => Box::new(Vehicle::new(spec, source, route, duration_s, seed)?),
            MotionSpec::Legged(spec) => Box::new(Legged::new(spec, source, route, duration_s, seed)?),
            MotionSpec::Uav(spec) => Box::new(Uav::new(spec, source, route, duration_s, seed)?),
            MotionSpec::Marine(spec) => Box::new(Marine::new(spec, source, route, seed)?),
            MotionSpec::Replay(spec) => Box::new(Replay::new(spec, source, route)?),
            MotionSpec::Shaker(spec) => Box::new(Shaker::new(spec, source, route, duration_s, seed)?),
            MotionSpec::Hand(spec) => Box::new(Hand::new(spec, source, route, duration_s, seed)?),
        })
    }
}

impl NamedSpec for MotionSpec {
    const KIND: Kind = Kind::Motion;
    type Error = SpecError;

    fn parse(source: &Source) -> Result<Self, SpecError> {
        parse_named(source)
    }

    fn check_model(&self, source: &Source) -> Result<Vec<String>, SpecError> {
        match self.build(source, Some(&any_route()), 120.0, Seed(1)) {
            Ok(_) => Ok(Vec::new()),
            Err(MotionError::Spec(error)) => Err(error),
            Err(error) => Err(SpecError::plain(&source.name, error.to_string())),
        }
    }
}
