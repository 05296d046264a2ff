use std::path::{Path, PathBuf};
use zsim_base::signal::SignalError;
use zsim_base::spec::SpecError;
use zsim_dynamics::DynamicsError;
use zsim_estimation::EstimationError;
use zsim_evaluation::EvaluationError;
use zsim_motion::MotionError;
use zsim_recording::RecordingError;
use zsim_report::plot::PlotError;
use zsim_simulation::SimulationError;
use zsim_world::WorldError;

/// Error of an experiment.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
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
    /// The head cannot be modelled, or its simulation failed.
    #[error(transparent)]
    Dynamics(Box<DynamicsError>),
    /// The motion cannot be built.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// A recorded signal cannot be analysed.
    #[error(transparent)]
    Signal(#[from] SignalError),
    /// A YAML calibration is invalid.
    #[error("{name}: {problem}")]
    Calibration {
        /// Name of the file.
        name: String,
        /// The problem.
        problem: String,
    },
    /// The settings of an experiment are inconsistent or cannot be met.
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
    /// The metrics could not be written as JSON.
    #[error("the metrics cannot be written as JSON: {0}")]
    Figures(#[from] serde_json::Error),
    /// A file or folder could not be read, created or written.
    #[error("{}: {source}", path.display())]
    File {
        /// Path of the file or folder.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A table is damaged.
    #[error("{}: {message}", path.display())]
    Table {
        /// Path of the table.
        path: PathBuf,
        /// The problem.
        message: String,
    },
    /// A run of a sweep exceeded the time limit.
    #[error("took longer than {time_s} s")]
    TooLong {
        /// Time limit, s.
        time_s: f64,
    },
    /// A worker process failed.
    #[error("a worker process failed: {message}")]
    Worker {
        /// Error message of the process.
        message: String,
    },
    /// The thread pool could not be created.
    #[error("cannot start the worker threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// The output folder has files that do not belong to this experiment, so that it cannot be resumed there.
    #[error(
        "{} contains files of another experiment (different spec, extent or version, or unrelated files): pass another \
         folder with --out, or restart with --force if the folder was written by zsim",
        folder.display()
    )]
    FolderMismatch {
        /// The output folder.
        folder: PathBuf,
    },
    /// The experiment was stopped.
    #[error("stopped; completed files can be read")]
    Stopped,
}

impl From<WorldError> for StudyError {
    fn from(error: WorldError) -> Self {
        SimulationError::from(error).into()
    }
}

impl From<DynamicsError> for StudyError {
    fn from(error: DynamicsError) -> Self {
        Self::Dynamics(Box::new(error))
    }
}

impl StudyError {
    pub(super) fn file(path: &Path) -> impl FnOnce(std::io::Error) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self::File { path, source }
    }

    pub(super) fn table(path: &Path) -> impl FnOnce(String) -> Self + use<> {
        let path = path.to_owned();
        move |message| Self::Table { path, message }
    }

    /// Whether the input is invalid (a spec, a setting), as opposed to a failure during the run.
    pub fn is_invalid_input(&self) -> bool {
        match self {
            Self::Spec(_) | Self::Motion(_) | Self::Plan { .. } | Self::FolderMismatch { .. } => true,
            Self::Dynamics(error) => !matches!(**error, DynamicsError::Diverged { .. }),
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
