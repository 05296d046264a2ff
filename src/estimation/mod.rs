//! The reader that makes sense of it: continuous-time SLAM over a sliding window. Measurements in, estimate out.

mod error;
mod estimator;
mod output;
mod spec;

pub use error::{EstimationError, Warning, WarningKind};
pub use estimator::{Estimator, estimate_all};
pub use output::{EstimatedPose, OpenLoop, WindowReport};
pub use spec::{ClockSpec, EstimatorSpec, InertialSpec, MatchingSpec, SolveSpec, SurfelSpec, ViewSpec, load};
