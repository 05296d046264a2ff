use zsim_base::measurement::SinkError;
use zsim_base::spec::SpecError;
use zsim_dynamics::DynamicsError;
use zsim_motion::MotionError;
use zsim_world::WorldError;

/// Why a simulation cannot start or continue.
#[derive(Debug, thiserror::Error)]
pub enum SimulationError {
    /// A spec is missing or invalid.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// The motion of the base cannot be built.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// The world cannot be built.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The head cannot be modelled, or the simulation failed.
    #[error(transparent)]
    Dynamics(Box<DynamicsError>),
    /// The motion is shorter than the run.
    #[error("the head's motion ends {t_s:.3} s after the start, before the run does")]
    MotionEnded {
        /// End of the motion, s after the start.
        t_s: f64,
    },
    /// The duration is out of range.
    #[error("a run of {duration_s} s is not possible: give {min_s} s to {max_s} s")]
    Duration {
        /// Requested duration, s.
        duration_s: f64,
        /// Minimum duration, s.
        min_s: f64,
        /// Maximum duration, s.
        max_s: f64,
    },
    /// Simulations that run together do not have the same rays.
    #[error("simulations run together differ in more than the IMUs, the lidar's errors and the faults")]
    DifferentRays,
    /// The sink failed, for example because the disk is full.
    #[error("the simulation stopped: the output could not be written")]
    Sink(#[source] SinkError),
}

impl From<DynamicsError> for SimulationError {
    fn from(error: DynamicsError) -> Self {
        Self::Dynamics(Box::new(error))
    }
}
