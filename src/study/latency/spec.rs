//! Spec of a latency study.

use super::{ClockState, Disturbance};
use crate::simulation::Scenario;
use crate::spec::{Source, SpecError, checked};
use serde::{Deserialize, Serialize};

/// Maximum magnitude of latency and noise, ms: the search range of the clock estimation.
const MAX_TIMING_ERROR_MS: f64 = 20.0;

/// A study of latency and timing noise: one recording, estimated with each timing error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LatencySpec {
    /// Number of the figure in the paper.
    pub figure: String,
    /// Scenario of the recording, which is simulated once.
    pub scenario: Scenario,
    /// Settings of the estimator: a name under `specs/estimators/`, or a file.
    pub estimator: String,
    /// Constant latencies of the IMU's stamps relative to the lidar's, ms, from -20 to 20; must contain 0 and values of both
    /// signs.
    pub latencies_ms: Vec<f64>,
    /// Standard deviations of the noise on the stamps of the lidar's scans, ms, from 0 to 20; must contain 0 and a positive
    /// value.
    pub noises_ms: Vec<f64>,
    /// Latencies with a map in the figure, ms; a subset of `latencies_ms`.
    pub shown_latencies_ms: Vec<f64>,
    /// Noises with a map in the figure, ms; a subset of `noises_ms`, as many as latencies.
    pub shown_noises_ms: Vec<f64>,
    /// Time range of the returns in the maps, centred in the run, s.
    #[serde(with = "checked::Positive")]
    pub shown_s: f64,
    /// Length of the blocks of the bootstrap for confidence intervals, s; at most half the scenario's duration.
    #[serde(with = "checked::Positive")]
    pub block_s: f64,
}

impl LatencySpec {
    /// Checks the numbers against each other.
    ///
    /// # Errors
    /// At the first inconsistent key.
    pub fn check(&self, source: &Source) -> Result<(), SpecError> {
        let invalid = |key: &str, message: String| Err(SpecError::about(source, key, message));
        let lists = [("latencies_ms", &self.latencies_ms, -MAX_TIMING_ERROR_MS), ("noises_ms", &self.noises_ms, 0.0)];
        for (key, list, least) in lists {
            if let Some(outside) = list.iter().find(|ms| !(least..=MAX_TIMING_ERROR_MS).contains(*ms)) {
                return invalid(key, format!("{outside} ms: expected {least} to {MAX_TIMING_ERROR_MS}"));
            }
            if !list.contains(&0.0) {
                return invalid(key, format!("`{key}` needs a 0 as reference"));
            }
            if let Some((_, twice)) = list.iter().enumerate().find(|(k, ms)| list[..*k].contains(ms)) {
                return invalid(key, format!("`{key}` contains {twice} more than once"));
            }
            if !list.iter().any(|ms| *ms > 0.0) || (least < 0.0 && !list.iter().any(|ms| *ms < 0.0)) {
                return invalid(key, format!("`{key}` needs a value on each side of 0 that its range permits"));
            }
        }
        let shown = [
            ("shown_latencies_ms", &self.shown_latencies_ms, &self.latencies_ms),
            ("shown_noises_ms", &self.shown_noises_ms, &self.noises_ms),
        ];
        for (key, list, studied) in shown {
            if let Some(missing) = list.iter().find(|ms| !studied.contains(ms)) {
                return invalid(
                    key,
                    format!("{missing} ms is shown, but not studied: add it to the list of studied values"),
                );
            }
        }
        if self.shown_noises_ms.len() != self.shown_latencies_ms.len() {
            let counts = (self.shown_noises_ms.len(), self.shown_latencies_ms.len());
            let message = format!("{} noises and {} latencies are shown: expected equal numbers", counts.0, counts.1);
            return invalid("shown_noises_ms", message);
        }
        if self.scenario.duration_s < 2.0 * self.block_s {
            let message = format!("two blocks of {} s do not fit into {} s", self.block_s, self.scenario.duration_s);
            return invalid("block_s", message);
        }
        Ok(())
    }

    /// A reduced study for smoke tests, which takes seconds; its figures are not results.
    #[must_use]
    pub fn shortened(&self) -> Self {
        let most = |list: &[f64]| list.iter().copied().fold(0.0, f64::max);
        let least = self.latencies_ms.iter().copied().fold(0.0, f64::min);
        let latencies_ms = vec![least, 0.0, most(&self.latencies_ms)];
        let noises_ms = vec![0.0, 0.5 * most(&self.noises_ms), most(&self.noises_ms)];
        Self {
            scenario: Scenario { duration_s: self.scenario.duration_s.min(10.0), ..self.scenario.clone() },
            shown_latencies_ms: latencies_ms.clone(),
            shown_noises_ms: noises_ms.clone(),
            latencies_ms,
            noises_ms,
            block_s: self.block_s.min(1.0),
            ..self.clone()
        }
    }

    /// All runs: each disturbance with the clock state off and on.
    pub(super) fn runs(&self) -> Vec<(Disturbance, ClockState)> {
        let latencies = self.latencies_ms.iter().map(|ms| Disturbance { latency_ms: *ms, noise_ms: 0.0 });
        let noises = self.noises_ms.iter().filter(|ms| **ms > 0.0);
        let noises = noises.map(|ms| Disturbance { latency_ms: 0.0, noise_ms: *ms });
        let both = |disturbance| [ClockState::Off, ClockState::On].map(|clock| (disturbance, clock));
        latencies.chain(noises).flat_map(both).collect()
    }
}
