//! Ground truth of a simulated run.
//!
//! The module is separate so that the architecture can forbid estimation to depend on it.

use zsim_base::geometry::Kinematics;
use zsim_base::measurement::SinkError;
use zsim_base::time::{Span, Stamp};

/// True motion of the head and its base at one time, both in the world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TruthSample {
    /// The same time on the lidar's clock; trajectories are written in lidar time.
    pub lidar_stamp: Stamp,
    /// Head: `world_from_head` and derivatives.
    pub head: Kinematics,
    /// Base that carries the spring: `world_from_base` and derivatives.
    pub base: Kinematics,
}

/// True errors of the sensors' clocks at one time.
///
/// Jitter is excluded; mean quantisation and delays are included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClockTruth {
    /// Lidar clock minus true time.
    pub lidar_offset: Span,
    /// IMU stamps minus true time.
    pub imu_offset: Span,
}

impl ClockTruth {
    /// IMU stamp minus lidar stamp of one event: the time offset that an estimator determines.
    pub fn imu_after_lidar(&self) -> Span {
        self.imu_offset - self.lidar_offset
    }
}

/// Receives ground truth in order of time.
pub trait TruthSink {
    /// Receives the motion at the true time `now`.
    ///
    /// # Errors
    /// When the sink cannot store it.
    fn truth(&mut self, now: Stamp, sample: &TruthSample) -> Result<(), SinkError>;

    /// Receives the clock errors at the true time `now`.
    ///
    /// # Errors
    /// When the sink cannot store it.
    fn clock(&mut self, now: Stamp, clock: &ClockTruth) -> Result<(), SinkError>;
}
