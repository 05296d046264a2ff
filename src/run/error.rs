use zsim_base::files::FileError;
use zsim_base::parallel::Stopped;
use zsim_base::spec::SpecError;
use zsim_dynamics::DynamicsError;
use zsim_estimation::EstimationError;
use zsim_evaluation::EvaluationError;
use zsim_head::HeadError;
use zsim_recording::RecordingError;
use zsim_report::plot::PlotError;
use zsim_simulation::SimulationError;
use zsim_world::WorldError;

/// Error of a run.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The simulation failed at the start or during the run.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// A file could not be written or read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// An estimate or a run cannot be evaluated.
    #[error(transparent)]
    Evaluation(#[from] EvaluationError),
    /// The estimation failed.
    #[error(transparent)]
    Estimation(#[from] EstimationError),
    /// A spec is missing or invalid.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// A YAML calibration is invalid.
    #[error("{name}: {problem}")]
    Calibration {
        /// Name of the file.
        name: String,
        /// The problem.
        problem: String,
    },
    /// The settings of a run are inconsistent or cannot be met.
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
    /// Figures could not be written as JSON.
    #[error("the figures cannot be written as JSON: {0}")]
    Figures(#[from] serde_json::Error),
    /// A file or folder could not be read, created or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A run exceeded its time limit.
    #[error("took longer than {time_s} s")]
    TooLong {
        /// Time limit, s.
        time_s: f64,
    },
    /// The thread pool could not be created.
    #[error("cannot start the worker threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// A study of the head of the run failed.
    #[error(transparent)]
    Head(#[from] HeadError),
    /// The run was stopped.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl From<DynamicsError> for RunError {
    fn from(error: DynamicsError) -> Self {
        HeadError::from(error).into()
    }
}

impl From<WorldError> for RunError {
    fn from(error: WorldError) -> Self {
        SimulationError::from(error).into()
    }
}

impl RunError {
    /// Whether the input is invalid (a spec, a setting), as opposed to a failure during the run.
    pub fn is_invalid_input(&self) -> bool {
        match self {
            Self::Spec(_) | Self::Plan { .. } => true,
            Self::Head(error) => error.is_invalid_input(),
            Self::Estimation(error) => {
                matches!(error, EstimationError::Setting { .. } | EstimationError::Calibration(_))
            }
            Self::Simulation(error) => {
                let failed = match error {
                    SimulationError::Dynamics(error) => matches!(**error, DynamicsError::Diverged { .. }),
                    SimulationError::Sink(_) => true,
                    _ => false,
                };
                !failed
            }
            _ => false,
        }
    }
}
