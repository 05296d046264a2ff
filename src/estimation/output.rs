//! What comes out of the estimator.

use super::{Located, Survey, TimeSpent, Warning, WarningKind};
use crate::geometry::{Pose, PoseCovariance, Trajectory, Vector};
use crate::measurement::LidarCorrection;
use crate::time::Stamp;

/// Over so many seconds at the start a trajectory is aligned when its error is stated, s.
pub const GAUGED_S: f64 = 20.0;

/// A turn counts in an alignment as much as a shift by this times the angle, m: it holds one of a head that stays in
/// one place, and counts for nothing on a walk.
pub const TURN_LEVER_M: f64 = 0.05;

/// The head at an instant, and what the estimator thought of its sensors then.
#[derive(Debug, Clone, PartialEq)]
pub struct EstimatedPose {
    /// When, lidar time: a whole multiple of the IMU's period, itself rounded to a whole number of milliseconds.
    pub stamp: Stamp,
    /// The pose. The map's z axis points up (gravity as it was known at the start), its origin is the first pose's.
    pub map_from_head: Pose,
    /// How uncertain it is against the map, which is where the first pose puts it: m^2, m rad, rad^2.
    pub covariance: PoseCovariance,
    /// How uncertain it is against a trajectory that is aligned with the truth over its first [`GAUGED_S`] seconds,
    /// likewise; over these seconds themselves against the alignment so far.
    pub covariance_against_gauge: PoseCovariance,
    /// Velocity of the head's origin, m/s.
    pub velocity_in_map_m_per_s: Vector,
    /// Bias of the gyroscope, in the IMU's frame, rad/s.
    pub gyro_bias_rad_per_s: Vector,
    /// Bias of the accelerometer, in the IMU's frame, m/s^2.
    pub accel_bias_m_per_s2: Vector,
    /// How much later the IMU stamps an instant than the lidar does, s.
    pub clock_offset_s: f64,
}

/// What a window's solution rested on.
#[derive(Debug, Clone, PartialEq)]
pub struct WindowReport {
    /// The window's end, lidar time.
    pub stamp: Stamp,
    /// Surfels in the window.
    pub surfels: usize,
    /// Matches of the last iteration between surfels of the window.
    pub matches: usize,
    /// Matches of the last iteration with fixed views.
    pub view_matches: usize,
    /// Fixed views in use.
    pub views: usize,
    /// Weighted root mean square of the matches' distances along their normals, m.
    pub residual_rms_m: f64,
    /// Iterations of place, match, solve.
    pub iterations: usize,
    /// Size of the last iteration's correction: greatest translation of a knot, m.
    pub last_correction_m: f64,
    /// Least over greatest eigenvalue of the information that the matches hold about the position, 0..1; 0 without
    /// matches.
    pub conditioning: f64,
    /// How many times as far as their noise has it the IMU's samples are from the trajectory, which follows them: 0.1
    /// to 0.4 where all is well.
    pub imu_contradiction: f64,
    /// Clock offset after the window, s.
    pub clock_offset_s: f64,
    /// Estimated rate of the clock offset, s/s.
    pub clock_rate: f64,
    /// Estimated correction of all ranges, m.
    pub range_correction_m: f64,
    /// Largest entry of the estimated scale errors and misalignments of gyroscope and accelerometer.
    pub imu_matrix: f64,
    /// Speed of the IMU at its end, m/s.
    pub speed_m_per_s: f64,
    /// Whether the head moves, so that surfaces should be observed again.
    pub moving: bool,
    /// Whether it rests at the window's end, as far as the IMU and the estimated speed show.
    pub resting: bool,
    /// Whether the lidar would show it if it did not rest.
    pub sees_rest: bool,
    /// What is wrong with the window's solution, if anything.
    pub trouble: Option<WarningKind>,
    /// Time it took, s. With its parts the one figure that differs from run to run.
    pub elapsed_s: f64,
    /// The parts of that time; what they leave of it is the bookkeeping between them.
    pub spent: TimeSpent,
}

/// An open-loop estimate.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OpenLoop {
    /// `map_from_head` over lidar time: of every pose in `poses`.
    pub trajectory: Trajectory,
    /// The poses with velocity, biases and clock offset.
    pub poses: Vec<EstimatedPose>,
    /// How uncertain poses of the first twice [`GAUGED_S`] seconds are against the alignment that the first seconds
    /// give, [`GAUGED_S`] or half of a shorter run: m^2, m
    /// rad, rad^2. Empty where the estimate began anew in this time.
    pub gauged: Vec<(Stamp, PoseCovariance)>,
    /// The clock offset after each window: how much later the IMU stamps an instant than the lidar, s, by lidar time.
    pub clock_offsets: Vec<(Stamp, f64)>,
    /// What was learnt of the lidar beyond its calibration, at the end, as the poses go with it.
    pub lidar: LidarCorrection,
    /// The same as a calibration has it: where it was estimated how the lidar sits, the poses stand along the
    /// gyroscope's axes, and this along the IMU's, midway between the gyroscope's and the accelerometer's.
    pub calibrated_lidar: LidarCorrection,
    /// Where in a map the head was found at first, where one was given.
    pub located: Option<Located>,
    /// A report a window.
    pub windows: Vec<WindowReport>,
    /// What degraded the estimate; empty when nothing did.
    pub warnings: Vec<Warning>,
    /// What was seen on the way, where that was asked for.
    pub survey: Survey,
}
