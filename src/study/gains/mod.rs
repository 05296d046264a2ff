//! Gain curves: the amplitude of the head's motion over that of its base, by frequency (the paper's figure 3).
//!
//! One axis of the base at a time is shaken by a multisine: sines at the multiples of the reciprocal of a period, so
//! that a spectrum over that period does not leak. What the head does is simulated, the settling is thrown away, one
//! period is kept; several realisations that differ in nothing but the sines' phases are averaged (H1, see
//! [`transfer_function`](crate::signal::transfer_function)). Whatever is not linear answers differently to each, and so
//! lowers the coherence and widens the confidence band. Beside each curve stands the closed form of the linearised head
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

use crate::dynamics::{DampingSpec, GainPoints, HeadSpec, Peak, Quantity};
use crate::motion::Axis;
use crate::random::Seed;
use serde::{Deserialize, Serialize};

/// How gains are measured.
#[derive(Debug, Clone, PartialEq)]
pub struct GainPlan {
    /// What is compared along x, y, z.
    pub quantity: Quantity,
    /// Where; `None` for the spring's foot and the IMU.
    pub points: Option<GainPoints>,
    /// Highest frequency, Hz.
    pub up_to_hz: f64,
    /// The multisine's period, s; `None` for one that puts two lines or more into the narrowest resonance.
    pub period_s: Option<f64>,
    /// Root mean square of the base's rate about an axis, degrees/s.
    pub rotation_deg_per_s: f64,
    /// Root mean square of the base's acceleration along an axis, m/s^2.
    pub acceleration_m_per_s2: f64,
    /// How many realisations are averaged.
    pub realisations: usize,
    /// The longest settling that is waited for, s. A head that takes longer shows it in its coherence.
    pub longest_settling_s: f64,
    /// The simulation's time step, s.
    pub step_s: f64,
    /// From which the phases are drawn.
    pub seed: Seed,
}

impl Default for GainPlan {
    /// 0 to 10 Hz at an amplitude so small that the head is linear, four realisations, steps of 1 ms.
    fn default() -> Self {
        Self {
            quantity: Quantity::Kinematic,
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

/// The gain at one frequency.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GainPoint {
    /// Frequency, Hz.
    pub freq_hz: f64,
    /// Measured gain.
    pub gain: f64,
    /// Share of the head's power that the base's motion explains.
    pub coherence: f64,
    /// Standard error of the measured gain.
    pub gain_sigma: f64,
    /// Gain of the linearised head.
    pub gain_model: f64,
}

/// The gain along or about one axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GainCurve {
    /// The axis: of rate for a rotation, of acceleration for a translation.
    pub axis: Axis,
    /// The curve, lowest frequency first.
    pub points: Vec<GainPoint>,
    /// Its highest peak; `None` for a curve that only falls or rises.
    pub peak: Option<Peak>,
    /// That of the linearised head.
    pub peak_model: Option<Peak>,
    /// Root mean square of the head's lean and turn from its rest on the base, degrees.
    pub swing_rms_deg: f64,
    /// Greatest, degrees.
    pub swing_most_deg: f64,
}

impl GainCurve {
    /// Its part up to a frequency, with the peaks that lie there.
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

/// The head with its modes damped by these ratios; one that does not move stays as it is.
#[must_use]
pub fn with_damping(spec: &HeadSpec, ratios: DampingSpec) -> HeadSpec {
    let mut damped = spec.clone();
    if let Some(own) = damped.linkage.damping_ratio_mut() {
        *own = ratios;
    }
    damped
}

/// What an axis is called in tables: `x_rot` is the rate about x, `x` the acceleration along it.
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

/// The axes in the order of the paper's figure: rotations first.
pub const AXES: [Axis; 6] = [Axis::Roll, Axis::Pitch, Axis::Yaw, Axis::X, Axis::Y, Axis::Z];
