use super::cruise::{Cruise, CruiseSpec};
use super::hand::{Hand, HandSpec};
use super::legged::{Legged, LeggedSpec};
use super::marine::{Marine, MarineSpec};
use super::replay::{Replay, ReplaySpec};
use super::shaker::{Shaker, ShakerSpec};
use super::stand::{Stand, StandSpec};
use super::uav::{Uav, UavSpec};
use super::vehicle::{Vehicle, VehicleSpec};
use super::{BaseMotion, LONGEST_S, MotionError};
use crate::geometry::Route;
use crate::random::Seed;
use crate::spec::{Kind, Source, SpecError, find, parse};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// How the base moves, as a file of `specs/motions/` says it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum MotionSpec {
    /// It stands still.
    Stand(StandSpec),
    /// It moves straight on at constant velocity.
    Cruise(CruiseSpec),
    /// A hand carries and shakes it.
    Hand(Box<HandSpec>),
    /// A wheeled vehicle carries it.
    Vehicle(Box<VehicleSpec>),
    /// A legged machine carries it.
    Legged(Box<LeggedSpec>),
    /// A small multirotor carries it.
    Uav(Box<UavSpec>),
    /// A vessel in waves carries it.
    Marine(Box<MarineSpec>),
    /// It moves as it was recorded.
    Replay(ReplaySpec),
    /// A shaker drives it along or about its axes.
    Shaker(ShakerSpec),
}

/// Finds and parses the motion called `name`: a path, or a name in the library. The source comes with it, for errors of
/// [`MotionSpec::build`].
///
/// # Errors
/// When there is none, or it is wrong.
pub fn load(name: &str) -> Result<(MotionSpec, Source), SpecError> {
    let source = find(Kind::Motion, name)?;
    Ok((parse(&source)?, source))
}

impl MotionSpec {
    /// The file, or the folder of a recording, that a recorded motion is read from; `source` is the spec's text.
    pub fn recorded_file(&self, source: &Source) -> Option<PathBuf> {
        match self {
            MotionSpec::Replay(spec) => spec.poses.file(source),
            _ => None,
        }
    }

    /// Builds the motion for a run of `duration_s` along `route` (m, on the floor), with all of its chance drawn from
    /// `seed`. `source` is the spec's text, which errors point into.
    ///
    /// # Errors
    /// When numbers of the spec contradict each other, the route is missing or cannot be followed, or the duration is
    /// not above 0 s and at most [`LONGEST_S`].
    pub fn build(
        &self,
        source: &Source,
        route: Option<&Route>,
        duration_s: f64,
        seed: Seed,
    ) -> Result<Box<dyn BaseMotion>, MotionError> {
        if !(duration_s > 0.0 && duration_s <= LONGEST_S) {
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
