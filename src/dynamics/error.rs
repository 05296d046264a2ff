use zsim_base::spec::SpecError;
use zsim_elasticity::ElasticityError;

/// Errors of the head model and simulation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DynamicsError {
    /// The spec is invalid, or the head has no stable equilibrium.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// The force law of a spring failed.
    #[error(transparent)]
    Spring(#[from] ElasticityError),
    /// The head has no equilibrium on the base in the initial attitude of the base.
    #[error(
        "the head has no equilibrium on the base at the start of the simulation ({reason}): start with the base upright and \
         at rest"
    )]
    NoEquilibriumAtStart {
        /// Cause, as text.
        reason: String,
    },
    /// The time step is not positive or exceeds the stability limit.
    #[error(
        "time step {step_s} s is out of range: it must be above 0 and at most {max_s:.2e} s, the period of the head's fastest \
         oscillation ({fastest_hz:.1} Hz, hand hold and end stop included) over 2 pi"
    )]
    Step {
        /// Requested time step, s.
        step_s: f64,
        /// Maximum time step, s.
        max_s: f64,
        /// Highest natural frequency, Hz.
        fastest_hz: f64,
    },
    /// The base cannot be computed from the motion of the head in this linkage.
    #[error(
        "the motion of a head on {constraint} does not determine the pose of the base; this needs a head on springs or cords"
    )]
    BaseUnknown {
        /// The constraint: a motor or a joint.
        constraint: &'static str,
    },
    /// The simulation left the valid range of the model.
    #[error("the simulation diverged {t_s:.3} s after the start: {what}")]
    Diverged {
        /// Time after the start, s.
        t_s: f64,
        /// The quantity that is out of range, as text.
        what: String,
    },
}
