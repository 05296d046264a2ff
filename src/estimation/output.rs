//! Output of the estimator.

use super::{Event, EventKind, LocalisedPose, ObservedSurfels, Timing};
use zsim_base::geometry::{Pose, PoseCovariance, Trajectory, Vector};
use zsim_base::measurement::LidarCorrection;
use zsim_base::time::Stamp;

/// Length of the initial part over which a trajectory is aligned with the truth when errors are reported, s.
pub const ALIGNMENT_S: f64 = 20.0;

/// Lever arm that converts a rotation error to a position error in the alignment, m.
///
/// It makes the alignment regular for a head that stays in one place, and has no effect on a longer trajectory.
pub const TURN_LEVER_M: f64 = 0.05;

/// Estimated pose, velocity, biases and clock offset at a time.
#[derive(Debug, Clone, PartialEq)]
pub struct EstimatedPose {
    /// Lidar time: a multiple of the IMU period, which is rounded to milliseconds.
    pub stamp: Stamp,
    /// The pose. The origin of the map is the first pose; z points up, by the initial estimate of gravity.
    pub map_from_head: Pose,
    /// Covariance relative to the map, which the first pose defines: position, then attitude; m^2, m rad, rad^2.
    pub covariance: PoseCovariance,
    /// Covariance relative to the alignment over the first [`ALIGNMENT_S`] seconds, or over the time up to the pose.
    pub covariance_against_gauge: PoseCovariance,
    /// Velocity of the head origin, m/s.
    pub velocity_in_map_m_per_s: Vector,
    /// Gyroscope bias, in the IMU frame, rad/s.
    pub gyro_bias_rad_per_s: Vector,
    /// Accelerometer bias, in the IMU frame, m/s^2.
    pub accel_bias_m_per_s2: Vector,
    /// Clock offset, s: positive if IMU stamps are later than lidar stamps.
    pub clock_offset_s: f64,
}

/// Smallest standard deviation of scale and misalignment that an IMU is judged by: a vibration, a filter or wrong extrinsics of
/// a sound run look like such an error.
const MIN_MODEL_SIGMA: f64 = 0.00225;

/// An estimated scale error or misalignment (rad) of an axis of an IMU.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MatrixEntry {
    /// Absolute value.
    pub value: f64,
    /// Standard deviation according to the model of the IMU.
    pub model_sigma: f64,
}

impl MatrixEntry {
    /// Returns the value over the standard deviation of the model, at least 0.2 %.
    pub fn over_model(&self) -> f64 {
        self.value / self.model_sigma.max(MIN_MODEL_SIGMA)
    }
}

/// Diagnostics of the solution of a window.
#[derive(Debug, Clone, PartialEq)]
pub struct WindowReport {
    /// End of the window, lidar time.
    pub stamp: Stamp,
    /// Surfels in the window.
    pub surfels: usize,
    /// Matches of the last iteration between surfels of the window.
    pub matches: usize,
    /// Matches of the last iteration with fixed views.
    pub view_matches: usize,
    /// Fixed views in use.
    pub views: usize,
    /// Weighted root mean square of the match distances along the normals, m.
    pub residual_rms_m: f64,
    /// Number of iterations: match, then solve.
    pub iterations: usize,
    /// Largest correction in the last iteration of the usual number, m or rad.
    pub last_correction_m: f64,
    /// Smallest over largest eigenvalue of the position information of the matches, 0..1; 0 without matches.
    pub conditioning: f64,
    /// Disagreement between IMU samples and trajectory, as a multiple of the IMU noise: 0.1 to 0.4 in a sound run.
    pub imu_contradiction: f64,
    /// Clock offset after the window, s.
    pub clock_offset_s: f64,
    /// Estimated rate of the clock offset, s/s.
    pub clock_rate: f64,
    /// Estimated correction of all ranges, m.
    pub range_correction_m: f64,
    /// Entry of the estimated scale errors and misalignments of the IMU that is the largest relative to its model.
    pub imu_matrix: MatrixEntry,
    /// Speed of the IMU at the end of the window, m/s.
    pub speed_m_per_s: f64,
    /// Whether the head moves, so that surfaces should be matched.
    pub moving: bool,
    /// Whether the head rests at the end of the window, according to the IMU and the estimated speed.
    pub resting: bool,
    /// Whether the lidar would show a motion of a resting head.
    pub sees_rest: bool,
    /// Problem of the solution, if any.
    pub problem: Option<EventKind>,
    /// Run time, s. With its parts, the only value that differs between identical runs.
    pub elapsed_s: f64,
    /// Parts of the run time; their sum is slightly smaller.
    pub timing: Timing,
}

/// An open-loop estimate.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OpenLoop {
    /// `map_from_head` over lidar time, for each pose in `poses`.
    pub trajectory: Trajectory,
    /// The poses with velocity, biases and clock offset.
    pub poses: Vec<EstimatedPose>,
    /// Covariances of some poses during twice [`ALIGNMENT_S`] seconds from the start, relative to the alignment: m^2,
    /// m rad, rad^2.
    ///
    /// The alignment covers the first [`ALIGNMENT_S`] seconds, or half of a shorter run. Empty if the estimate
    /// restarted in this time.
    pub aligned_covariances: Vec<(Stamp, PoseCovariance)>,
    /// The clock offset after each window, s, positive if IMU stamps are later; over lidar time.
    pub clock_offsets: Vec<(Stamp, f64)>,
    /// Estimated corrections of the lidar calibration at the end, consistent with the poses.
    pub lidar: LidarCorrection,
    /// The same corrections in the axes of the IMU calibration.
    ///
    /// If the extrinsics are estimated, the poses refer to the gyroscope axes; this refers to the axes midway between
    /// those of gyroscope and accelerometer.
    pub calibrated_lidar: LidarCorrection,
    /// Result of the first localisation in the given map, if any.
    pub located: Option<LocalisedPose>,
    /// One report per window.
    pub windows: Vec<WindowReport>,
    /// Events that degraded the estimate.
    pub warnings: Vec<Event>,
    /// The observed surfaces, if requested.
    pub observed: ObservedSurfels,
}
