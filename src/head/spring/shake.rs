//! The shake of a spring.

use serde::Deserialize;
use serde::Serialize;
use zsim_dynamics::HeadModel;

/// A sinusoidal pitch motion of the base about the foot of the spring, as by a hand.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Shake {
    /// Amplitude of the base's pitch, degrees.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub pitch_deg: f64,
    /// Frequency, Hz; default: that of the slowest mode of the head.
    pub frequency_hz: Option<f64>,
}

impl Shake {
    /// Checks the frequency, which a spec can leave out.
    ///
    /// # Errors
    /// A message if it is not a finite number above 0.
    pub fn check(&self) -> Result<(), String> {
        match self.frequency_hz {
            Some(hz) if !(hz.is_finite() && hz > 0.0) => {
                Err(format!("frequency_hz: expected a finite number above 0, found {hz}"))
            }
            _ => Ok(()),
        }
    }

    /// Amplitude of the base's pitch, rad.
    pub(super) fn base_rad(&self) -> f64 {
        self.pitch_deg.to_radians()
    }

    /// The frequency, Hz; 1 Hz for a head without modes.
    pub(super) fn frequency_of(&self, head: &HeadModel) -> f64 {
        self.frequency_hz.unwrap_or(head.linear_modes().first().map_or(1.0, |mode| mode.frequency_hz))
    }
}

impl Default for Shake {
    /// 2 degrees at the slowest mode.
    fn default() -> Self {
        Self { pitch_deg: 2.0, frequency_hz: None }
    }
}
