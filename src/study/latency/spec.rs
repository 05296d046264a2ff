//! What is put on the timing of which recording.

use super::{ClockState, Disturbance};
use crate::simulation::Scenario;
use crate::spec::{Source, SpecError, checked};
use serde::{Deserialize, Serialize};

/// Greatest latency and noise, ms: what follows the clocks looks no further.
const MOST_MS: f64 = 20.0;

/// A study of latency and timing noise, as it is written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LatencySpec {
    /// The paper's figure.
    pub figure: String,
    /// What is recorded, once.
    pub scenario: Scenario,
    /// The estimator's settings, a name under `specs/estimators/` or a file.
    pub estimator: String,
    /// Constant errors of the IMU's stamps, ms; positive where it stamps an instant later than the lidar does.
    pub latencies_ms: Vec<f64>,
    /// Standard deviations of noise on the stamps of the lidar's scans, ms.
    pub noises_ms: Vec<f64>,
    /// Latencies whose maps are shown, ms.
    pub shown_latencies_ms: Vec<f64>,
    /// Noises whose maps are shown, ms.
    pub shown_noises_ms: Vec<f64>,
    /// The map is shown as it was seen for so long, about the middle of the run, s.
    #[serde(with = "checked::Positive")]
    pub shown_s: f64,
    /// Length of the stretches of the run that are drawn again and again for the confidence bands, s.
    #[serde(with = "checked::Positive")]
    pub block_s: f64,
}

impl LatencySpec {
    /// Whether what it says fits together.
    ///
    /// # Errors
    /// At the key that does not.
    pub fn check(&self, source: &Source) -> Result<(), SpecError> {
        let wrong = |key: &str, message: String| Err(SpecError::about(source, key, message));
        let lists = [("latencies_ms", &self.latencies_ms, -MOST_MS), ("noises_ms", &self.noises_ms, 0.0)];
        for (key, list, least) in lists {
            if let Some(outside) = list.iter().find(|ms| !(least..=MOST_MS).contains(*ms)) {
                return wrong(key, format!("{outside} ms: expected {least} to {MOST_MS}"));
            }
            if !list.contains(&0.0) {
                return wrong(key, format!("`{key}` needs a 0 to compare with"));
            }
            if let Some((_, twice)) = list.iter().enumerate().find(|(k, ms)| list[..*k].contains(ms)) {
                return wrong(key, format!("`{key}` has {twice} more than once"));
            }
            if !list.iter().any(|ms| *ms > 0.0) || (least < 0.0 && !list.iter().any(|ms| *ms < 0.0)) {
                return wrong(key, format!("`{key}` needs something on each side of 0 that it may have"));
            }
        }
        let shown = [
            ("shown_latencies_ms", &self.shown_latencies_ms, &self.latencies_ms),
            ("shown_noises_ms", &self.shown_noises_ms, &self.noises_ms),
        ];
        for (key, list, of) in shown {
            if let Some(missing) = list.iter().find(|ms| !of.contains(ms)) {
                return wrong(key, format!("{missing} ms is shown, and not among those that are studied"));
            }
        }
        if self.shown_noises_ms.len() != self.shown_latencies_ms.len() {
            let counts = (self.shown_noises_ms.len(), self.shown_latencies_ms.len());
            let message = format!("a row of {} noises under one of {} latencies; show as many", counts.0, counts.1);
            return wrong("shown_noises_ms", message);
        }
        if self.scenario.duration_s < 2.0 * self.block_s {
            let message = format!("two blocks of {} s do not fit into {} s", self.block_s, self.scenario.duration_s);
            return wrong("block_s", message);
        }
        Ok(())
    }

    /// The same with so little to do that it takes seconds; its figures are no results.
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

    /// All runs: each disturbance once, with the clock state off and on.
    pub(super) fn runs(&self) -> Vec<(Disturbance, ClockState)> {
        let latencies = self.latencies_ms.iter().map(|ms| Disturbance { latency_ms: *ms, noise_ms: 0.0 });
        let noises = self.noises_ms.iter().filter(|ms| **ms > 0.0);
        let noises = noises.map(|ms| Disturbance { latency_ms: 0.0, noise_ms: *ms });
        let both = |disturbance| [ClockState::Off, ClockState::On].map(|clock| (disturbance, clock));
        latencies.chain(noises).flat_map(both).collect()
    }
}
