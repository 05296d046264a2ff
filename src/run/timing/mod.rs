//! Runs with timing errors between lidar and IMU.
//!
//! The errors are added between recording and estimator, after the true offset of the clocks, which the simulation knows, is
//! removed. A run is evaluated by the distances of its cloud to the true surfaces and by its position errors.

mod block;
mod cross_section;
mod disturbance;
mod evaluate;
mod reference;
mod spec;
mod stamp_errors;

pub use block::{Block, pooled};
pub use disturbance::{ClockState, Disturbance};
pub(super) use evaluate::TimingRun;
pub use evaluate::{MapErrors, Section};
pub(super) use reference::Reference;
pub use spec::TimingSpec;
