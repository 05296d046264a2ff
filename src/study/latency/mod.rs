//! What errors of timing between lidar and IMU do to a map (the paper's figure 4), and what the estimator's clock state
//! makes good.
//!
//! One recording is estimated again and again: with a constant latency on the IMU's stamps, or with noise on the stamps
//! of the lidar's scans ([`Disturbance`]). Both are put on between the recording and the estimator; nothing is
//! simulated again. First the clocks' true offset is taken away, which a simulation knows, so that no latency is none.
//! Each disturbance is estimated with the clock state off (offset held at zero, every stamp believed: what the paper
//! shows) and on (offset and rate estimated, stamps smoothed from the noise that was put on them: what an estimator can
//! recover, [`ClockState`]).
//!
//! A run is judged by the spread of its cloud about the true surfaces and by the error of its trajectory. Their bands
//! are of 95 %, by drawing blocks of the run's time again and again; a parabola through the squared error over the
//! latency tells at which latency the estimate is best, which should be none.

mod band;
mod cut;
mod disturb;
mod figure;
mod judge;
mod output;
mod probe;
mod run;
mod spec;

pub use band::{Banded, Block};
pub use figure::{curve_figure, map_figure};
pub(super) use output::sentences;
pub use output::{csv, words};
pub use run::{Latency, Minimum, Recovery, Study, StudyRun};
pub use spec::LatencySpec;

use serde::{Deserialize, Serialize};

/// An error of timing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Disturbance {
    /// How much later the IMU stamps an instant than the lidar does, ms.
    pub latency_ms: f64,
    /// Standard deviation of white noise on the stamps of the lidar's scans, ms.
    pub noise_ms: f64,
}

impl Disturbance {
    /// None.
    pub const NONE: Self = Self { latency_ms: 0.0, noise_ms: 0.0 };
}

/// What the estimator does about clocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ClockState {
    /// Nothing: the clocks are taken to be one, and every stamp is believed.
    Off,
    /// It estimates offset and rate by its settings, and smooths stamps, told by how much they jitter.
    On,
}
