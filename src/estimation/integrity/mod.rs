//! Integrity of an estimate: an error bound for each pose, and the status of the run with its causes.
//!
//! The covariance of a pose is valid only if the assumptions of the estimator are. [`Evidence`] has the data to test
//! them: agreement of IMU and lidar, number and residuals of matched surfaces, constrained directions, gaps, clipping,
//! frozen sensors, implausible calibration states, and the shift by the loop closure. [`findings`] derives causes with
//! time and severity, and [`bound_factors`] derives factors on the covariance-based bound. The theory and the comparison
//! with truth are in `docs/theory/integrity.md`.

mod bound;
mod evidence;
mod factors;

pub use bound::{covariance_blocks, radius_99};
pub(crate) use evidence::MAX_CONTRADICTION;
pub use evidence::{Evidence, findings};
pub use factors::bound_factors;
