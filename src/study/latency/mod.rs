//! Effect of timing errors between lidar and IMU on a map (the paper's figure 4), with and without clock estimation.
//!
//! The study is a [sweep](super::sweep) over the timing of one simulated recording, `specs/studies/timing.ron`. Each run has a
//! [timing error](zsim_run::timing): a constant latency of the IMU's stamps, or noise on the stamps of the lidar's scans. Each is
//! estimated with the clock state off (offset fixed at zero, stamps not smoothed, as in the paper) and on (offset and rate
//! estimated, stamps smoothed).
//!
//! A run is evaluated by the standard deviation of its cloud about the true surfaces and by its position error. A block
//! bootstrap yields 95 % confidence intervals. The minimum of a parabola fitted to the squared error over the latency is
//! the best latency, which should be zero.

mod document;
mod figure;
mod result;

pub(super) use document::conclusions;
pub use document::{csv, document};
pub use figure::{curve_figure, map_figure};
pub use result::{LatencyResult, LatencyRun, Minimum, Recovery};
