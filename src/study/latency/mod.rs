//! Effect of timing errors between lidar and IMU on a map (the paper's figure 4), with and without clock estimation.
//!
//! The study is a [sweep](super::sweep) over the timing of one simulated recording, `specs/studies/timing.ron`. Each run has
//! a [`Disturbance`]: a constant latency of the IMU's stamps, or noise on the stamps of the lidar's scans. The errors are added between recording and estimator, after the true offset
//! of the clocks, which the simulation knows, is removed. Each disturbance is estimated in both [`ClockState`]s: off
//! (offset fixed at zero, stamps not smoothed, as in the paper) and on (offset and rate estimated, stamps smoothed).
//!
//! A run is evaluated by the standard deviation of its cloud about the true surfaces and by its position error. A block
//! bootstrap yields 95 % confidence intervals. The minimum of a parabola fitted to the squared error over the latency is
//! the best latency, which should be zero.

mod cross_section;
mod disturbance;
mod evaluate;
mod figure;
mod output;
mod reference;
mod result;
mod spec;
mod stamp_errors;

pub use disturbance::{ClockState, Disturbance};
pub(crate) use evaluate::TimingRun;
pub use evaluate::{MapErrors, Section};
pub use figure::{curve_figure, map_figure};
pub(super) use output::conclusions;
pub use output::{csv, text_table};
pub(crate) use reference::Reference;
pub use result::{LatencyResult, LatencyRun, Minimum, Recovery};
pub use spec::TimingSpec;
