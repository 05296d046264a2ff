use super::motion::STEP_S;
use zsim_base::geometry::Pose;
use zsim_base::measurement::Calibration;
use zsim_base::random::Seed;
use zsim_base::time::{NANOS_PER_SECOND, Span, Stamp};
use zsim_sensors::{Clocks, Cylinder, Imu, Lidar, Scenery};

/// Start of all runs in true time: 2012-10-01, the year of the paper, so that stamps look like those of real
/// recordings.
pub const EPOCH: Stamp = Stamp::from_nanos(1_349_049_600 * NANOS_PER_SECOND);

/// What a simulation passes to its sink.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Outputs {
    /// The measurements of all sensors, and the truth.
    #[default]
    All,
    /// The measurements of the IMUs only: no ray is cast. They are the same as with [`Outputs::All`].
    Imus,
}

/// Sensors on a head, their surroundings, and the duration of the run.
#[derive(Clone, Copy)]
pub struct Rig<'a> {
    /// Surroundings.
    pub scenery: &'a dyn Scenery,
    /// Solids of the carrier that the lidar can see, fixed to the base: the operator, a handle, a cart.
    pub carrier: &'a [Cylinder],
    /// The lidar.
    pub lidar: &'a Lidar,
    /// The inertial measurement unit.
    pub imu: &'a Imu,
    /// A second IMU at the origin and along the axes of the base, on the clock of the first IMU.
    pub base_imu: Option<&'a Imu>,
    /// Clocks of the sensors, started at [`EPOCH`].
    pub clocks: Clocks,
    /// Pose of the lidar in the head.
    pub head_from_laser: Pose,
    /// Pose of the IMU in the head.
    pub head_from_imu: Pose,
    /// Duration of the run, s of true time.
    pub duration_s: f64,
    /// Random seed of all errors.
    pub seed: Seed,
    /// What is computed.
    pub outputs: Outputs,
}

impl Rig<'_> {
    /// Mounting poses and noise of the sensors.
    pub fn calibration(&self) -> Calibration {
        Calibration {
            head_from_laser: self.head_from_laser,
            head_from_imu: self.head_from_imu,
            imu: self.imu.noise(),
            imu_averaging: self.imu.averaging(),
            lidar: self.lidar.noise(),
        }
    }

    /// True time at `t_s` after the start.
    pub(super) fn true_stamp(&self, t_s: f64) -> Stamp {
        EPOCH + Span::from_seconds(t_s)
    }

    /// Number of steps before a chunk that a sample in progress can need: the longest sample, plus one step on either
    /// side.
    pub(super) fn overlap(&self) -> usize {
        let base_imu_s = self.base_imu.map_or(0.0, Imu::period_s);
        let longest_s = self.imu.period_s().max(self.lidar.period_s()).max(base_imu_s);
        (longest_s * 1.2 / STEP_S).ceil() as usize + 3
    }
}
