//! How the carrier moves: the pose of the base that the spring stands on, as a smooth function of time.
//!
//! A motion is data ([`MotionSpec`], the files of `specs/motions/`) until [`MotionSpec::build`] makes a [`BaseMotion`]
//! of it, which answers for any instant with the pose and its exact first and second derivatives. There is no state and
//! no step: a motion is a closed form of time (smoothed polylines, sums of sinusoids with seeded phases, splines), so
//! that whoever asks, at whatever times and on whatever thread, gets the same bits.
//!
//! The base's frame stands where the spring is clamped: x forward, y left, z up (REP-103).

mod cruise;
mod drops;
mod error;
mod hand;
mod jet;
mod legged;
mod marine;
mod phasor;
mod replay;
mod rests;
mod rhythm;
mod shaker;
mod sines;
mod smooth;
mod spec;
mod stand;
mod stops;
mod uav;
mod vehicle;
mod walk;

pub use cruise::CruiseSpec;
pub use drops::DropSpec;
pub use error::{LONGEST_S, MotionError};
pub use hand::{CarrySpec, GaitSpec, HandSpec, ShakeSpec};
pub use legged::{LeggedSpec, StrideSpec};
pub use marine::{HullSpec, MarineSpec, SeaSpec};
pub use replay::{PosesSpec, ReplaySpec};
pub use shaker::{Axis, DriveSpec, Level, Phases, ShakerSpec, SignalSpec};
pub use spec::{MotionSpec, load};
pub use stand::StandSpec;
pub use stops::StopsSpec;
pub use uav::{GustSpec, RotorSpec, UavSpec};
pub use vehicle::{EngineSpec, OrderSpec, RoadClass, RoadSpec, SuspensionSpec, VehicleSpec};
pub use walk::WalkSpec;

use crate::geometry::Kinematics;

/// The prescribed motion of the base.
pub trait BaseMotion: Send + Sync {
    /// How the base moves `t_s` seconds after the start: `world_from_base` with its exact derivatives. Accelerations
    /// are continuous; at the start the base is at rest, unless it cruises.
    fn at(&self, t_s: f64) -> Kinematics;

    /// How firmly a hand holds the head still, from 0 (not at all) to 1.
    fn hold(&self, _t_s: f64) -> f64 {
        0.0
    }
}
