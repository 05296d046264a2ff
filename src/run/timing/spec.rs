//! Timing errors of a run, and settings of the evaluation of its map.

use serde::{Deserialize, Serialize};
use zsim_base::spec::checked;

/// Maximum number of blocks of the bootstrap: all resamples of them are in memory.
const MAX_BLOCKS: f64 = 10_000.0;
/// Maximum magnitude of latency and noise, ms: the search range of the clock estimation.
const MAX_TIMING_ERROR_MS: f64 = 20.0;

/// Timing errors between lidar and IMU, which replace the true offset of the clocks before the estimation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TimingSpec {
    /// Delay of the IMU's stamps relative to the lidar's for the same time, ms, from -20 to 20.
    #[serde(default)]
    pub latency_ms: f64,
    /// Standard deviation of the white noise on the stamps of the lidar's scans, ms, from 0 to 20. An estimator that
    /// smooths stamps is given this jitter.
    #[serde(default)]
    pub noise_ms: f64,
    /// Length of the blocks of the bootstrap for confidence intervals, s; at most half the run's duration.
    #[serde(default = "usual::block_s", with = "checked::Positive")]
    pub block_s: f64,
    /// Time range of the returns in a map, centred in the run, s.
    #[serde(default = "usual::shown_s", with = "checked::Positive")]
    pub shown_s: f64,
    /// Whether the run has a map in the figure.
    #[serde(default = "usual::shown")]
    pub shown: bool,
}

/// The values of keys that are omitted.
mod usual {
    pub fn block_s() -> f64 {
        5.0
    }

    pub fn shown_s() -> f64 {
        20.0
    }

    pub fn shown() -> bool {
        true
    }
}

impl TimingSpec {
    /// The timing error.
    pub fn disturbance(&self) -> Disturbance {
        Disturbance { latency_ms: self.latency_ms, noise_ms: self.noise_ms }
    }

    /// Checks the numbers for a run of `duration_s`.
    ///
    /// # Errors
    /// A message if a number is out of range.
    pub fn check(&self, duration_s: f64) -> Result<(), String> {
        let most = MAX_TIMING_ERROR_MS;
        for (key, ms, least) in [("latency_ms", self.latency_ms, -most), ("noise_ms", self.noise_ms, 0.0)] {
            if !(least..=most).contains(&ms) {
                return Err(format!("`{key}` {ms} ms: expected {least} to {most}"));
            }
        }
        if duration_s < 2.0 * self.block_s {
            return Err(format!("two blocks of {} s do not fit into {duration_s} s", self.block_s));
        }
        if duration_s > MAX_BLOCKS * self.block_s {
            let blocks = duration_s / self.block_s;
            return Err(format!(
                "`block_s` {} s gives {blocks:.3e} blocks in {duration_s} s: expected at most {MAX_BLOCKS}",
                self.block_s
            ));
        }
        Ok(())
    }
}

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
