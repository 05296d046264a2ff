//! Gains at large amplitudes, where the head is nonlinear: resonance and peak gain over swing amplitude.

use super::{GainPlan, GainWatch, gain_curve};
use crate::HeadError;
use zsim_dynamics::{CoilContact, HeadModel, Peak};
use zsim_motion::Axis;

/// The resonance at one excitation amplitude.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct SwingPoint {
    /// RMS angular rate (degrees/s) or acceleration (m/s^2) of the base.
    pub base_rms: f64,
    /// RMS rotation angle of the head relative to its rest pose on the base, degrees.
    pub swing_rms_deg: f64,
    /// Maximum rotation angle, degrees.
    pub swing_most_deg: f64,
    /// Peak of the gain curve; `None` for a monotonic curve.
    pub peak: Option<Peak>,
    /// Standard error of the gain at the spectral line next to the peak.
    pub peak_gain_sigma: Option<f64>,
    /// Coherence at the spectral line next to the peak; its difference from 1 is the nonlinear fraction of the power.
    pub coherence: Option<f64>,
    /// Contact of the coils of a spring; `None` if they did not touch.
    pub coil_contact: Option<CoilContact>,
}

/// Resonance over swing amplitude on one axis.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct SwingStudy {
    /// Axis of excitation.
    #[serde(serialize_with = "by_name")]
    pub axis: Axis,
    /// Peak of the linearised head.
    pub peak_model: Option<Peak>,
    /// Points by increasing swing amplitude.
    pub points: Vec<SwingPoint>,
    /// Reason of an early end; `None` if all amplitudes were measured.
    pub ended: Option<String>,
}

/// Serialises an axis by its name in tables.
fn by_name<S: serde::Serializer>(axis: &Axis, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(super::axis_name(*axis))
}

/// Measures the gain about or along `axis` at several amplitudes.
///
/// The excitation is such that the linearised head would swing by each of `swings_deg`, degrees RMS. Ends early, with a
/// reason, if the simulation diverges. `watch` receives the finished fraction.
///
/// # Errors
/// If the plan is invalid.
pub fn swing_study(
    head: &HeadModel,
    axis: Axis,
    swings_deg: &[f64],
    plan: &GainPlan,
    watch: GainWatch<'_>,
) -> Result<SwingStudy, HeadError> {
    let curves = (swings_deg.len() + 1) as f64;
    let on_progress = watch.on_progress;
    let small =
        gain_curve(head, axis, plan, GainWatch { on_progress: &|fraction| on_progress(fraction / curves), ..watch })?;
    let mut study = SwingStudy { axis, peak_model: small.peak_model, points: Vec::new(), ended: None };
    for (before, swing_deg) in swings_deg.iter().enumerate() {
        let scale = swing_deg / small.swing_rms_deg;
        let plan = GainPlan {
            rotation_deg_per_s: plan.rotation_deg_per_s * scale,
            acceleration_m_per_s2: plan.acceleration_m_per_s2 * scale,
            ..plan.clone()
        };
        let of_curve = |fraction| on_progress((before as f64 + 1.0 + fraction) / curves);
        match gain_curve(head, axis, &plan, GainWatch { on_progress: &of_curve, ..watch }) {
            Ok(curve) => {
                let next_to = |peak: Peak| {
                    let distance = |f: f64| (f - peak.freq_hz).abs();
                    curve.points.iter().min_by(|a, b| distance(a.freq_hz).total_cmp(&distance(b.freq_hz)))
                };
                let beside = curve.peak.and_then(next_to);
                study.points.push(SwingPoint {
                    base_rms: if axis.is_rotation() { plan.rotation_deg_per_s } else { plan.acceleration_m_per_s2 },
                    swing_rms_deg: curve.swing_rms_deg,
                    swing_most_deg: curve.swing_most_deg,
                    peak: curve.peak,
                    coil_contact: curve.coil_contact,
                    peak_gain_sigma: beside.map(|p| p.gain_sigma),
                    coherence: beside.map(|p| p.coherence),
                });
            }
            Err(HeadError::Dynamics(error)) => {
                study.ended = Some(format!("at {swing_deg} degrees rms: {error}"));
                break;
            }
            Err(error) => return Err(error),
        }
    }
    Ok(study)
}
