use crate::dynamics::DynamicsError;
use crate::motion::MotionError;
use crate::signal::SignalError;
use crate::spec::SpecError;

/// Why a study cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A spec is wrong.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// The head cannot be modelled, or its simulation failed.
    #[error(transparent)]
    Dynamics(#[from] DynamicsError),
    /// The motion cannot be built.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// What was recorded cannot be analysed.
    #[error(transparent)]
    Signal(#[from] SignalError),
    /// A plan whose numbers contradict each other.
    #[error("{what}: {message}")]
    Plan {
        /// Which number.
        what: &'static str,
        /// What is wrong with it, and what to do.
        message: String,
    },
}
