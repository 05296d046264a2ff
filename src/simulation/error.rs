use crate::dynamics::DynamicsError;
use crate::measurement::SinkError;
use crate::motion::MotionError;
use crate::spec::SpecError;
use crate::world::WorldError;

/// Why a simulation cannot begin, or go on.
#[derive(Debug, thiserror::Error)]
pub enum SimulationError {
    /// A spec is missing or wrong.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// The base's motion cannot be built.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// The world cannot be built.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The head cannot be modelled, or its motion failed.
    #[error(transparent)]
    Dynamics(Box<DynamicsError>),
    /// A motion that is shorter than the run.
    #[error("the head's motion ends {t_s:.3} s after the start, before the run does")]
    MotionEnded {
        /// When, s after the start.
        t_s: f64,
    },
    /// A run that lasts no time, or far too long.
    #[error("a run of {duration_s} s: it lasts from {least_s} s to {most_s} s")]
    Duration {
        /// What was asked for, s.
        duration_s: f64,
        /// The shortest run, s.
        least_s: f64,
        /// The longest run, s.
        most_s: f64,
    },
    /// Simulations that were to share physics and rays do not.
    #[error("simulations run together differ in more than the IMUs, the lidar's errors and the faults")]
    Apart,
    /// Whoever takes the measurements could not.
    #[error("the simulation stopped, because what it makes could not be kept")]
    Sink(#[source] SinkError),
}

impl From<DynamicsError> for SimulationError {
    fn from(error: DynamicsError) -> Self {
        Self::Dynamics(Box::new(error))
    }
}
