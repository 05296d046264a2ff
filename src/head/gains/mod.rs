//! Gain curves: ratio of head to base motion amplitude over frequency (the paper's figure 3).
//!
//! The base is shaken on one axis at a time by a multisine, whose frequencies are odd multiples of the reciprocal of its
//! period: a spectrum over one period has no leakage, and the quadratic distortion of the response, which is at sums and
//! differences of two lines and therefore at even multiples, is not in the measured lines. The head is simulated until transients have decayed, then
//! one period is recorded. Several realisations with different phases are averaged (H1 estimator, see
//! [`transfer_function`](zsim_base::signal::transfer_function)); nonlinearity differs between realisations, which lowers the
//! coherence and widens the confidence band. Each curve includes the closed form of the linearised head
//! ([`FrequencyResponse`](zsim_dynamics::FrequencyResponse)).

mod bode;
mod curve;
mod document;
mod drive;
mod figure;
mod measure;
mod swing;
mod table;

pub use bode::gain_figure;
pub use curve::{AXES, GainCurve, GainPlan, GainPoint, axis_name};
pub use document::document;
pub use figure::{coherence_figure, coherence_panels, gain_panels, swing_figure};
pub use measure::{GainWatch, gain_curve, gain_curves};
pub use swing::{SwingPoint, SwingStudy, swing_study};
pub use table::{csv, min_coherence, swing_csv};

use serde::{Deserialize, Serialize};
use zsim_base::spec::checked;
use zsim_dynamics::{DampingSpec, HeadSpec};
use zsim_motion::Axis;

/// A gain measurement along or about one axis, with the default amplitudes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GainsSpec {
    /// Axis: of angular rate for a rotation, of acceleration for a translation.
    pub axis: Axis,
    /// Highest frequency, Hz.
    #[serde(default = "usual::up_to_hz", with = "checked::Positive")]
    pub up_to_hz: f64,
    /// Number of averaged realisations, at least 2.
    #[serde(default = "usual::realisations")]
    pub realisations: usize,
    /// Period of the multisine, s; by default at least two spectral lines are in the narrowest resonance.
    pub period_s: Option<f64>,
    /// Maximum settling time, s. A transient that lasts longer lowers the coherence.
    #[serde(default = "usual::longest_settling_s", with = "checked::Positive")]
    pub longest_settling_s: f64,
}

/// The values of keys that are omitted: those of the default plan.
mod usual {
    use super::GainPlan;

    pub fn up_to_hz() -> f64 {
        GainPlan::default().up_to_hz
    }

    pub fn realisations() -> usize {
        GainPlan::default().realisations
    }

    pub fn longest_settling_s() -> f64 {
        GainPlan::default().longest_settling_s
    }
}

impl GainsSpec {
    /// Settings of the measurement.
    pub fn plan(&self) -> GainPlan {
        GainPlan {
            up_to_hz: self.up_to_hz,
            realisations: self.realisations,
            period_s: self.period_s,
            longest_settling_s: self.longest_settling_s,
            ..GainPlan::default()
        }
    }
}

/// Returns the head with these damping ratios; a rigid head is unchanged.
#[must_use]
pub fn with_damping(spec: &HeadSpec, ratios: DampingSpec) -> HeadSpec {
    let mut damped = spec.clone();
    if let Some(own) = damped.linkage.damping_ratio_mut() {
        *own = ratios;
    }
    damped
}
