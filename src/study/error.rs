use std::path::{Path, PathBuf};
use zsim_base::files::FileError;
use zsim_base::parallel::Stopped;
use zsim_base::spec::SpecError;
use zsim_dynamics::DynamicsError;
use zsim_estimation::EstimationError;
use zsim_evaluation::EvaluationError;
use zsim_head::HeadError;
use zsim_motion::MotionError;
use zsim_recording::RecordingError;
use zsim_report::plot::PlotError;
use zsim_run::RunError;
use zsim_simulation::SimulationError;
use zsim_world::WorldError;

/// Error of a study.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A run failed: its simulation, estimate or evaluation, or the writing of its files.
    #[error(transparent)]
    Run(RunError),
    /// A study of a head failed.
    #[error(transparent)]
    Head(HeadError),
    /// A spec is missing or invalid.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// The study was stopped.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The settings of a study are inconsistent or cannot be met.
    #[error("{what}: {message}")]
    Plan {
        /// Name of the setting.
        what: &'static str,
        /// The problem, and what to do.
        message: String,
    },
    /// A table is damaged.
    #[error("{}: {message}", path.display())]
    Table {
        /// Path of the table.
        path: PathBuf,
        /// The problem.
        message: String,
    },
    /// A worker process failed.
    #[error("a worker process failed: {message}")]
    Worker {
        /// Error message of the process.
        message: String,
    },
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
}

impl From<RunError> for StudyError {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Spec(error) => Self::Spec(error),
            RunError::Stopped(stopped) => Self::Stopped(stopped),
            RunError::Head(error) => error.into(),
            error => Self::Run(error),
        }
    }
}

impl From<HeadError> for StudyError {
    fn from(error: HeadError) -> Self {
        match error {
            HeadError::Spec(error) => Self::Spec(error),
            HeadError::Stopped(stopped) => Self::Stopped(stopped),
            error => Self::Head(error),
        }
    }
}

/// Errors of the rooms below become those of a run or of a head.
macro_rules! from_below {
    ($($below:ty => $room:ty),+ $(,)?) => {
        $(impl From<$below> for StudyError {
            fn from(error: $below) -> Self {
                <$room>::from(error).into()
            }
        })+
    };
}

from_below! {
    WorldError => RunError,
    SimulationError => RunError,
    RecordingError => RunError,
    EvaluationError => RunError,
    EstimationError => RunError,
    FileError => RunError,
    PlotError => RunError,
    serde_json::Error => RunError,
    rayon::ThreadPoolBuildError => RunError,
    DynamicsError => HeadError,
    MotionError => HeadError,
}

impl StudyError {
    pub(super) fn table(path: &Path) -> impl FnOnce(String) -> Self + use<> {
        let path = path.to_owned();
        move |message| Self::Table { path, message }
    }

    /// Whether the study was stopped on request.
    pub fn is_stopped(&self) -> bool {
        matches!(self, Self::Stopped(_))
    }

    /// Whether the input is invalid (a spec, a setting), as opposed to a failure during the run.
    pub fn is_invalid_input(&self) -> bool {
        match self {
            Self::Spec(_) | Self::Plan { .. } | Self::FolderMismatch { .. } => true,
            Self::Run(error) => error.is_invalid_input(),
            Self::Head(error) => error.is_invalid_input(),
            _ => false,
        }
    }
}
