//! Integrity of an estimate: a bound on each pose's error, and a verdict on the run with its causes.
//!
//! The covariance of a pose says how large its error is if all that the estimator assumes is right. [`Evidence`] is what
//! speaks for or against that: how well IMU and lidar agree, how many surfaces were observed again and how well they fit,
//! which directions they constrain, gaps, clipping, frozen sensors, implausible calibration states, and how far the loop
//! closure moved the odometry. [`findings`] turns it into causes, each with its time and its weight, and [`doubt`] into a
//! factor on the covariance-based bound. `docs/integrity.md` has the theory and how it compares with truth.

mod bound;
mod evidence;
mod finding;

pub use bound::{blocks, radius_99};
pub use evidence::{Evidence, doubt, findings};
pub use finding::{Cause, Finding, Status};
