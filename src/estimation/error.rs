use zsim_base::geometry::TrajectoryError;

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
    #[error("localisation in the map failed: {0}")]
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
