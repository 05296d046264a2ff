//! Design of the spring under a head: metrics of a given spring, and the search for one that meets goals.

pub mod design;
mod metrics;
mod mode_figure;
mod outline;
mod report;
mod wire;

pub use metrics::{DesignMetrics, closed_form, simulated};
pub use mode_figure::mode_figure;
pub use report::{CoilReport, ModeReport, RestReport, ShakeResponse, SpringReport, spring_report};
pub use wire::{SpringMounting, Wire, WireLoad};

use serde::{Deserialize, Serialize};

/// A sinusoidal pitch motion of the base about the foot of the spring, as by a hand.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Shake {
    /// Amplitude of the base's pitch, degrees.
    #[serde(with = "crate::spec::checked::Positive")]
    pub pitch_deg: f64,
    /// Frequency, Hz; default: that of the slowest mode of the head.
    #[serde(default)]
    pub frequency_hz: Option<f64>,
}

impl Default for Shake {
    /// 2 degrees at the slowest mode.
    fn default() -> Self {
        Self { pitch_deg: 2.0, frequency_hz: None }
    }
}
