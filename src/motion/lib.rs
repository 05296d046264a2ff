//! Motion of the base, the body to which the spring is clamped, as a smooth function of time.
//!
//! [`MotionSpec`] is the data (the files of `specs/motions/`). [`MotionSpec::build`] turns it into a [`BaseMotion`],
//! which evaluates the pose and the exact first and second derivatives at any time. A motion has no state and no time
//! step: it is a closed form of time (smoothed polylines, sums of sinusoids with seeded phases, splines). The result
//! therefore does not depend on the order of evaluation or on the thread.
//!
//! The base frame is at the clamped end of the spring: x forward, y left, z up (REP-103).

mod base_motion;
mod cruise;
mod drops;
mod error;
mod hand;
mod jet;
mod legged;
mod marine;
mod oscillator;
mod phasor;
mod replay;
mod rests;
mod shaker;
mod sines;
mod smooth;
mod spec;
mod stand;
mod stops;
mod uav;
mod usual;
mod vehicle;
mod walk;

pub use base_motion::BaseMotion;
pub use cruise::CruiseSpec;
pub use drops::DropSpec;
pub use error::{MAX_DURATION_S, MotionError};
pub use hand::{CarrySpec, GaitSpec, HandSpec, ShakeSpec};
pub use legged::{LeggedSpec, StrideSpec};
pub use marine::{HullSpec, MarineSpec, SeaSpec};
pub use replay::{PosesSpec, ReplaySpec};
pub use shaker::{Axis, DriveSpec, Level, Phases, ShakerSpec, SignalSpec};
pub use spec::{MotionSpec, any_route, load};
pub use stand::StandSpec;
pub use stops::StopsSpec;
pub use uav::{GustSpec, RotorSpec, UavSpec};
pub use vehicle::{EngineSpec, OrderSpec, RoadClass, RoadSpec, SuspensionSpec, VehicleSpec};
pub use walk::{Speed, WalkSpec};
