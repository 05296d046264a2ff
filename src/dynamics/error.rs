use crate::elasticity::ElasticityError;
use crate::spec::SpecError;

/// Why a head cannot be modelled or simulated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DynamicsError {
    /// The spec is wrong, or describes a head that cannot stand.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// The spring's force law failed.
    #[error(transparent)]
    Spring(#[from] ElasticityError),
    /// The head finds no rest on its base as that stands when the simulation begins.
    #[error(
        "the head finds no rest on its base as that stands at the start ({reason}): start with the base upright and still"
    )]
    NoRestAtStart {
        /// Why not.
        reason: String,
    },
    /// A time step that the integrator cannot take.
    #[error(
        "a time step of {step_s} s is no good: it must be above 0 and at most {most_s:.2e} s, a sixth of the period of the \
         head's fastest oscillation, {fastest_hz:.1} Hz (held by a hand, or at its end stop)"
    )]
    Step {
        /// The step asked for, s.
        step_s: f64,
        /// The longest that will do, s.
        most_s: f64,
        /// Frequency of the fastest oscillation, Hz.
        fastest_hz: f64,
    },
    /// A head whose motion does not tell what its base does.
    #[error("the head is held by {holder}, and its motion does not tell where its base is: take the rigid link")]
    BaseUnknown {
        /// What holds it.
        holder: &'static str,
    },
    /// A head that left all bounds.
    #[error("the simulation diverged {t_s:.3} s after the start: {what}")]
    Diverged {
        /// When, s after the start.
        t_s: f64,
        /// What went out of bounds.
        what: String,
    },
}
