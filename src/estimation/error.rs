use std::fmt;
use zsim_base::geometry::{TrajectoryError, Vector};
use zsim_base::time::Stamp;

/// The reason why there is no estimate.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum EstimationError {
    /// A setting out of range, or inconsistent with another one.
    #[error("estimator setting `{key}`: {message}")]
    Setting {
        /// The key of the setting.
        key: &'static str,
        /// The error, and the valid values.
        message: String,
    },
    /// An invalid calibration.
    #[error("calibration: {0}")]
    Calibration(String),
    /// An invalid map, or maps that cannot be merged.
    #[error("map: {0}")]
    Map(String),
    /// Insufficient or inconsistent data for the base trajectory.
    #[error("base: {0}")]
    Base(String),
    /// Localisation in the map failed near the given start.
    #[error(
        "localisation in the map failed: {0}; the search covers 1 m and 20 degrees about the start; set the start with \
         `--start x,y,z,yaw` (m, degrees)"
    )]
    NotInMap(String),
    /// Estimated poses that are not finite or not in order of time.
    #[error("the estimated trajectory is invalid: {0}")]
    Trajectory(#[from] TrajectoryError),
    /// A measurement with NaN or infinite values.
    #[error("the {sensor} measurement stamped {stamp_ns} ns is not finite")]
    NotFinite {
        /// `"IMU"` or `"lidar"`.
        sensor: &'static str,
        /// Stamp of the measurement, ns.
        stamp_ns: i64,
    },
    /// A recording without IMU samples.
    #[error("the recording has {scans} lidar scans but no IMU samples; the estimator needs both")]
    NoImu {
        /// Number of scans.
        scans: usize,
    },
    /// A recording without lidar scans.
    #[error("the recording has {samples} IMU samples but no lidar scans; the estimator needs both")]
    NoLidar {
        /// Number of samples.
        samples: usize,
    },
    /// A recording whose lidar measures nothing.
    #[error(
        "none of the {scans} lidar scans has a usable return: ranges are missing, out of the limits of the lidar's model, or all equal; \
         look at the lidar's topic with `zsim info`, or give the model with --calibration"
    )]
    NoReturns {
        /// Number of scans.
        scans: usize,
    },
    /// Both sensors have data at the same time, but never long enough without a gap.
    #[error(
        "IMU and lidar have {common_s:.3} s in common, but never {needed_s:.3} s without a gap; look at the rates and gaps of both \
         topics with `zsim info`"
    )]
    Interrupted {
        /// Length of the overlap, s.
        common_s: f64,
        /// Required length, s.
        needed_s: f64,
    },
    /// The data of the two sensors overlap too little in time.
    #[error("IMU and lidar have {common_s:.3} s in common; at least {needed_s:.3} s are needed to start")]
    TooShort {
        /// Length of the overlap, s.
        common_s: f64,
        /// Required length, s.
        needed_s: f64,
    },
}

/// An event that degrades the estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Warning {
    /// Time of the event, lidar time.
    pub stamp: Stamp,
    /// Kind of event.
    pub kind: WarningKind,
}

/// Kinds of discarded measurements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Discarded {
    /// IMU samples that arrived late, or with decreasing stamps.
    LateSamples,
    /// Lidar scans that arrived late, or with decreasing stamps.
    LateScans,
    /// IMU samples that are outliers or not finite.
    Outliers,
    /// IMU samples that repeat the previous reading.
    RepeatedSamples,
    /// Lidar scans that repeat the previous scan while the head turns, or have the same range on all beams.
    RepeatedScans,
}

impl Discarded {
    /// A key for scripts.
    fn name(self) -> &'static str {
        match self {
            Self::LateSamples => "late_samples",
            Self::LateScans => "late_scans",
            Self::Outliers => "outliers",
            Self::RepeatedSamples => "repeated_samples",
            Self::RepeatedScans => "repeated_scans",
        }
    }
}

impl fmt::Display for Discarded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::LateSamples => "late IMU samples (or decreasing stamps)",
            Self::LateScans => "late lidar scans (or decreasing stamps)",
            Self::Outliers => "outliers among the IMU samples",
            Self::RepeatedSamples => "repeated IMU samples",
            Self::RepeatedScans => "repeated lidar scans (or scans of constant range)",
        })
    }
}

/// Kinds of events that degrade an estimate.
#[derive(Debug, Clone, PartialEq)]
pub enum WarningKind {
    /// The head moved at the start, so initial tilt and gyroscope bias are uncertain.
    StartedInMotion,
    /// The first window, at the start or after a gap, was inconsistent: it was discarded, and the estimate starts later.
    StartRejected {
        /// Last correction of its solution, m; after a gap the largest of this and the two windows before.
        correction_m: f64,
        /// Contradiction between IMU and lidar in it, as a multiple of the IMU noise.
        times: f64,
    },
    /// The noise measured at rest exceeds the specification by these factors, and is used instead.
    NoisyImu {
        /// Factor of the gyroscope noise, at least 1.
        gyro: f64,
        /// Factor of the accelerometer noise, at least 1.
        accel: f64,
    },
    /// An IMU gap, bridged by interpolation.
    ImuGap {
        /// Duration, s.
        seconds: f64,
    },
    /// A lidar gap, bridged by dead reckoning with the IMU.
    LidarGap {
        /// Duration, s.
        seconds: f64,
    },
    /// An IMU gap too long to bridge: the estimate restarted after it.
    Restarted {
        /// Length of the gap, s.
        seconds: f64,
    },
    /// Relocalisation after the gap succeeded.
    Relocalised {
        /// Distance from the position before the gap, m.
        distance_m: f64,
        /// Distance that the true position may be from the one found because another pose matches too, m.
        ambiguity_m: f64,
    },
    /// The data between two gaps, or after the last one, are too few to relocalise: they have no estimate.
    TooShortToRelocalise {
        /// Duration, s.
        seconds: f64,
    },
    /// Relocalisation after the gap failed: the motion during the gap is missing from the trajectory.
    NotRelocalised {
        /// Reason of the failure.
        why: String,
    },
    /// Discarded measurements.
    Discarded {
        /// Kind of measurements.
        what: Discarded,
        /// Number of measurements.
        count: usize,
    },
    /// Too few surfel matches: this window is dead reckoning with the IMU.
    FewMatches {
        /// Number of matches.
        matches: usize,
    },
    /// Degenerate geometry: the lidar does not constrain a direction, which is dead reckoning with the IMU.
    WeakGeometry {
        /// Smallest over largest eigenvalue of the position information, 0..1.
        conditioning: f64,
        /// The unconstrained direction, a unit vector in the map frame.
        direction_in_map: Vector,
    },
    /// Tracking was lost for a large part of the recording, with dead reckoning by the IMU only.
    Lost {
        /// Duration, s.
        seconds: f64,
        /// Length of the recording, s.
        of_seconds: f64,
    },
    /// IMU and lidar contradicted each other for a large part of the recording by more than the IMU noise.
    Contradicted {
        /// Median contradiction over that time, as a multiple of the IMU noise; 0.1 to 0.4 in a sound run.
        times: f64,
        /// Duration, s.
        seconds: f64,
        /// Length of the recording, s.
        of_seconds: f64,
    },
    /// The solution of a window was rejected and the IMU prediction used.
    NotSolved {
        /// Reason of the rejection.
        reason: &'static str,
    },
    /// Relocalisation in the map failed after a gap.
    LostInMap,
    /// Clipped IMU samples, at the end of the range of the sensor.
    Saturated {
        /// Number of clipped samples so far.
        samples: usize,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at {:.3} s: {}", self.stamp.nanos() as f64 * 1e-9, self.kind)
    }
}

impl WarningKind {
    /// Magnitude of the event, if it has one: s, m, number, or ratio; larger is worse.
    pub fn size(&self) -> Option<f64> {
        match self {
            Self::ImuGap { seconds } | Self::LidarGap { seconds } | Self::Restarted { seconds } => Some(*seconds),
            Self::Lost { seconds, .. } | Self::TooShortToRelocalise { seconds } => Some(*seconds),
            Self::Relocalised { distance_m, .. } => Some(*distance_m),
            Self::NoisyImu { gyro, accel } => Some(gyro.max(*accel)),
            Self::Discarded { count, .. } => Some(*count as f64),
            Self::Saturated { samples } => Some(*samples as f64),
            Self::Contradicted { times, .. } => Some(*times),
            Self::StartRejected { correction_m, .. } => Some(*correction_m),
            _ => None,
        }
    }

    /// A key for scripts.
    pub fn name(&self) -> &'static str {
        match self {
            Self::StartedInMotion => "started_in_motion",
            Self::StartRejected { .. } => "start_rejected",
            Self::NoisyImu { .. } => "noisy_imu",
            Self::ImuGap { .. } => "imu_gap",
            Self::LidarGap { .. } => "lidar_gap",
            Self::Restarted { .. } => "restarted",
            Self::Relocalised { .. } => "relocalised",
            Self::NotRelocalised { .. } => "not_relocalised",
            Self::TooShortToRelocalise { .. } => "too_short_to_relocalise",
            Self::Discarded { what, .. } => what.name(),
            Self::FewMatches { .. } => "few_matches",
            Self::WeakGeometry { .. } => "weak_geometry",
            Self::Lost { .. } => "lost",
            Self::Contradicted { .. } => "contradiction",
            Self::NotSolved { .. } => "not_solved",
            Self::LostInMap => "lost_in_map",
            Self::Saturated { .. } => "clipped",
        }
    }
}

/// Text for a direction in the map frame.
fn direction_text(direction: &Vector) -> String {
    if direction.z.abs() > 0.9 {
        return "z".to_owned();
    }
    // Its sign is arbitrary: the largest component is positive, and 0 has no sign.
    let largest = direction[direction.iamax()];
    let [x, y, z] =
        [direction.x, direction.y, direction.z].map(|part| (part * largest.signum() * 100.0).round() / 100.0 + 0.0);
    format!("({x:.2}, {y:.2}, {z:.2})")
}

/// Text for a conditioning.
fn conditioning_text(conditioning: f64) -> String {
    if conditioning == 0.0 { "0".to_owned() } else { format!("{conditioning:.1e}") }
}

/// Text for a rejected start.
fn start_text(correction_m: f64, times: f64) -> String {
    let mm = 1e3 * correction_m;
    format!(
        "the first window, at the start or after a gap, is inconsistent (last correction {mm:.0} mm, IMU and lidar contradict each \
         other by {times:.1} times the IMU noise): discarded, the estimate starts later"
    )
}

impl fmt::Display for WarningKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::StartedInMotion => {
                write!(f, "the head moved at the start; initial tilt and gyroscope bias are uncertain")
            }
            Self::StartRejected { correction_m, times } => f.write_str(&start_text(*correction_m, *times)),
            Self::Lost { seconds, of_seconds } => write!(
                f,
                "tracking lost for {seconds:.0} of {of_seconds:.0} s (too few matched surfaces); trajectory unreliable"
            ),
            Self::Contradicted { times, seconds, of_seconds } => write!(
                f,
                "IMU and lidar contradict each other for {seconds:.0} of {of_seconds:.0} s, by {times:.1} times the IMU noise \
                 (0.1 to 0.4 is usual); check the extrinsics, the units and signs of the IMU, and the beam times"
            ),
            Self::NoisyImu { gyro, accel } => write!(
                f,
                "the IMU noise at rest is {gyro:.1} (gyroscope) and {accel:.1} (accelerometer) times that of the model; the \
                 measured noise is used"
            ),
            Self::ImuGap { seconds } => {
                write!(f, "no IMU sample for {seconds:.3} s; bridged by interpolation")
            }
            Self::LidarGap { seconds } => write!(f, "no lidar scan for {seconds:.3} s; dead reckoning with the IMU"),
            Self::Restarted { seconds } => {
                write!(f, "no IMU sample for {seconds:.3} s, too long to bridge; re-initialised after the gap")
            }
            Self::Relocalised { distance_m, ambiguity_m } => write!(
                f,
                "relocalised after the IMU gap, {distance_m:.2} m from the position before it; similar surfaces leave the \
                 position uncertain by {ambiguity_m:.2} m"
            ),
            Self::TooShortToRelocalise { seconds } => {
                write!(f, "{seconds:.1} s after an IMU gap are too short to relocalise; they have no estimate")
            }
            Self::NotRelocalised { why } => write!(
                f,
                "relocalisation failed after the IMU gap ({why}); the motion during the gap is missing from the trajectory"
            ),
            Self::Discarded { what, count } => write!(f, "discarded {count} {what}"),
            Self::FewMatches { matches } => {
                write!(f, "only {matches} surfel matches; dead reckoning with the IMU")
            }
            Self::WeakGeometry { conditioning, direction_in_map } => write!(
                f,
                "degenerate geometry: the lidar does not constrain {} in the map frame (conditioning {}); dead \
                 reckoning with the IMU along it",
                direction_text(direction_in_map),
                conditioning_text(*conditioning)
            ),
            Self::NotSolved { reason } => write!(f, "window solution rejected ({reason}); IMU prediction used"),
            Self::LostInMap => {
                write!(f, "relocalisation in the map failed after the gap; continuing without the map")
            }
            Self::Saturated { samples } => write!(
                f,
                "{samples} saturated IMU samples so far; check the units (rad/s, m/s^2), and the range in the calibration \
                 (`gyro_limit_rad_per_s`, `accel_limit_m_per_s2`)"
            ),
        }
    }
}
