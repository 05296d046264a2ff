/// Why an estimate cannot be judged.
#[derive(Debug, Clone, thiserror::Error, PartialEq)]
pub enum EvaluationError {
    /// No pose of the estimate lies within the truth's time.
    #[error(
        "the estimate ({estimate}) and the truth ({truth}) have no instant in common; both must be stamped by the same clock"
    )]
    NothingInCommon {
        /// The estimate's span, for people.
        estimate: String,
        /// The truth's span, for people.
        truth: String,
    },
    /// Too few pairs of poses to align.
    #[error("{pairs} poses have a true one beside them; a rigid alignment needs at least 3")]
    TooFew {
        /// How many there are.
        pairs: usize,
    },
    /// All positions lie on a line or in a point, which leaves a turn about it open.
    #[error("the positions lie on a line or in a point, so that no rigid alignment by positions is determined")]
    OnALine,
    /// The trajectory is too short for the measure.
    #[error("{what} needs {needed_s} s of trajectory, and there are {found_s:.3} s")]
    TooShort {
        /// The measure.
        what: &'static str,
        /// What it needs, s.
        needed_s: f64,
        /// What there is, s.
        found_s: f64,
    },
    /// The IMU never rested long enough to find down and the gyroscope's bias.
    #[error("the IMU rests for {found_s:.3} s at the start; dead reckoning needs {needed_s} s of rest")]
    NoRest {
        /// What it needs, s.
        needed_s: f64,
        /// What there is, s.
        found_s: f64,
    },
}
