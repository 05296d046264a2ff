/// Why an estimate cannot be judged.
#[derive(Debug, Clone, thiserror::Error, PartialEq)]
pub enum EvaluationError {
    /// No pose of the estimate is within the time of the truth.
    #[error(
        "the estimate ({estimate}) and the truth ({truth}) do not overlap in time, or only within a gap; use one clock for both"
    )]
    NothingInCommon {
        /// The estimate's span, for people.
        estimate: String,
        /// The truth's span, for people.
        truth: String,
    },
    /// Too few pairs of poses to align.
    #[error("{pairs} poses have a matching true pose; a rigid alignment needs at least 3")]
    TooFew {
        /// How many there are.
        pairs: usize,
    },
    /// All positions lie on a line or in a point, which leaves a turn about it open.
    #[error("the positions lie on a line or in a point, so that no rigid alignment by positions is determined")]
    OnALine,
    /// The trajectory is too short for the measure.
    #[error("{measure} needs {needed_s} s of trajectory, and there are {found_s:.3} s")]
    TooShort {
        /// The measure.
        measure: &'static str,
        /// Required length, s.
        needed_s: f64,
        /// Actual length, s.
        found_s: f64,
    },
    /// The path is too short for a relative error over a length.
    #[error("the relative error needs {needed_m} m of path, and there are {found_m:.3} m")]
    PathTooShort {
        /// Required length, m.
        needed_m: f64,
        /// Actual length, m.
        found_m: f64,
    },
    /// Sums over the poses overflow.
    #[error("the errors of the estimate are not finite: check the unit of its positions")]
    NotFinite,
    /// The trajectory is too long for the measure.
    #[error(
        "{measure} is limited to {limit_s} s of trajectory, and there are {found_s:.0} s; use a part of the recording"
    )]
    TooLong {
        /// The measure.
        measure: &'static str,
        /// Maximum length, s.
        limit_s: f64,
        /// Actual length, s.
        found_s: f64,
    },
    /// The information matrix of a measure cannot be inverted.
    #[error("{measure}: the information is singular; check the noise of the sensors in the calibration")]
    Singular {
        /// The measure.
        measure: &'static str,
    },
    /// The IMU never rested long enough to find down and the gyroscope's bias.
    #[error("the IMU rests for {found_s:.3} s at the start; dead reckoning needs {needed_s} s of rest")]
    NoRest {
        /// Required length, s.
        needed_s: f64,
        /// Actual length, s.
        found_s: f64,
    },
}
