//! Errors of the library as Python exceptions, with the sentences of the library.

use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use zsim::dynamics::DynamicsError;
use zsim::estimation::EstimationError;
use zsim::evaluation::EvaluationError;
use zsim::geometry::TrajectoryError;
use zsim::head::HeadError;
use zsim::recording::RecordingError;
use zsim::run::RunError;
use zsim::simulation::SimulationError;
use zsim::spec::SpecError;
use zsim::study::StudyError;

create_exception!(zsim, Error, PyException, "A computation failed.");
create_exception!(zsim, InputError, Error, "An argument, a scene or a spec is invalid.");

/// A Python exception that the library's errors convert to.
pub struct Failure(PyErr);

impl Failure {
    /// An invalid argument.
    pub fn input(message: impl Into<String>) -> Self {
        Self(InputError::new_err(message.into()))
    }

    /// A failed computation.
    pub fn other(message: impl Into<String>) -> Self {
        Self(Error::new_err(message.into()))
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        failure.0
    }
}

impl From<PyErr> for Failure {
    fn from(error: PyErr) -> Self {
        Self(error)
    }
}

/// The error's sentence and those of its causes, a line each.
fn sentences(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        // A transparent error repeats the text of the cause.
        if !text.contains(&error.to_string()) {
            text += &format!("\n  because: {error}");
        }
        cause = error.source();
    }
    text
}

/// Errors that know whether the input is invalid.
macro_rules! judged {
    ($($error:ty),+) => {
        $(impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                if error.is_invalid_input() { Self::input(sentences(&error)) } else { Self::other(sentences(&error)) }
            }
        })+
    };
}

judged!(RunError, HeadError, StudyError);

/// Errors of the rooms below a run.
macro_rules! of_run {
    ($($error:ty),+) => {
        $(impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                RunError::from(error).into()
            }
        })+
    };
}

of_run!(SimulationError, EstimationError, DynamicsError, SpecError);

impl From<RecordingError> for Failure {
    fn from(error: RecordingError) -> Self {
        Self::other(sentences(&error))
    }
}

impl From<EvaluationError> for Failure {
    fn from(error: EvaluationError) -> Self {
        Self::other(sentences(&error))
    }
}

impl From<TrajectoryError> for Failure {
    fn from(error: TrajectoryError) -> Self {
        Self::input(sentences(&error))
    }
}

impl From<serde_json::Error> for Failure {
    fn from(error: serde_json::Error) -> Self {
        Self::other(sentences(&error))
    }
}
