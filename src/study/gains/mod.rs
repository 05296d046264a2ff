//! Gain curves: ratio of head to base motion amplitude over frequency (the paper's figure 3).
//!
//! The base is shaken on one axis at a time by a multisine, whose frequencies are multiples of the reciprocal of its
//! period, so that a spectrum over one period has no leakage. The head is simulated until transients have decayed, then
//! one period is recorded. Several realisations with different phases are averaged (H1 estimator, see
//! [`transfer_function`](crate::signal::transfer_function)); nonlinearity differs between realisations, which lowers the
//! coherence and widens the confidence band. Each curve includes the closed form of the linearised head
//! ([`FrequencyResponse`](crate::dynamics::FrequencyResponse)).

mod drive;
mod figure;
mod measure;
mod swing;
mod table;

pub use figure::{coherence_figure, coherence_panels, gain_figure, gain_panels, swing_figure};
pub use measure::{gain_curve, gain_curves};
pub use swing::{SwingPoint, SwingStudy, swing_study};
pub use table::{csv, swing_csv};

use crate::dynamics::{AccelerationKind, DampingSpec, GainPoints, HeadSpec, Peak};
use crate::motion::Axis;
use crate::random::Seed;
use crate::spec::checked;
use serde::{Deserialize, Serialize};

/// Settings of a gain measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct GainPlan {
    /// Quantity compared along x, y and z: acceleration or specific force.
    pub acceleration: AccelerationKind,
    /// Points of base and head whose motion is compared; `None` for the spring's foot and the IMU.
    pub points: Option<GainPoints>,
    /// Highest frequency, Hz.
    pub up_to_hz: f64,
    /// Period of the multisine, s; `None` for at least two spectral lines in the narrowest resonance.
    pub period_s: Option<f64>,
    /// RMS angular rate of the base about an axis, degrees/s.
    pub rotation_deg_per_s: f64,
    /// RMS acceleration of the base along an axis, m/s^2.
    pub acceleration_m_per_s2: f64,
    /// Number of averaged realisations, at least 2.
    pub realisations: usize,
    /// Maximum settling time, s. A transient that lasts longer lowers the coherence.
    pub longest_settling_s: f64,
    /// Time step of the simulation, s.
    pub step_s: f64,
    /// Random seed of the phases.
    pub seed: Seed,
}

impl Default for GainPlan {
    /// Up to 10 Hz, an amplitude small enough for the head to be linear, four realisations, steps of 1 ms.
    fn default() -> Self {
        Self {
            acceleration: AccelerationKind::Kinematic,
            points: None,
            up_to_hz: 10.0,
            period_s: None,
            rotation_deg_per_s: 0.2,
            acceleration_m_per_s2: 0.02,
            realisations: 4,
            longest_settling_s: 200.0,
            step_s: 1e-3,
            seed: Seed(1),
        }
    }
}

/// A gain measurement along or about one axis, with the default amplitudes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GainsSpec {
    /// Axis: of angular rate for a rotation, of acceleration for a translation.
    pub axis: Axis,
    /// Highest frequency, Hz.
    #[serde(with = "checked::Positive")]
    pub up_to_hz: f64,
    /// Number of averaged realisations, at least 2.
    pub realisations: usize,
    /// Period of the multisine, s; by default at least two spectral lines are in the narrowest resonance.
    pub period_s: Option<f64>,
    /// Maximum settling time, s. A transient that lasts longer lowers the coherence.
    #[serde(with = "checked::Positive")]
    pub longest_settling_s: f64,
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

/// Gain at one frequency.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GainPoint {
    /// Frequency, Hz.
    pub freq_hz: f64,
    /// Measured gain.
    pub gain: f64,
    /// Coherence: fraction of the head's power that is linear in the base's motion.
    pub coherence: f64,
    /// Standard error of the measured gain.
    pub gain_sigma: f64,
    /// Gain of the linearised head.
    pub gain_model: f64,
}

/// Gain curve along or about one axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GainCurve {
    /// Axis: of angular rate for a rotation, of acceleration for a translation.
    pub axis: Axis,
    /// Points by increasing frequency.
    pub points: Vec<GainPoint>,
    /// Highest peak; `None` for a monotonic curve.
    pub peak: Option<Peak>,
    /// Highest peak of the linearised head.
    pub peak_model: Option<Peak>,
    /// RMS rotation angle of the head relative to its rest pose on the base, degrees.
    pub swing_rms_deg: f64,
    /// Maximum rotation angle, degrees.
    pub swing_most_deg: f64,
}

impl GainCurve {
    /// The curve up to a frequency, without peaks above it.
    #[must_use]
    pub fn up_to(&self, freq_hz: f64) -> Self {
        let below = |peak: Option<Peak>| peak.filter(|peak| peak.freq_hz <= freq_hz);
        Self {
            points: self.points.iter().filter(|p| p.freq_hz <= freq_hz * (1.0 + 1e-9)).copied().collect(),
            peak: below(self.peak),
            peak_model: below(self.peak_model),
            ..*self
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

/// Name of an axis in tables: `x_rot` for the angular rate about x, `x` for the acceleration along x.
pub fn axis_name(axis: Axis) -> &'static str {
    match axis {
        Axis::X => "x",
        Axis::Y => "y",
        Axis::Z => "z",
        Axis::Roll => "x_rot",
        Axis::Pitch => "y_rot",
        Axis::Yaw => "z_rot",
    }
}

/// All axes in the order of the paper's figure, rotations first.
pub const AXES: [Axis; 6] = [Axis::Roll, Axis::Pitch, Axis::Yaw, Axis::X, Axis::Y, Axis::Z];
