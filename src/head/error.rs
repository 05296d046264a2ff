use zsim_base::parallel::Stopped;
use zsim_base::signal::SignalError;
use zsim_base::spec::SpecError;
use zsim_dynamics::DynamicsError;
use zsim_motion::MotionError;
use zsim_report::plot::PlotError;

/// Error of a study of a head.
#[derive(Debug, thiserror::Error)]
pub enum HeadError {
    /// A spec is invalid.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// The head cannot be modelled, or its simulation failed.
    #[error(transparent)]
    Dynamics(Box<DynamicsError>),
    /// The motion cannot be built.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// A recorded signal cannot be analysed.
    #[error(transparent)]
    Signal(#[from] SignalError),
    /// The settings of a study are inconsistent or cannot be met.
    #[error("{what}: {message}")]
    Plan {
        /// Name of the setting.
        what: &'static str,
        /// The problem, and what to do.
        message: String,
    },
    /// A plot could not be drawn.
    #[error(transparent)]
    Plot(#[from] PlotError),
    /// The study was stopped.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl From<DynamicsError> for HeadError {
    fn from(error: DynamicsError) -> Self {
        Self::Dynamics(Box::new(error))
    }
}

impl HeadError {
    /// Whether the input is invalid (a spec, a setting), as opposed to a failure during the run.
    pub fn is_invalid_input(&self) -> bool {
        match self {
            Self::Spec(_) | Self::Motion(_) | Self::Plan { .. } => true,
            Self::Dynamics(error) => !matches!(**error, DynamicsError::Diverged { .. }),
            _ => false,
        }
    }
}
