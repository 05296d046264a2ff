//! A spring under its head: what a designer asks before winding it, and the search for one that answers.

pub mod design;
mod figure;
mod figures;
mod outline;
mod report;
mod wire;

pub use figure::mode_figure;
pub use figures::{DesignFigures, closed_form, simulated};
pub use report::{CoilReport, ModeReport, RestReport, ShakeResponse, SpringReport, spring_report};
pub use wire::{SpringMounting, Wire, WireLoad};

use serde::{Deserialize, Serialize};

/// A hand that nods the base by a sine about the spring's foot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Shake {
    /// Amplitude of the base's pitch, degrees.
    #[serde(with = "crate::spec::checked::Positive")]
    pub pitch_deg: f64,
    /// Frequency, Hz; left out, the hand finds the head's slowest mode.
    #[serde(default)]
    pub frequency_hz: Option<f64>,
}

impl Default for Shake {
    /// Two degrees at resonance.
    fn default() -> Self {
        Self { pitch_deg: 2.0, frequency_hz: None }
    }
}
