//! The reader that makes sense of it: continuous-time SLAM over a sliding window. Measurements in, estimate out.

mod border;
mod clock;
mod error;
mod estimator;
mod inertial;
mod initial;
mod intake;
mod matching;
mod nominal;
mod normal_equations;
mod output;
mod residual;
mod spec;
mod spline;
mod stamps;
mod strapdown;
mod surfel;
mod views;
mod window;

use clock::Clock;
pub use error::{EstimationError, Warning, WarningKind};
pub use estimator::{Estimator, estimate_all};
pub use output::{EstimatedPose, OpenLoop, WindowReport};
pub use spec::{ClockSpec, EstimatorSpec, InertialSpec, MatchingSpec, SolveSpec, SurfelSpec, ViewSpec, load};
