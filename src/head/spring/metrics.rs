//! Metrics of a spring design, from the linearised head or from a simulation.

use super::margins::{LoadRecord, SpringMargins};
use super::model::SpringModel;
use crate::HeadError;
use crate::coverage::{Coverage, CoveragePlan, coverage};
use nalgebra::Complex;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use zsim_base::geometry::{Kinematics, Pose, Rotation, Vector};
use zsim_base::random::Seed;
use zsim_base::spec::Source;
use zsim_dynamics::{AccelerationKind, CoilGaps, FrequencyResponse, GainPoints, HeadModel, HeadSpec, HeadState};
use zsim_elasticity::split;
use zsim_motion::{Axis, BaseMotion, DriveSpec, Level, MotionSpec, ShakerSpec, SignalSpec};
use zsim_sensors::Lidar;

/// Metrics of a head on a spring under a [`Shake`] of the base.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DesignMetrics {
    /// Frequency of the slowest mode, Hz.
    pub rocking_hz: f64,
    /// Peak gain of the pitch rate.
    pub peak_gain: f64,
    /// Static compression of a single spring under the head, mm; `None` for several springs or one given by its stiffness.
    pub sag_mm: Option<f64>,
    /// Mass of the active wire, of all springs together, g; `None` if spring or material are specified by stiffness only.
    pub spring_mass_g: Option<f64>,
    /// Field of view, degrees: twice the pitch amplitude, or in a simulation the 95 % elevation range of the forward
    /// beam.
    pub field_of_view_deg: f64,
    /// Maximum angular velocity, degrees/s.
    pub rate_deg_per_s: f64,
    /// Maximum stress in the wire divided by the yield stress; `None` if either is not known.
    pub stress_share: Option<f64>,
    /// Margin of the wire's stress cycle by Goodman's line over the mission; `None` if the strength of the wire is unknown.
    pub fatigue_margin: Option<f64>,
    /// Margins of the spring.
    pub margins: SpringMargins,
}

/// Upper frequency of the search for the peak gain, Hz: above the modes of interest.
const MAX_PEAK_HZ: f64 = 20.0;

/// Computes the metrics of the linearised head: static pose, stiffness, modes and gains.
///
/// The response is linear for any amplitude. The computation takes less than 1 ms. In the mission, the head swings for
/// `mission_hours`.
///
/// # Errors
/// When the spec is invalid or the head has no stable rest pose. A head above the maximum mass of its spring is no error.
pub fn closed_form(
    spec: &HeadSpec,
    source: &Source,
    shake: &Shake,
    mission_hours: f64,
) -> Result<DesignMetrics, HeadError> {
    let head = HeadModel::new_without_advice(spec, source)?;
    let model = SpringModel::of(spec, head.body())?;
    let frequency_hz = shake.frequency_of(&head);
    let foot = head.default_points().base_in_base;
    let points = GainPoints { base_in_base: foot, head_in_head: head.body().centre_of_mass_in_head };
    let response = head.frequency_response(&points);
    let swing = LinearSwing { head: &head, response: &response, foot, omega: TAU * frequency_hz, shake };
    let pitch = swing.amplitude()[4].norm();
    let phases = (0..12).map(|k| f64::from(k) * TAU / 12.0);
    let mut loads = LoadRecord::of_linear_swing(&model, &head);
    phases.for_each(|phase| loads.add(&swing.state(phase), &[]));
    let motion_deg = (2.0 * pitch.to_degrees(), (swing.omega * pitch).to_degrees());
    Ok(metrics(&model, &head, &loads, motion_deg, mission_hours * 3600.0 * frequency_hz))
}

/// Computes the metrics by a full simulation of the shake, with the coverage of `lidar`; the mission as in [`closed_form`].
///
/// # Errors
/// When the spec is invalid, the head has no stable rest pose, or the simulation fails.
pub fn simulated(
    spec: &HeadSpec,
    source: &Source,
    shake: &Shake,
    lidar: &Lidar,
    plan: &CoveragePlan,
    mission_hours: f64,
) -> Result<(DesignMetrics, Coverage), HeadError> {
    let head = HeadModel::new(spec, source)?;
    let model = SpringModel::of(spec, head.body())?;
    let frequency_hz = shake.frequency_of(&head);
    let amplitude = Level::Degrees(shake.pitch_deg);
    let signal = SignalSpec::SweptSine { from_hz: frequency_hz, to_hz: frequency_hz, amplitude };
    let drives = vec![DriveSpec { axis: Axis::Pitch, signal }];
    let shaker = MotionSpec::Shaker(ShakerSpec { height_m: 1.1, still_s: 0.5, onset_s: 2.0, drives });
    let duration_s = plan.from_s + plan.duration_s;
    let shake = shaker.build(&Source::in_memory("the shake of the base", ""), None, duration_s, Seed(1))?;
    let base_from_shaken = Pose::from_parts(head.default_points().base_in_base.into(), Rotation::identity());
    let motion = ShakeAboutFoot { shake: shake.as_ref(), shaken_from_base: base_from_shaken.inverse() };
    let (mut loads, mut step) = (LoadRecord::of_simulation(&model, &head), 0_usize);
    let mut gaps = CoilGaps::of(&head);
    let coverage = coverage(&head, &motion, lidar, plan, |state| {
        step += 1;
        // A period has hundreds of steps, so every tenth is sufficient for the maximum.
        if step.is_multiple_of(10) {
            let base_from_head = state.base.world_from_body.inv_mul(&state.head.world_from_body);
            loads.add(state, &gaps.of_each(&base_from_head));
        }
    })?;
    let motion_deg = (coverage.field_of_view_deg, coverage.gyro.most_deg_per_s);
    Ok((metrics(&model, &head, &loads, motion_deg, mission_hours * 3600.0 * frequency_hz), coverage))
}

/// Motion of a base that is shaken about the foot of the spring.
struct ShakeAboutFoot<'a> {
    shake: &'a dyn BaseMotion,
    shaken_from_base: Pose,
}

impl BaseMotion for ShakeAboutFoot<'_> {
    fn at(&self, t_s: f64) -> Kinematics {
        self.shake.at(t_s).of_frame(&self.shaken_from_base)
    }
}

/// The metrics of a head with this field of view and maximum rate, whose `loads` are repeated `cycles` times in the mission.
fn metrics(
    model: &SpringModel,
    head: &HeadModel,
    loads: &LoadRecord,
    (field_of_view_deg, rate_deg_per_s): (f64, f64),
    cycles: f64,
) -> DesignMetrics {
    let response = head.frequency_response(&head.default_points());
    let peak = response.peak(Axis::Pitch, MAX_PEAK_HZ, AccelerationKind::Kinematic);
    let margins = loads.margins();
    DesignMetrics {
        rocking_hz: head.linear_modes().first().map_or(f64::INFINITY, |mode| mode.frequency_hz),
        peak_gain: peak.map_or(1.0, |peak| peak.gain),
        sag_mm: model.sag_m(head).map(|sag_m| sag_m * 1e3),
        spring_mass_g: model.mass_kg.map(|mass_kg| mass_kg * 1e3),
        field_of_view_deg,
        rate_deg_per_s,
        stress_share: margins.yielding.map(|margin| 1.0 / margin),
        fatigue_margin: loads.fatigue_margin(cycles),
        margins,
    }
}

/// The linear response to a shake.
struct LinearSwing<'a> {
    head: &'a HeadModel,
    response: &'a FrequencyResponse,
    foot: Vector,
    omega: f64,
    shake: &'a Shake,
}

impl LinearSwing<'_> {
    /// Complex amplitude of translation (m) and rotation (rad) of the centre of mass.
    fn amplitude(&self) -> [Complex<f64>; 6] {
        let base_rad = self.shake.base_rad();
        let per_base = self.response.displacement(Axis::Pitch, self.omega / TAU);
        std::array::from_fn(|k| per_base[k] * base_rad)
    }

    /// State of base and head at `phase` of the shake, rad.
    ///
    /// Velocities are set to zero: centrifugal and gyroscopic loads are of second order in the amplitude.
    fn state(&self, phase: f64) -> HeadState {
        let phasor = Complex::from_polar(1.0, phase);
        let displacement = zsim_elasticity::Vector6::from(self.amplitude().map(|a| (a * phasor).re));
        let (shift, turn) = split(&displacement);
        let rest = self.head.base_from_head_at_rest();
        let centre_in_head = self.head.body().centre_of_mass_in_head;
        let rotation = Rotation::from_scaled_axis(turn) * rest.rotation;
        let centre = rest * nalgebra::Point3::from(centre_in_head) + shift;
        let arm = rotation * centre_in_head;
        let angular_acceleration = turn * -(self.omega * self.omega);
        let mut head = Kinematics::at_rest(Pose::from_parts((centre.coords - arm).into(), rotation));
        head.angular_acceleration_in_world = angular_acceleration;
        head.acceleration_in_world = shift * -(self.omega * self.omega) - angular_acceleration.cross(&arm);
        let pitch = self.shake.base_rad() * phase.cos();
        let base_rotation = Rotation::from_scaled_axis(Vector::y() * pitch);
        let origin = self.foot - base_rotation * self.foot;
        let base = Kinematics::at_rest(Pose::from_parts(origin.into(), base_rotation));
        HeadState { t_s: 0.0, head, base }
    }
}

/// A sinusoidal pitch motion of the base about the foot of the spring, as by a hand.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Shake {
    /// Amplitude of the base's pitch, degrees.
    #[serde(with = "zsim_base::spec::checked::Positive")]
    pub pitch_deg: f64,
    /// Frequency, Hz; default: that of the slowest mode of the head.
    pub frequency_hz: Option<f64>,
}

impl Shake {
    /// Checks the frequency, which a spec can leave out.
    ///
    /// # Errors
    /// A message if it is not a finite number above 0.
    pub fn check(&self) -> Result<(), String> {
        match self.frequency_hz {
            Some(hz) if !(hz.is_finite() && hz > 0.0) => {
                Err(format!("frequency_hz: expected a finite number above 0, found {hz}"))
            }
            _ => Ok(()),
        }
    }

    /// Amplitude of the base's pitch, rad.
    pub(super) fn base_rad(&self) -> f64 {
        self.pitch_deg.to_radians()
    }

    /// The frequency, Hz; 1 Hz for a head without modes.
    pub(super) fn frequency_of(&self, head: &HeadModel) -> f64 {
        self.frequency_hz.unwrap_or(head.linear_modes().first().map_or(1.0, |mode| mode.frequency_hz))
    }
}

impl Default for Shake {
    /// 2 degrees at the slowest mode.
    fn default() -> Self {
        Self { pitch_deg: 2.0, frequency_hz: None }
    }
}
