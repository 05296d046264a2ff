//! Error output and exit codes.

use super::message;
use super::signals;
use super::usage::Usage;
use std::error::Error;
use std::process::ExitCode;
use zsim_base::parallel::Stopped;
use zsim_base::spec::SpecError;
use zsim_head::HeadError;
use zsim_motion::MotionError;
use zsim_run::RunError;
use zsim_simulation::SimulationError;
use zsim_study::StudyError;
use zsim_world::WorldError;

/// Prints the error with its causes and returns the exit code: that of the signal that stopped the run, 2 for invalid
/// usage or input, else 1.
pub(super) fn report(error: &anyhow::Error) -> ExitCode {
    let mut text = error.to_string();
    message::error(&text);
    for cause in error.chain().skip(1).map(ToString::to_string) {
        // A transparent error repeats the text of the cause.
        if !text.contains(&cause) {
            message::line(&format!("  because: {cause}"));
        }
        text = cause;
    }
    if error.chain().any(is_stopped) {
        return ExitCode::from(signals::exit_code());
    }
    if error.chain().any(is_invalid_input) { ExitCode::from(2) } else { ExitCode::FAILURE }
}

fn is_stopped(error: &(dyn Error + 'static)) -> bool {
    error.is::<Stopped>()
        || matches!(error.downcast_ref(), Some(RunError::Stopped(_)))
        || matches!(error.downcast_ref(), Some(HeadError::Stopped(_)))
        || error.downcast_ref::<StudyError>().is_some_and(StudyError::is_stopped)
}

fn is_invalid_input(error: &(dyn Error + 'static)) -> bool {
    let simulation = |error: &SimulationError| !matches!(error, SimulationError::Sink(_));
    error.is::<SpecError>()
        || error.is::<WorldError>()
        || error.is::<MotionError>()
        || error.is::<Usage>()
        || error.downcast_ref::<SimulationError>().is_some_and(simulation)
        || error.downcast_ref::<RunError>().is_some_and(RunError::is_invalid_input)
        || error.downcast_ref::<HeadError>().is_some_and(HeadError::is_invalid_input)
        || error.downcast_ref::<StudyError>().is_some_and(StudyError::is_invalid_input)
}
