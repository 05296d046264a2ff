//! Periodic motion of the base on a shaker, tabulated over one period.

use super::GainPlan;
use crate::HeadError;
use std::ops::RangeInclusive;
use zsim_base::geometry::{Kinematics, Pose, Vector};
use zsim_base::spec::Source;
use zsim_dynamics::HeadModel;
use zsim_motion::{Axis, BaseMotion, DriveSpec, Level, MotionSpec, Phases, ShakerSpec, SignalSpec};

/// Time in which the shaker reaches its full amplitude, s.
const ONSET_S: f64 = 1.0;

/// Remaining fraction of the slowest transient at the start of the recording.
const RESIDUAL_TRANSIENT: f64 = 1e-5;

/// Valid time steps of the simulation, s.
const STEPS_S: RangeInclusive<f64> = 1e-5..=0.1;
/// Maximum number of spectral lines of a multisine: each pose of the base is a sum of as many sines.
const MAX_LINES: f64 = 10_000.0;
/// Maximum number of steps per period: each thread keeps one period of the base's motion in memory.
const MAX_STEPS: f64 = 1e6;

/// Durations of a measurement, in simulation steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Schedule {
    /// Steps until transients have decayed.
    pub settling: usize,
    /// Steps per period of the multisine.
    pub period: usize,
}

impl Schedule {
    /// Computes settling time and period for `head`.
    ///
    /// # Errors
    /// If the time step is out of range, or if the period has too few or too many lines or steps.
    pub fn new(head: &HeadModel, plan: &GainPlan) -> Result<Self, HeadError> {
        if !STEPS_S.contains(&plan.step_s) {
            let message = format!("{} s: expected {} to {} s", plan.step_s, STEPS_S.start(), STEPS_S.end());
            return Err(HeadError::Plan { what: "step", message });
        }
        let modes = head.linear_modes();
        let decay = modes.iter().map(|mode| mode.decay_per_s());
        let settling_s = decay.fold(0.0, |longest, rate| f64::max(longest, -RESIDUAL_TRANSIENT.ln() / rate));
        let settling_s = ONSET_S + settling_s.min(plan.longest_settling_s);
        let within = modes.iter().filter(|m| m.frequency_hz < plan.up_to_hz);
        let narrowest_hz = within.map(|m| m.frequency_hz * m.damping_ratio).fold(f64::INFINITY, f64::min);
        let period_s = plan.period_s.unwrap_or_else(|| (2.0 / narrowest_hz).ceil().clamp(20.0, 200.0));
        let steps_to_highest = 1.0 / (plan.step_s * plan.up_to_hz);
        if !(steps_to_highest >= 4.0 && period_s * plan.up_to_hz >= 1.0) {
            let message = format!(
                "{} Hz: expected at least one line of a period of {period_s} s, and at most a quarter of the rate of {} s steps",
                plan.up_to_hz, plan.step_s
            );
            return Err(HeadError::Plan { what: "highest frequency", message });
        }
        if period_s * plan.up_to_hz > MAX_LINES {
            let message = format!(
                "{period_s} s and {} Hz give {:.3e} lines, more than {MAX_LINES}: use a shorter period or a lower highest \
                 frequency",
                plan.up_to_hz,
                period_s * plan.up_to_hz
            );
            return Err(HeadError::Plan { what: "period", message });
        }
        if period_s / plan.step_s > MAX_STEPS {
            let message = format!(
                "{period_s} s in steps of {} s are {:.3e} steps, more than {MAX_STEPS}: use a shorter period or longer steps",
                plan.step_s,
                period_s / plan.step_s
            );
            return Err(HeadError::Plan { what: "period", message });
        }
        let steps = |span_s: f64| (span_s / plan.step_s).round() as usize;
        Ok(Self { settling: steps(settling_s) + 1, period: steps(period_s) })
    }

    /// Total steps of a realisation.
    pub fn steps(&self) -> usize {
        self.settling + self.period
    }
}

/// A base that is shaken along or about one axis through a given point.
pub(super) struct ShakenBase {
    motion: Box<dyn BaseMotion>,
    base_from_point: Pose,
    step_s: f64,
    period: usize,
    /// First step of the periodic motion.
    from: usize,
    /// Motion at each step of one period.
    table: Vec<Kinematics>,
}

impl ShakenBase {
    /// Realisation `index` of the motion along or about `axis` through the base's point `about`.
    ///
    /// # Errors
    /// If the plan does not define a valid signal.
    pub fn new(
        axis: Axis,
        index: usize,
        plan: &GainPlan,
        schedule: Schedule,
        about: &Vector,
    ) -> Result<Self, HeadError> {
        let rms = if axis.is_rotation() {
            Level::DegreesPerS(plan.rotation_deg_per_s)
        } else {
            Level::MetresPerS2(plan.acceleration_m_per_s2)
        };
        let period_s = schedule.period as f64 * plan.step_s;
        let (low_hz, high_hz, phases) = (1.0 / period_s, plan.up_to_hz, Phases::Random);
        let signal = SignalSpec::Multisine { period_s, low_hz, high_hz, rms, phases, odd: true };
        let drives = vec![DriveSpec { axis, signal }];
        let spec = MotionSpec::Shaker(ShakerSpec { height_m: 0.0, still_s: 0.0, onset_s: ONSET_S, drives });
        let seed = plan.seed.child(&format!("gains/{axis:?}/{index}"));
        let source = Source::in_memory("the gains' multisine", "");
        let motion = spec.build(&source, None, schedule.steps() as f64 * plan.step_s, seed)?;
        let from = (ONSET_S / plan.step_s).ceil() as usize + 1;
        let base_from_point = Pose::from_parts((*about).into(), Default::default());
        let mut shaken =
            Self { motion, base_from_point, step_s: plan.step_s, period: schedule.period, from, table: Vec::new() };
        shaken.table = (from..from + schedule.period).map(|n| shaken.computed(n as f64 * plan.step_s)).collect();
        Ok(shaken)
    }

    /// Motion at a time, without the table.
    fn computed(&self, t_s: f64) -> Kinematics {
        self.motion.at(t_s).of_frame(&self.base_from_point.inverse())
    }
}

impl BaseMotion for ShakenBase {
    fn at(&self, t_s: f64) -> Kinematics {
        let step = (t_s / self.step_s).round();
        let is_on_step = (t_s - step * self.step_s).abs() < 1e-6 * self.step_s;
        match (step as usize).checked_sub(self.from) {
            Some(after) if is_on_step => self.table[after % self.period],
            _ => self.computed(t_s),
        }
    }
}
