//! Runs with timing errors between lidar and IMU.
//!
//! The errors are added between recording and estimator, after the true offset of the clocks, which the simulation knows, is
//! removed. A run is evaluated by the distances of its cloud to the true surfaces and by its position errors.

mod cross_section;
mod evaluate;
mod reference;
mod spec;
mod stamp_errors;

pub(super) use evaluate::TimingRun;
pub use evaluate::{Block, MapErrors, Section, pooled};
pub(super) use reference::Reference;
pub use spec::{ClockState, Disturbance, TimingSpec};
