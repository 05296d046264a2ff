//! Sensor models: lidar, inertial measurement unit (IMU), and their clocks.
//!
//! Each sensor has three parts. A *spec* is data ([`LidarSpec`], [`ImuSpec`], [`ClocksSpec`]), read from `specs/`. A
//! *model* is built from the spec and is valid by construction ([`Lidar`], [`Imu`], [`Clocks`]). The *errors* are one
//! realisation of the noise of the spec, sampled with a seed ([`LidarErrors`], [`ImuErrors`], [`Stamper`]). The exact
//! geometry is computed first and the errors afterwards, so that runs that differ only in noise can use the same rays:
//!
//! - lidar: [`Lidar::sweep`] casts the rays of one scan, each from the pose at the firing time of its beam;
//!   [`Lidar::measure`] computes the scan from the intersections;
//! - IMU: [`ideal_reading`] is the ideal sample over an interval; [`ImuErrors::measure`] adds the errors; [`ImuSampler`] does
//!   both for a moving body, with saturation within the interval and the output filter;
//! - clock: [`Clock`] determines the sample times and the mean stamps; [`Stamper`] adds the jitter.
//!
//! Each source of noise has a separate random stream, named after the quantity it disturbs. The streams of a lidar have
//! one part per scan, so that scans can be computed in any order and on any thread.

mod carrier;
mod clock;
mod imu;
mod lidar;
mod scenery;
mod stamper;
mod track;

pub use carrier::{Cylinder, SceneryWithCarrier};
pub use clock::{Clock, ClockSpec, Clocks, ClocksSpec};
pub use imu::{
    AccelSpec, GaussMarkovSpec, GyroSpec, Imu, ImuErrors, ImuSampler, ImuSpec, InertialReading, OutputFilterSpec,
    WarmUpSpec, coning_corrected, ideal_reading,
};
pub use lidar::{
    Beam, BeamModel, DetectionSpec, FarRange, GlassSpec, GrazingSpec, Lidar, LidarErrors, LidarErrorsSpec, LidarSpec,
    PatternSpec, RangeNoiseSpec, RangeSigma, ScanTiming, Sweep, Switch,
};
pub use scenery::{CanopyPart, Scenery, SurfaceHit};
pub use stamper::Stamper;
pub use track::Track;
