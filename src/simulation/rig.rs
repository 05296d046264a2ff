use super::motion::STEP_S;
use crate::geometry::Pose;
use crate::measurement::Calibration;
use crate::random::Seed;
use crate::sensors::{Clocks, Cylinder, Imu, Lidar, Scenery};
use crate::time::{NANOS_PER_SECOND, Span, Stamp};

/// When a run starts in true time, so that recordings look like any other's: 2012-10-01, the year of the paper.
pub const EPOCH: Stamp = Stamp::from_nanos(1_349_049_600 * NANOS_PER_SECOND);

/// The sensors on a head, what stands around them, and for how long they run.
#[derive(Clone, Copy)]
pub struct Rig<'a> {
    /// What stands around.
    pub scenery: &'a dyn Scenery,
    /// What of its carrier the lidar may see, fixed to the base: the operator, a handle, a cart.
    pub carrier: &'a [Cylinder],
    /// The lidar.
    pub lidar: &'a Lidar,
    /// The inertial measurement unit.
    pub imu: &'a Imu,
    /// A second inertial measurement unit, at the origin of the base and along its axes, on the first one's clock.
    pub base_imu: Option<&'a Imu>,
    /// Their clocks, started at [`EPOCH`].
    pub clocks: Clocks,
    /// Pose of the lidar in the head.
    pub head_from_laser: Pose,
    /// Pose of the IMU in the head.
    pub head_from_imu: Pose,
    /// How long the run lasts, s of true time.
    pub duration_s: f64,
    /// The seed of every error.
    pub seed: Seed,
}

impl Rig<'_> {
    /// How the sensors sit in the head, and how well they measure.
    pub fn calibration(&self) -> Calibration {
        Calibration {
            head_from_laser: self.head_from_laser,
            head_from_imu: self.head_from_imu,
            imu: self.imu.noise(),
            lidar: self.lidar.noise(),
        }
    }

    /// The true time `t_s` after the start.
    pub(super) fn true_stamp(&self, t_s: f64) -> Stamp {
        EPOCH + Span::from_seconds(t_s)
    }

    /// Instants of motion that a sample may reach back to before a window: the longest sample, and one step on either
    /// side.
    pub(super) fn overlap(&self) -> usize {
        let base_imu_s = self.base_imu.map_or(0.0, Imu::period_s);
        let longest_s = self.imu.period_s().max(self.lidar.period_s()).max(base_imu_s);
        (longest_s * 1.2 / STEP_S).ceil() as usize + 3
    }
}
