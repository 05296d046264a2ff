//! Steps of a sensor's clock in the middle of a recording.

use serde::Serialize;
use zsim_base::time::{Span, Stamp};

/// A clock that was set while the sensor ran, as log times show it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ClockStep {
    /// Topic of the sensor.
    pub topic: String,
    /// Stamp of the first message after the step, as it is read: without the step.
    pub at: Stamp,
    /// Change of the clock; later stamps are read as this much earlier.
    pub by: Span,
}
