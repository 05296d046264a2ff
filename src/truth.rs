//! What really happened: a room of its own, so that estimation can be forbidden to name it.

use crate::geometry::Kinematics;
use crate::measurement::SinkError;
use crate::time::{Span, Stamp};

/// How the head and its base moved at an instant, both in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TruthSample {
    /// The instant on the lidar's clock, in which trajectories are written.
    pub lidar_stamp: Stamp,
    /// The head: `world_from_head` and its derivatives.
    pub head: Kinematics,
    /// The base that carries the spring: `world_from_base` and its derivatives.
    pub base: Kinematics,
}

/// What the sensors' clocks said at an instant, jitter aside; mean quantisation and delays are in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClockTruth {
    /// How far the lidar's clock was ahead of true time.
    pub lidar_ahead: Span,
    /// How far the IMU's stamps were ahead of true time.
    pub imu_ahead: Span,
}

impl ClockTruth {
    /// How much later the IMU stamps an instant than the lidar does: the clock offset that an estimator looks for.
    pub fn imu_after_lidar(&self) -> Span {
        self.imu_ahead - self.lidar_ahead
    }
}

/// Takes the truth, in the order of time.
pub trait TruthSink {
    /// Takes how things moved at the true time `now`.
    ///
    /// # Errors
    /// When the sink cannot keep it.
    fn truth(&mut self, now: Stamp, sample: &TruthSample) -> Result<(), SinkError>;

    /// Takes what the clocks said at the true time `now`.
    ///
    /// # Errors
    /// When the sink cannot keep it.
    fn clock(&mut self, now: Stamp, clock: &ClockTruth) -> Result<(), SinkError>;
}
