//! Measurement of gain curves by simulation.

use super::drive::{Schedule, ShakenBase};
use super::{AXES, GainCurve, GainPlan, GainPoint};
use crate::HeadError;
use rayon::prelude::*;
use std::ops::RangeInclusive;
use std::sync::atomic::AtomicBool;
use zsim_base::geometry::{Pose, Rotation, Vector};
use zsim_base::parallel::{OnProgress, PieceProgress, check};
use zsim_base::signal::{Segments, TransferPoint, transfer_function};
use zsim_dynamics::{
    AccelerationKind, CoilContact, ContactWatch, GainPoints, HeadModel, HeadSimulation, HeadState, Peak,
};
use zsim_motion::Axis;

/// Valid number of realisations: coherence requires at least two.
const REALISATIONS: RangeInclusive<usize> = 2..=1000;
/// Maximum number of stored steps per axis: 160 MB, and six axes are stored at once.
const MAX_STORED_STEPS: usize = 10_000_000;

/// Progress and stop of a gain measurement.
#[derive(Clone, Copy)]
pub struct GainWatch<'a> {
    /// The caller sets this flag to stop the measurement.
    pub stop: &'a AtomicBool,
    /// Receives the finished fraction after each realisation.
    pub on_progress: OnProgress<'a>,
}

impl GainWatch<'static> {
    /// A measurement that is not stopped and reports nothing.
    pub fn silent() -> Self {
        static NEVER: AtomicBool = AtomicBool::new(false);
        Self { stop: &NEVER, on_progress: &|_| () }
    }
}

/// Measures the gains of `head` along and about all six axes, in the order of [`AXES`].
///
/// Realisations run in parallel; the result does not depend on the number of threads.
///
/// # Errors
/// If the plan is invalid, if the simulation fails, or if the measurement is stopped.
pub fn gain_curves(head: &HeadModel, plan: &GainPlan, watch: GainWatch<'_>) -> Result<Vec<GainCurve>, HeadError> {
    curves(head, &AXES, plan, watch)
}

/// Measures the gain of `head` along or about `axis`, as [`gain_curves`].
///
/// # Errors
/// As [`gain_curves`].
pub fn gain_curve(head: &HeadModel, axis: Axis, plan: &GainPlan, watch: GainWatch<'_>) -> Result<GainCurve, HeadError> {
    Ok(curves(head, &[axis], plan, watch)?.remove(0))
}

/// Measures the gains along or about each of `axes`.
fn curves(head: &HeadModel, axes: &[Axis], plan: &GainPlan, watch: GainWatch<'_>) -> Result<Vec<GainCurve>, HeadError> {
    let schedule = checked_schedule(head, plan)?;
    let tasks: Vec<_> = axes.iter().flat_map(|axis| (0..plan.realisations).map(|k| (*axis, k))).collect();
    let pieces = PieceProgress::new(tasks.len(), watch.on_progress);
    let records = tasks.par_iter().map(|(axis, k)| {
        let record = record(head, *axis, *k, plan, schedule, watch.stop);
        pieces.finish_one();
        record
    });
    let records = records.collect::<Result<Vec<_>, _>>()?;
    let of_axes = axes.iter().zip(records.chunks(plan.realisations));
    of_axes.map(|(axis, records)| curve(head, *axis, records, plan, schedule)).collect()
}

/// Checks the plan and computes the schedule.
fn checked_schedule(head: &HeadModel, plan: &GainPlan) -> Result<Schedule, HeadError> {
    if let Some(reason) = head.rigid_mount_reason() {
        return Err(HeadError::Plan { what: "head", message: reason.to_owned() });
    }
    if !REALISATIONS.contains(&plan.realisations) {
        let (minimum, maximum) = (REALISATIONS.start(), REALISATIONS.end());
        let message = format!("{}: coherence requires {minimum} or more, at most {maximum}", plan.realisations);
        return Err(HeadError::Plan { what: "realisations", message });
    }
    let schedule = Schedule::new(head, plan)?;
    let stored = plan.realisations * schedule.period;
    if stored > MAX_STORED_STEPS {
        let message = format!(
            "{} of {} steps each are {stored} steps, more than {MAX_STORED_STEPS}: use fewer, a shorter period or longer steps",
            plan.realisations, schedule.period
        );
        return Err(HeadError::Plan { what: "realisations", message });
    }
    Ok(schedule)
}

/// Number of steps between two checks whether the measurement is to stop: below 10 ms.
const STEPS_PER_CHECK: usize = 1000;

/// Signals of base and head over one period in steady state.
#[derive(Debug, Clone, Default)]
struct Record {
    base: Vec<f64>,
    head: Vec<f64>,
    /// Sum of the squared rotation angles of the head relative to its rest pose on the base, rad^2.
    sum_squared_angle: f64,
    /// Maximum rotation angle, rad.
    max_angle: f64,
    /// Contact of the coils of a spring, after the head has settled.
    coil_contact: Option<CoilContact>,
}

/// Simulates one realisation and records its last period.
fn record(
    head: &HeadModel,
    axis: Axis,
    index: usize,
    plan: &GainPlan,
    schedule: Schedule,
    stop: &AtomicBool,
) -> Result<Record, HeadError> {
    let points = plan.points.unwrap_or_else(|| head.default_points());
    let base = ShakenBase::new(axis, index, plan, schedule, &points.base_in_base)?;
    let probe = MotionProbe::new(head, axis, &points, plan.acceleration);
    let mut record = Record::default();
    let mut watch = ContactWatch::new(head);
    for (step, state) in HeadSimulation::new(head, &base, plan.step_s)?.enumerate().take(schedule.steps()) {
        let state = state?;
        if step.is_multiple_of(STEPS_PER_CHECK) {
            check(stop)?;
        }
        if step >= schedule.settling {
            watch.check(state.t_s, &state.base, &state.head);
            probe.sample(&state, &mut record);
        }
    }
    record.coil_contact = watch.contact();
    Ok(record)
}

/// Samples the motion of base and head along or about one axis.
struct MotionProbe {
    axis: usize,
    is_rotation: bool,
    acceleration: AccelerationKind,
    base_from_point: Pose,
    head_from_point: Pose,
    rest: Rotation,
}

impl MotionProbe {
    fn new(head: &HeadModel, axis: Axis, points: &GainPoints, acceleration: AccelerationKind) -> Self {
        let at = |point: &Vector| Pose::from_parts((*point).into(), Rotation::identity());
        Self {
            axis: axis as usize % 3,
            is_rotation: axis.is_rotation(),
            acceleration,
            base_from_point: at(&points.base_in_base),
            head_from_point: at(&points.head_in_head),
            rest: head.base_from_head_at_rest().rotation,
        }
    }

    /// Appends one sample: angular rates in the body, accelerations in the world, or specific forces in the body.
    ///
    /// The head's rates and forces are rotated into axes that coincide with the base's at rest.
    fn sample(&self, state: &HeadState, record: &mut Record) {
        let (base, head) = (state.base.of_frame(&self.base_from_point), state.head.of_frame(&self.head_from_point));
        let (base_value, head_value) = match (self.is_rotation, self.acceleration) {
            (true, _) => (base.angular_velocity_in_body(), self.rest * head.angular_velocity_in_body()),
            (false, AccelerationKind::Kinematic) => (base.acceleration_in_world, head.acceleration_in_world),
            (false, AccelerationKind::SpecificForce) => {
                (base.specific_force_in_body(), self.rest * head.specific_force_in_body())
            }
        };
        record.base.push(base_value[self.axis]);
        record.head.push(head_value[self.axis]);
        let angle = (base.world_from_body.rotation * self.rest).angle_to(&head.world_from_body.rotation);
        record.sum_squared_angle += angle * angle;
        record.max_angle = record.max_angle.max(angle);
    }
}

/// Computes the gain curve from all realisations.
fn curve(
    head: &HeadModel,
    axis: Axis,
    records: &[Record],
    plan: &GainPlan,
    schedule: Schedule,
) -> Result<GainCurve, HeadError> {
    let joined =
        |signal: fn(&Record) -> &Vec<f64>| records.iter().flat_map(|r| signal(r).iter().copied()).collect::<Vec<_>>();
    let (base_signal, head_signal) = (joined(|r| &r.base), joined(|r| &r.head));
    let measured =
        transfer_function(&base_signal, &head_signal, 1.0 / plan.step_s, Segments::periods(schedule.period))?;
    let points = plan.points.unwrap_or_else(|| head.default_points());
    let response = head.frequency_response(&points);
    let point = |p: &TransferPoint| {
        let model = response.transfer(axis, p.freq_hz, plan.acceleration);
        GainPoint {
            freq_hz: p.freq_hz,
            gain: p.gain(),
            coherence: p.coherence,
            gain_sigma: p.gain_sigma,
            gain_model: model.norm(),
            phase_rad: p.response.arg(),
            phase_model_rad: model.arg(),
        }
    };
    // The odd lines are excited, up to the highest frequency.
    let lines = measured.iter().skip(1).step_by(2).take_while(|p| p.freq_hz <= plan.up_to_hz * (1.0 + 1e-9));
    let points: Vec<GainPoint> = lines.map(point).collect();
    let samples = records.iter().map(|r| r.base.len()).sum::<usize>() as f64;
    let mean_squared_angle = records.iter().map(|r| r.sum_squared_angle).sum::<f64>() / samples;
    Ok(GainCurve {
        axis,
        peak: highest_peak(&points),
        peak_model: response.peak(axis, plan.up_to_hz, plan.acceleration),
        points,
        swing_rms_deg: mean_squared_angle.sqrt().to_degrees(),
        swing_most_deg: records.iter().map(|r| r.max_angle).fold(0.0, f64::max).to_degrees(),
        coil_contact: records.iter().find_map(|r| r.coil_contact),
    })
}

/// The highest local maximum of a gain curve, interpolated between spectral lines.
///
/// Near a resonance the reciprocal of the squared gain is a parabola in the squared frequency,
/// `((f0^2 - f^2)^2 + (2 zeta f0 f)^2) / const`, which three lines determine.
fn highest_peak(points: &[GainPoint]) -> Option<Peak> {
    let maxima = points.windows(3).filter(|w| w[1].gain > w[0].gain && w[1].gain >= w[2].gain);
    let [a, b, c] = maxima.max_by(|a, b| a[1].gain.total_cmp(&b[1].gain))? else { return None };
    let squared_frequency = |p: &GainPoint| p.freq_hz * p.freq_hz;
    let reciprocal = |p: &GainPoint| 1.0 / (p.gain * p.gain);
    // Newton's form about the middle line b: reciprocal(b) + slope d + bend d^2 with d = f^2 - f_b^2.
    let (left, right) = (squared_frequency(a) - squared_frequency(b), squared_frequency(c) - squared_frequency(b));
    let (to_left, to_right) = ((reciprocal(a) - reciprocal(b)) / left, (reciprocal(c) - reciprocal(b)) / right);
    let bend = (to_right - to_left) / (right - left);
    let slope = to_left - bend * left;
    let at = -slope / (2.0 * bend);
    let lowest = reciprocal(b) + slope * at * 0.5;
    let is_valid = bend > 0.0 && at > left && at < right && lowest > 0.0;
    Some(if is_valid {
        Peak { freq_hz: (squared_frequency(b) + at).sqrt(), gain: 1.0 / lowest.sqrt() }
    } else {
        Peak { freq_hz: b.freq_hz, gain: b.gain }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_resonance_between_lines_is_interpolated_from_three_lines() {
        // Squared gain 1 / ((f0^2 - f^2)^2 + (2 zeta f0 f)^2): peak at f0 sqrt(1 - 2 zeta^2) with gain
        // 1 / (2 zeta sqrt(1 - zeta^2) f0^2).
        let (f0, zeta) = (1.237_f64, 0.02_f64);
        let point = |k: u32| {
            let f = f64::from(k) * 0.025;
            let gain = 1.0 / ((f0 * f0 - f * f).powi(2) + (2.0 * zeta * f0 * f).powi(2)).sqrt();
            GainPoint {
                freq_hz: f,
                gain,
                coherence: 1.0,
                gain_sigma: 0.0,
                gain_model: gain,
                phase_rad: 0.0,
                phase_model_rad: 0.0,
            }
        };
        let points: Vec<_> = (1..200).map(point).collect();
        let peak = highest_peak(&points).unwrap();
        assert!((peak.freq_hz / (f0 * (1.0 - 2.0 * zeta * zeta).sqrt()) - 1.0).abs() < 1e-9);
        assert!((peak.gain * 2.0 * zeta * (1.0 - zeta * zeta).sqrt() * f0 * f0 - 1.0).abs() < 1e-9);
        assert_eq!(highest_peak(&points[..30]), None);
    }
}
