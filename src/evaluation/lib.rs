//! Errors of an estimate against the truth.
//!
//! A trajectory is compared by pairs of poses of equal time ([`Pairs`]), after a rigid alignment by their positions
//! ([`align`], Umeyama without scale, as `evo_ape -a`): the absolute errors over time ([`Errors`]), the drift after an
//! alignment over the first seconds only ([`drift()`]), the error of the motion within a time or a length of the path
//! ([`relative_error`], [`relative_error_over_path`]). [`TrajectoryErrors`] has all of them.
//! [`clock_error`] compares clock offsets, [`CloudErrors`] the distances of a cloud to the true surfaces, or to those of
//! another cloud ([`ReferenceCloud`]). For
//! comparison there are the dead reckoning of the raw IMU ([`DeadReckoning`]) and the smallest error that the
//! measurements allow ([`FisherInformation`]).
//!
//! The functions have no side effects.

mod absolute;
mod alignment;
mod bound;
mod clock;
mod cloud;
mod consistency;
mod dead_reckoning;
mod drift;
mod error;
mod pairs;
mod reference_cloud;
mod relative;
mod trajectory_errors;

pub use absolute::Errors;
pub use alignment::{align, align_poses};
pub use bound::{BeamObservation, BoundModel, FisherInformation, InformationBound, MapKnowledge, UnknownMap};
pub use clock::{ClockError, clock_error, clock_error_after, clock_errors};
pub use cloud::{CloudErrors, CloudSummary, Thinning};
pub use consistency::{Consistency, consistency};
pub use dead_reckoning::{DeadReckoning, RestDetection};
pub use drift::{Drift, TAIL_S, drift};
pub use error::EvaluationError;
pub use pairs::{Pairs, PoseSampler};
pub use reference_cloud::ReferenceCloud;
pub use relative::{RelativeError, relative_error, relative_error_over_path};
pub use trajectory_errors::{TrajectoryErrors, gap_s};
