use crate::dynamics::DynamicsError;
use crate::estimation::EstimationError;
use crate::evaluation::EvaluationError;
use crate::motion::MotionError;
use crate::recording::RecordingError;
use crate::report::plot::PlotError;
use crate::signal::SignalError;
use crate::simulation::SimulationError;
use crate::spec::SpecError;
use parquet::errors::ParquetError;
use std::path::{Path, PathBuf};

/// Why an experiment did not come to its end.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The simulation could not begin, or go on.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// A file could not be written or read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// An estimate, or a run, cannot be judged.
    #[error(transparent)]
    Evaluation(#[from] EvaluationError),
    /// There is no estimate.
    #[error(transparent)]
    Estimation(#[from] EstimationError),
    /// A spec is missing or wrong.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// The head cannot be modelled, or its simulation failed.
    #[error(transparent)]
    Dynamics(Box<DynamicsError>),
    /// The motion cannot be built.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// What was recorded cannot be analysed.
    #[error(transparent)]
    Signal(#[from] SignalError),
    /// A calibration in YAML that cannot be used.
    #[error("{name}: {problem}")]
    Calibration {
        /// Which file.
        name: String,
        /// What is wrong.
        problem: String,
    },
    /// A plan whose numbers contradict each other.
    #[error("{what}: {message}")]
    Plan {
        /// Which number.
        what: &'static str,
        /// What is wrong with it, and what to do.
        message: String,
    },
    /// A plot could not be drawn.
    #[error(transparent)]
    Plot(#[from] PlotError),
    /// The figures could not be written as JSON.
    #[error("the figures cannot be written: {0}")]
    Figures(#[from] serde_json::Error),
    /// A file or folder could not be made.
    #[error("{}: {source}", path.display())]
    File {
        /// Which one.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A table could not be written or read.
    #[error("{}: {source}", path.display())]
    Table {
        /// Which one.
        path: PathBuf,
        /// What is wrong with it.
        source: Box<ParquetError>,
    },
    /// A run of a sweep took longer than it may.
    #[error("took longer than {time_s} s")]
    TooLong {
        /// What it may take, s.
        time_s: f64,
    },
    /// A process that was to do a part of the work could not.
    #[error("a worker could not work: {message}")]
    Worker {
        /// What it said.
        message: String,
    },
    /// There is no thread to work on.
    #[error("a thread could not be begun: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// A folder holds something else than the beginning of the work that was to go on in it.
    #[error(
        "{} holds other work than this (another spec, extent or version, or somebody's files): give another folder with \
         --out, or begin anew in one of ours with --force",
        folder.display()
    )]
    OtherWork {
        /// Which folder.
        folder: PathBuf,
    },
    /// Somebody stopped it.
    #[error("stopped; what is complete can be read")]
    Stopped,
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

    pub(super) fn table(path: &Path) -> impl FnOnce(ParquetError) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self::Table { path, source: Box::new(source) }
    }

    /// Whether what was asked for is wrong (a spec, a setting), rather than something on the way.
    pub fn is_wrong_input(&self) -> bool {
        match self {
            Self::Spec(_) | Self::Motion(_) | Self::Plan { .. } | Self::OtherWork { .. } => true,
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
