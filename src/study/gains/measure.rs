//! From a plan to curves.

use super::drive::{Schedule, Shaken};
use super::{AXES, GainCurve, GainPlan, GainPoint};
use crate::dynamics::{GainPoints, HeadModel, HeadSimulation, HeadState, Peak, Quantity};
use crate::geometry::{Pose, Rotation, Vector};
use crate::motion::Axis;
use crate::signal::{Segments, TransferPoint, transfer_function};
use crate::study::watch::PieceProgress;
use crate::study::{OnProgress, StudyError};
use rayon::prelude::*;
use std::ops::RangeInclusive;

/// How many realisations there may be.
const REALISATIONS: RangeInclusive<usize> = 2..=1000;
/// Most steps of all periods that are kept for an axis: 160 MB, and six axes are kept at once.
const MOST_KEPT: usize = 10_000_000;

/// The gains of `head` along and about all six axes, in the order of [`AXES`].
///
/// Realisations run in parallel; the result is the same for any number of threads. `on_progress` is told after each of
/// them.
///
/// # Errors
/// When the plan cannot be carried out, or the head's simulation fails.
pub fn gain_curves(
    head: &HeadModel,
    plan: &GainPlan,
    on_progress: OnProgress<'_>,
) -> Result<Vec<GainCurve>, StudyError> {
    let schedule = checked(head, plan)?;
    let tasks: Vec<_> = AXES.iter().flat_map(|axis| (0..plan.realisations).map(|k| (*axis, k))).collect();
    let pieces = PieceProgress::new(tasks.len(), on_progress);
    let records = tasks.par_iter().map(|(axis, k)| {
        let record = record(head, *axis, *k, plan, schedule);
        pieces.finish_one();
        record
    });
    let records = records.collect::<Result<Vec<_>, _>>()?;
    let of_axes = AXES.iter().zip(records.chunks(plan.realisations));
    of_axes.map(|(axis, records)| curve(head, *axis, records, plan, schedule)).collect()
}

/// The gain of `head` along or about `axis`; `on_progress` is told after each realisation.
///
/// # Errors
/// When the plan cannot be carried out, or the head's simulation fails.
pub fn gain_curve(
    head: &HeadModel,
    axis: Axis,
    plan: &GainPlan,
    on_progress: OnProgress<'_>,
) -> Result<GainCurve, StudyError> {
    let schedule = checked(head, plan)?;
    let pieces = PieceProgress::new(plan.realisations, on_progress);
    let records = (0..plan.realisations).into_par_iter().map(|k| {
        let record = record(head, axis, k, plan, schedule);
        pieces.finish_one();
        record
    });
    curve(head, axis, &records.collect::<Result<Vec<_>, _>>()?, plan, schedule)
}

fn checked(head: &HeadModel, plan: &GainPlan) -> Result<Schedule, StudyError> {
    if let Some(why) = head.rigid_mount_reason() {
        return Err(StudyError::Plan { what: "head", message: why.to_owned() });
    }
    if !REALISATIONS.contains(&plan.realisations) {
        let (least, most) = (REALISATIONS.start(), REALISATIONS.end());
        let message = format!("{}; {least} or more, which coherence needs, and {most} at most", plan.realisations);
        return Err(StudyError::Plan { what: "realisations", message });
    }
    let schedule = Schedule::of(head, plan)?;
    let kept = plan.realisations * schedule.period;
    if kept > MOST_KEPT {
        let message = format!(
            "{} of {} steps each are {kept} steps; {MOST_KEPT} at most: take fewer, a shorter period or longer steps",
            plan.realisations, schedule.period
        );
        return Err(StudyError::Plan { what: "realisations", message });
    }
    Ok(schedule)
}

/// One period of a settled head.
#[derive(Debug, Clone, Default)]
struct Record {
    base: Vec<f64>,
    head: Vec<f64>,
    /// Squared turn of the head from its rest on the base, rad^2.
    turn_squared: f64,
    /// The greatest turn, rad.
    turn_most: f64,
}

fn record(
    head: &HeadModel,
    axis: Axis,
    index: usize,
    plan: &GainPlan,
    schedule: Schedule,
) -> Result<Record, StudyError> {
    let points = plan.points.unwrap_or_else(|| head.default_points());
    let shaken = Shaken::new(axis, index, plan, schedule, &points.base_in_base)?;
    let watch = Watch::new(head, axis, &points, plan.quantity);
    let mut record = Record::default();
    for (step, state) in HeadSimulation::new(head, &shaken, plan.step_s)?.enumerate().take(schedule.steps()) {
        let state = state?;
        if step >= schedule.settling {
            watch.look(&state, &mut record);
        }
    }
    Ok(record)
}

/// What is read off base and head, along or about one axis.
struct Watch {
    axis: usize,
    is_rotation: bool,
    quantity: Quantity,
    base_from_point: Pose,
    head_from_point: Pose,
    rest: Rotation,
}

impl Watch {
    fn new(head: &HeadModel, axis: Axis, points: &GainPoints, quantity: Quantity) -> Self {
        let at = |point: &Vector| Pose::from_parts((*point).into(), Rotation::identity());
        Self {
            axis: axis as usize % 3,
            is_rotation: axis.is_rotation(),
            quantity,
            base_from_point: at(&points.base_in_base),
            head_from_point: at(&points.head_in_head),
            rest: head.rest_pose_base_from_head().rotation,
        }
    }

    /// Adds an instant: rates as gyroscopes would read them, accelerations in the world or specific forces as
    /// accelerometers would read them; the head's in axes that agree with the base's at rest.
    fn look(&self, state: &HeadState, record: &mut Record) {
        let (base, head) = (state.base.of_frame(&self.base_from_point), state.head.of_frame(&self.head_from_point));
        let (of_base, of_head) = match (self.is_rotation, self.quantity) {
            (true, _) => (base.angular_velocity_in_body(), self.rest * head.angular_velocity_in_body()),
            (false, Quantity::Kinematic) => (base.acceleration_in_world, head.acceleration_in_world),
            (false, Quantity::SpecificForce) => {
                (base.specific_force_in_body(), self.rest * head.specific_force_in_body())
            }
        };
        record.base.push(of_base[self.axis]);
        record.head.push(of_head[self.axis]);
        let turn = (base.world_from_body.rotation * self.rest).angle_to(&head.world_from_body.rotation);
        record.turn_squared += turn * turn;
        record.turn_most = record.turn_most.max(turn);
    }
}

/// The curve from the records of its realisations.
fn curve(
    head: &HeadModel,
    axis: Axis,
    records: &[Record],
    plan: &GainPlan,
    schedule: Schedule,
) -> Result<GainCurve, StudyError> {
    let joined = |of: fn(&Record) -> &Vec<f64>| records.iter().flat_map(|r| of(r).iter().copied()).collect::<Vec<_>>();
    let (base, moved) = (joined(|r| &r.base), joined(|r| &r.head));
    let measured = transfer_function(&base, &moved, 1.0 / plan.step_s, Segments::periods(schedule.period))?;
    let points = plan.points.unwrap_or_else(|| head.default_points());
    let response = head.frequency_response(&points);
    let point = |p: &TransferPoint| GainPoint {
        freq_hz: p.freq_hz,
        gain: p.gain(),
        coherence: p.coherence,
        gain_sigma: p.gain_sigma,
        gain_model: response.gain(axis, p.freq_hz, plan.quantity),
    };
    // The lines of the signal: the first multiple of the line spacing, and on to the highest frequency.
    let lines = measured.iter().skip(1).take_while(|p| p.freq_hz <= plan.up_to_hz * (1.0 + 1e-9));
    let points: Vec<GainPoint> = lines.map(point).collect();
    let samples = records.iter().map(|r| r.base.len()).sum::<usize>() as f64;
    let turn_squared = records.iter().map(|r| r.turn_squared).sum::<f64>() / samples;
    Ok(GainCurve {
        axis,
        peak: highest_peak(&points),
        peak_model: response.peak(axis, plan.up_to_hz, plan.quantity),
        points,
        swing_rms_deg: turn_squared.sqrt().to_degrees(),
        swing_most_deg: records.iter().map(|r| r.turn_most).fold(0.0, f64::max).to_degrees(),
    })
}

/// The highest peak that stands out between its neighbours.
///
/// Between lines it is interpolated: near a resonance the reciprocal of the squared gain is a parabola in the squared
/// frequency, `((f0^2 - f^2)^2 + (2 zeta f0 f)^2) / const`, of which three lines tell all.
fn highest_peak(points: &[GainPoint]) -> Option<Peak> {
    let tops = points.windows(3).filter(|w| w[1].gain > w[0].gain && w[1].gain >= w[2].gain);
    let [a, b, c] = tops.max_by(|a, b| a[1].gain.total_cmp(&b[1].gain))? else { return None };
    let place = |p: &GainPoint| p.freq_hz * p.freq_hz;
    let height = |p: &GainPoint| 1.0 / (p.gain * p.gain);
    // Newton's form about the middle line: height = h + slope d + curve d^2, d = place - place(b).
    let (left, right) = (place(a) - place(b), place(c) - place(b));
    let (to_left, to_right) = ((height(a) - height(b)) / left, (height(c) - height(b)) / right);
    let bend = (to_right - to_left) / (right - left);
    let slope = to_left - bend * left;
    let at = -slope / (2.0 * bend);
    let lowest = height(b) + slope * at * 0.5;
    let is_sound = bend > 0.0 && at > left && at < right && lowest > 0.0;
    Some(if is_sound {
        Peak { freq_hz: (place(b) + at).sqrt(), gain: 1.0 / lowest.sqrt() }
    } else {
        Peak { freq_hz: b.freq_hz, gain: b.gain }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_resonance_between_lines_is_found_from_three_of_them() {
        // 1 / ((f0^2 - f^2)^2 + (2 zeta f0 f)^2): peak at f0 sqrt(1 - 2 zeta^2), height 1 / (2 zeta sqrt(1 - zeta^2)
        // f0^2).
        let (f0, zeta) = (1.237_f64, 0.02_f64);
        let point = |k: u32| {
            let f = f64::from(k) * 0.025;
            let gain = 1.0 / ((f0 * f0 - f * f).powi(2) + (2.0 * zeta * f0 * f).powi(2)).sqrt();
            GainPoint { freq_hz: f, gain, coherence: 1.0, gain_sigma: 0.0, gain_model: gain }
        };
        let points: Vec<_> = (1..200).map(point).collect();
        let peak = highest_peak(&points).unwrap();
        assert!((peak.freq_hz / (f0 * (1.0 - 2.0 * zeta * zeta).sqrt()) - 1.0).abs() < 1e-9);
        assert!((peak.gain * 2.0 * zeta * (1.0 - zeta * zeta).sqrt() * f0 * f0 - 1.0).abs() < 1e-9);
        assert_eq!(highest_peak(&points[..30]), None);
    }
}
