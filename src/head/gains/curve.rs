//! Settings and result of a gain measurement.

use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use zsim_base::random::Seed;
use zsim_dynamics::{AccelerationKind, CoilContact, GainPoints, Peak};
use zsim_motion::Axis;

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
            rotation_deg_per_s: 0.1,
            acceleration_m_per_s2: 0.01,
            realisations: 4,
            longest_settling_s: 200.0,
            step_s: 1e-3,
            seed: Seed(1),
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
    /// Measured phase of the head relative to the base, rad, -pi to pi.
    pub phase_rad: f64,
    /// Phase of the linearised head, rad, -pi to pi.
    pub phase_model_rad: f64,
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
    /// Contact of the coils of a spring in one of the realisations; `None` if they did not touch.
    #[serde(default)]
    pub coil_contact: Option<CoilContact>,
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

/// Half width of the 95 % band of a normal distribution, in standard errors.
pub(super) const SIGMAS_95: f64 = 1.96;

/// Minimum coherence of a plotted gain: below it noise and nonlinearity dominate.
pub(super) const MIN_COHERENCE: f64 = 0.5;

/// Phases of the closed form without jumps by a turn, and the measured ones on the turn that is the nearest to them, rad.
pub(super) fn continuous_phases(points: &[GainPoint]) -> Vec<(f64, f64)> {
    let mut model_rad = 0.0;
    let phases = points.iter().map(|p| {
        model_rad += wrapped(p.phase_model_rad - model_rad);
        (model_rad, model_rad + wrapped(p.phase_rad - model_rad))
    });
    phases.collect()
}

/// The angle between -pi and pi that differs by whole turns.
pub(super) fn wrapped(angle_rad: f64) -> f64 {
    angle_rad - TAU * (angle_rad / TAU).round()
}

/// Key of an axis in files, whose words are in [`quantity_name`](zsim_report::quantity_name): `x_rot` for the angular rate about x, `x` for the acceleration along x.
pub fn axis_name(axis: Axis) -> &'static str {
    ["x", "y", "z", "x_rot", "y_rot", "z_rot"][axis as usize]
}

/// All axes in the order of the paper's figure, rotations first.
pub const AXES: [Axis; 6] = [Axis::Roll, Axis::Pitch, Axis::Yaw, Axis::X, Axis::Y, Axis::Z];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn continuous_phases_have_no_jump_and_are_the_same_angles() {
        // A delay: the phase falls by 0.4 rad per line, through two turns.
        let true_rad: Vec<f64> = (0..40).map(|k| -0.4 * f64::from(k)).collect();
        let point = |phase_rad: &f64| {
            let (phase_model_rad, phase_rad) = (wrapped(*phase_rad), phase_rad + TAU);
            let (freq_hz, gain, coherence, gain_sigma, gain_model) = (1.0, 1.0, 1.0, 0.0, 1.0);
            GainPoint { freq_hz, gain, coherence, gain_sigma, gain_model, phase_rad, phase_model_rad }
        };
        let found = continuous_phases(&true_rad.iter().map(point).collect::<Vec<_>>());
        assert!(
            found.iter().zip(&true_rad).all(|((a, b), c)| (a - c).abs() < 1e-9 && (b - c).abs() < 1e-9),
            "{found:?}"
        );
    }
}
