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
    Run(#[from] RunError),
    /// A study of a head failed.
    #[error(transparent)]
    Head(#[from] HeadError),
    /// A spec is missing or invalid.
    #[error(transparent)]
    Spec(#[from] SpecError),
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
    /// Figures could not be written as JSON.
    #[error("the figures cannot be written as JSON: {0}")]
    Figures(#[from] serde_json::Error),
    /// A file or folder could not be read, created or written.
    #[error(transparent)]
    File(#[from] FileError),
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
    /// The study was stopped.
    #[error(transparent)]
    Stopped(#[from] Stopped),
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
        matches!(self, Self::Stopped(_) | Self::Run(RunError::Stopped(_)) | Self::Head(HeadError::Stopped(_)))
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
