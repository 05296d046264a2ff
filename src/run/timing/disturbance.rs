//! Timing errors and their treatment by the estimator.

use serde::Deserialize;
use serde::Serialize;

/// A timing error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Disturbance {
    /// Delay of the IMU's stamps relative to the lidar's for the same time, ms.
    pub latency_ms: f64,
    /// Standard deviation of the white noise on the stamps of the lidar's scans, ms.
    pub noise_ms: f64,
}

impl Disturbance {
    /// No timing error.
    pub const NONE: Self = Self { latency_ms: 0.0, noise_ms: 0.0 };
}

/// Treatment of clock errors by the estimator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ClockState {
    /// Offset fixed at zero; stamps are used as they are.
    Off,
    /// Offset and rate are estimated by the estimator's settings; stamps are smoothed with the known jitter.
    On,
}
