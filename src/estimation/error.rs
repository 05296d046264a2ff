use crate::geometry::Vector;
use crate::time::Stamp;
use std::fmt;

/// Why there is no estimate.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum EstimationError {
    /// A setting that makes no sense by itself or beside another.
    #[error("estimator setting `{key}`: {message}")]
    Setting {
        /// Which setting.
        key: &'static str,
        /// What is wrong with it.
        message: String,
    },
    /// A calibration that nothing can be computed with.
    #[error("calibration: {0}")]
    Calibration(String),
    /// What makes no map, or maps that cannot be put together.
    #[error("map: {0}")]
    Map(String),
    /// A base that nothing can be said of.
    #[error("base: {0}")]
    Base(String),
    /// The head, or another map, is not where in the map it was said to be.
    #[error(
        "not found in the map: {0}; it is looked for within a metre and twenty degrees of a start, which `--start x,y,z,yaw` \
         gives (m, degrees)"
    )]
    NotInMap(String),
    /// A measurement with NaN or infinity in it.
    #[error("the {sensor} measurement stamped {stamp_ns} ns is not finite")]
    NotFinite {
        /// `"IMU"` or `"lidar"`.
        sensor: &'static str,
        /// Its stamp.
        stamp_ns: i64,
    },
    /// A recording without IMU samples.
    #[error("there is no IMU sample among {scans} lidar scans; the estimator needs both")]
    NoImu {
        /// How many scans there were.
        scans: usize,
    },
    /// A recording without lidar scans.
    #[error("there is no lidar scan among {samples} IMU samples; the estimator needs both")]
    NoLidar {
        /// How many samples there were.
        samples: usize,
    },
    /// The two sensors never spoke in the same seconds.
    #[error("IMU and lidar have {common_s:.3} s in common; at least {needed_s:.3} s are needed to start")]
    TooShort {
        /// The time both cover, s.
        common_s: f64,
        /// What is needed, s.
        needed_s: f64,
    },
}

/// A stretch of the estimate that is worse than it should be, or missing, and why.
#[derive(Debug, Clone, PartialEq)]
pub struct Warning {
    /// When, lidar time.
    pub stamp: Stamp,
    /// What happened.
    pub kind: WarningKind,
}

/// Measurements that are not used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LeftOut {
    /// IMU samples that came late, or whose stamp runs backwards.
    LateSamples,
    /// Lidar scans that came late, or whose stamp runs backwards.
    LateScans,
    /// IMU samples that are far from their neighbours, or not finite.
    Outliers,
    /// IMU samples that repeat the reading before them.
    RepeatedSamples,
    /// Lidar scans that repeat the scan before them while the head turns, or have one range on all beams.
    RepeatedScans,
}

impl LeftOut {
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

impl fmt::Display for LeftOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::LateSamples => "IMU samples that came late or ran backwards in time",
            Self::LateScans => "lidar scans that came late or ran backwards in time",
            Self::Outliers => "IMU samples that are outliers",
            Self::RepeatedSamples => "IMU samples that repeat the reading before them",
            Self::RepeatedScans => "lidar scans that repeat the scan before them, or have one range on all beams",
        })
    }
}

/// What can degrade an estimate.
#[derive(Debug, Clone, PartialEq)]
pub enum WarningKind {
    /// The estimator started while the head moved, so level and gyro bias began less well known.
    StartedInMotion,
    /// At rest the IMU is noisier than it was told, by these factors, and taken for so noisy.
    NoisyImu {
        /// Of the gyroscope's noise, 1 or more.
        gyro: f64,
        /// Of the accelerometer's.
        accel: f64,
    },
    /// No IMU sample for `seconds`; the motion was bridged.
    ImuGap {
        /// How long, s.
        seconds: f64,
    },
    /// No lidar scan for `seconds`; the IMU alone carried the estimate.
    LidarGap {
        /// How long, s.
        seconds: f64,
    },
    /// No IMU sample for `seconds`, too long to bridge: the estimate began again behind it.
    BeganAgain {
        /// How long the gap was, s.
        seconds: f64,
    },
    /// Behind the silence the head was found again in what was seen before it.
    FoundAgain {
        /// How far from where it had stopped, m.
        away_m: f64,
    },
    /// It was not: the estimate goes on about where it had stopped, and what the head did meanwhile is missing from it.
    LostAgain {
        /// Why it was not.
        why: String,
    },
    /// Measurements that were left out.
    LeftOut {
        /// Which ones.
        what: LeftOut,
        /// How many.
        count: usize,
    },
    /// Too few matches to say anything against the IMU, which alone carried this window.
    FewMatches {
        /// How many there were.
        matches: usize,
    },
    /// The surfaces in view leave a direction undetermined; the IMU held it.
    WeakGeometry {
        /// Least over greatest information about the position, 0..1.
        conditioning: f64,
        /// The direction, a unit vector in the map.
        direction_in_map: Vector,
    },
    /// For much of the time too little was seen again to hold the head, which the IMU alone carried: it is lost.
    Lost {
        /// How long, s.
        seconds: f64,
        /// Of how long, s.
        of_seconds: f64,
    },
    /// For much of the time the IMU was farther from what the lidar saw than its noise has it.
    Contradicted {
        /// How many times as far, in the median over that time; 0.1 to 0.4 where all is well.
        times: f64,
        /// How long, s.
        seconds: f64,
        /// Of how long, s.
        of_seconds: f64,
    },
    /// A window's solution was not believed, and the IMU's prediction kept.
    NotSolved {
        /// Why.
        reason: &'static str,
    },
    /// After a silence the head was not found again in the map.
    LostInMap,
    /// IMU samples at the end of the sensor's range, which say only "at least".
    Saturated {
        /// How many so far.
        samples: usize,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at {:.3} s: {}", self.stamp.nanos() as f64 * 1e-9, self.kind)
    }
}

impl WarningKind {
    /// How large it is, where that can be said: s, samples, or a ratio; the larger, the worse.
    pub fn size(&self) -> Option<f64> {
        match self {
            Self::ImuGap { seconds } | Self::LidarGap { seconds } | Self::BeganAgain { seconds } => Some(*seconds),
            Self::Lost { seconds, .. } => Some(*seconds),
            Self::FoundAgain { away_m } => Some(*away_m),
            Self::NoisyImu { gyro, accel } => Some(gyro.max(*accel)),
            Self::LeftOut { count, .. } => Some(*count as f64),
            Self::Saturated { samples } => Some(*samples as f64),
            Self::Contradicted { times, .. } => Some(*times),
            _ => None,
        }
    }

    /// A key for scripts.
    pub fn name(&self) -> &'static str {
        match self {
            Self::StartedInMotion => "started_in_motion",
            Self::NoisyImu { .. } => "noisy_imu",
            Self::ImuGap { .. } => "imu_gap",
            Self::LidarGap { .. } => "lidar_gap",
            Self::BeganAgain { .. } => "restarted",
            Self::FoundAgain { .. } => "relocalised",
            Self::LostAgain { .. } => "not_relocalised",
            Self::LeftOut { what, .. } => what.name(),
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

/// A direction in words.
fn named(direction: &Vector) -> String {
    if direction.z.abs() > 0.9 {
        return "the vertical".to_owned();
    }
    format!("({:.2}, {:.2}, {:.2})", direction.x, direction.y, direction.z)
}

impl fmt::Display for WarningKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::StartedInMotion => write!(f, "the head moved at the start; level and gyro bias start less certain"),
            Self::Lost { seconds, of_seconds } => write!(
                f,
                "in {seconds:.0} of {of_seconds:.0} s too little was seen again to hold the head, and the IMU alone carried \
                 it: do not trust this trajectory"
            ),
            Self::Contradicted { times, seconds, of_seconds } => write!(
                f,
                "in {seconds:.0} of {of_seconds:.0} s the IMU contradicts what the lidar saw, by {times:.1} times its noise (0.1 \
                 to 0.4 are usual): where the sensors sit, the IMU's units and signs, or the times of beams may not be what \
                 was told"
            ),
            Self::NoisyImu { gyro, accel } => write!(
                f,
                "at rest the IMU is noisier than it was told, the gyroscope {gyro:.1} and the accelerometer {accel:.1} times, \
                 and is taken for that"
            ),
            Self::ImuGap { seconds } => {
                write!(f, "no IMU sample for {seconds:.3} s; bridged by how the head moved before and behind")
            }
            Self::LidarGap { seconds } => write!(f, "no lidar scan for {seconds:.3} s; carried by the IMU alone"),
            Self::BeganAgain { seconds } => {
                write!(f, "no IMU sample for {seconds:.3} s, too long to bridge; began again behind it")
            }
            Self::FoundAgain { away_m } => write!(
                f,
                "behind the silence the head was found again in what was seen before, {away_m:.2} m from where it had stopped"
            ),
            Self::LostAgain { why } => write!(
                f,
                "behind the silence the head was not found again in what was seen before ({why}); it goes on about where it \
                 had stopped, so what it did meanwhile is missing"
            ),
            Self::LeftOut { what, count } => write!(f, "left out: {count} {what}"),
            Self::FewMatches { matches } => {
                write!(f, "only {matches} surfaces seen again; carried by the IMU alone")
            }
            Self::WeakGeometry { conditioning, direction_in_map } => write!(
                f,
                "the surfaces in view say next to nothing of the motion along {} of the map (conditioning \
                 {conditioning:.1e}); the IMU alone holds it",
                named(direction_in_map)
            ),
            Self::NotSolved { reason } => write!(f, "the window's solution was not believed ({reason})"),
            Self::LostInMap => {
                write!(f, "behind the silence the head was not found again in the map; it goes on without it")
            }
            Self::Saturated { samples } => write!(
                f,
                "{samples} IMU samples so far at the end of the sensor's range (read as rad/s and m/s^2; the calibration's \
                 `gyro_limit_rad_per_s` and `accel_limit_m_per_s2` tell the range)"
            ),
        }
    }
}
