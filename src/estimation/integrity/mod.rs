//! Integrity of an estimate: a bound on each pose's error, and a verdict on the run with its causes.
//!
//! The covariance of a pose is valid if the estimator's assumptions are. [`Evidence`] tests
//! these: agreement of IMU and lidar, number of matched surfaces and their residuals,
//! constrained directions, gaps, clipping, frozen sensors, implausible calibration states, and the
//! shift by the loop closure. [`findings`] turns it into causes, each with time and severity, and
//! [`doubt`] into a factor on the covariance-based bound. `docs/theory/integrity.md` has the theory and the comparison
//! with truth.

mod bound;
mod evidence;
mod finding;

pub use bound::{blocks, radius_99};
pub use evidence::{Evidence, doubt, findings};
pub use finding::{Cause, Finding, Status};
