//! The shake of a spring.

use serde::Deserialize;
use serde::Serialize;

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
