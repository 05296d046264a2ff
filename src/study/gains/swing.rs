//! Gains at large amplitude, where the head is not linear: how resonance and gain move with the swing.

use super::{GainPlan, gain_curve};
use crate::dynamics::{HeadModel, Peak};
use crate::motion::Axis;
use crate::study::{OnProgress, StudyError};

/// The resonance at one strength of the shaking.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct SwingPoint {
    /// Root mean square of the base's rate (degrees/s) or acceleration (m/s^2).
    pub base_rms: f64,
    /// Root mean square of the head's turn from its rest on the base, degrees.
    pub swing_rms_deg: f64,
    /// Greatest turn, degrees.
    pub swing_most_deg: f64,
    /// Peak of the gain.
    pub peak: Option<Peak>,
    /// Coherence at the line next to the peak: what it lacks to 1 is the share that no linear head would answer.
    pub coherence: Option<f64>,
}

/// How a resonance moves with the swing.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct SwingStudy {
    /// The axis that is shaken.
    #[serde(serialize_with = "by_name")]
    pub axis: Axis,
    /// Peak of the linearised head.
    pub peak_model: Option<Peak>,
    /// From the smallest to the largest swing.
    pub points: Vec<SwingPoint>,
    /// Why the ladder ended before its top; `None` where it did not.
    pub ended: Option<String>,
}

fn by_name<S: serde::Serializer>(axis: &Axis, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(super::axis_name(*axis))
}

/// Measures the gain about or along `axis` at strengths that would swing the linear head by each of `swings_deg` (root
/// mean square). Ends early, and says why, where the simulation leaves its bounds. `on_progress` is told as
/// realisations end.
///
/// # Errors
/// When the plan cannot be carried out at the smallest swing.
pub fn swing_study(
    head: &HeadModel,
    axis: Axis,
    swings_deg: &[f64],
    plan: &GainPlan,
    on_progress: OnProgress<'_>,
) -> Result<SwingStudy, StudyError> {
    let curves = (swings_deg.len() + 1) as f64;
    let small = gain_curve(head, axis, plan, &|share| on_progress(share / curves))?;
    let mut study = SwingStudy { axis, peak_model: small.peak_model, points: Vec::new(), ended: None };
    for (before, swing_deg) in swings_deg.iter().enumerate() {
        let share = swing_deg / small.swing_rms_deg;
        let plan = GainPlan {
            rotation_deg_per_s: plan.rotation_deg_per_s * share,
            acceleration_m_per_s2: plan.acceleration_m_per_s2 * share,
            ..plan.clone()
        };
        match gain_curve(head, axis, &plan, &|share| on_progress((before as f64 + 1.0 + share) / curves)) {
            Ok(curve) => {
                let next_to = |peak: Peak| {
                    let away = |f: f64| (f - peak.freq_hz).abs();
                    curve.points.iter().min_by(|a, b| away(a.freq_hz).total_cmp(&away(b.freq_hz)))
                };
                study.points.push(SwingPoint {
                    base_rms: if axis.is_rotation() { plan.rotation_deg_per_s } else { plan.acceleration_m_per_s2 },
                    swing_rms_deg: curve.swing_rms_deg,
                    swing_most_deg: curve.swing_most_deg,
                    peak: curve.peak,
                    coherence: curve.peak.and_then(next_to).map(|p| p.coherence),
                });
            }
            Err(StudyError::Dynamics(error)) => {
                study.ended = Some(format!("at {swing_deg} degrees rms: {error}"));
                break;
            }
            Err(error) => return Err(error),
        }
    }
    Ok(study)
}
