//! Sensors: what a lidar, an inertial measurement unit and their clocks make of the motion and the world.
//!
//! Every sensor has three parts. A *spec* is data ([`LidarSpec`], [`ImuSpec`], [`ClocksSpec`]), read from `specs/`. A
//! *model* is built from it and valid by construction ([`Lidar`], [`Imu`], [`Clocks`]). Its *errors* are what a seed
//! makes of the spec's noise ([`LidarErrors`], [`ImuErrors`], [`Stamper`]). Exact geometry comes first and errors
//! second, so that runs that differ in noise alone can share their rays:
//!
//! - a lidar: [`Lidar::sweep`] casts the rays of one scan, each from where the laser was when that beam was fired;
//!   [`Lidar::measure`] makes a scan of what they met;
//! - an IMU: [`mean_motion`] is what an ideal one says over an interval; [`ImuErrors::measure`] is what this one says;
//! - a clock: [`Clock`] tells when samples are taken and what the clock says, jitter aside; a [`Stamper`] adds the
//!   jitter.
//!
//! Every source of noise has a stream of its own, named after what it disturbs; a lidar's has one part a scan, so that
//! scans can be computed in any order, on any thread.

mod carrier;
mod clock;
mod imu;
mod lidar;
mod scenery;
mod stamper;
mod track;

pub use carrier::{Carried, Cylinder};
pub use clock::{Clock, ClockSpec, Clocks, ClocksSpec};
pub use imu::{AccelSpec, GaussMarkovSpec, GyroSpec, Imu, ImuErrors, ImuSpec, MeanMotion, mean_motion};
pub use lidar::{
    Beam, DetectionSpec, Firing, GlassSpec, GrazingSpec, Lidar, LidarErrors, LidarErrorsSpec, LidarSpec, PatternSpec,
    RangeNoiseSpec, Rays, Sweep, Switch,
};
pub use scenery::{Scenery, SurfaceHit};
pub use stamper::Stamper;
pub use track::Track;
