//! A design in figures: at once from the linearised head, or from a simulation.

use super::{Shake, SpringMounting, Wire};
use crate::dynamics::{FrequencyResponse, GainPoints, HeadModel, HeadSpec, HeadState, LinkageSpec, Quantity};
use crate::elasticity::{SpringDesign, split};
use crate::geometry::{Kinematics, Pose, Rotation, Vector};
use crate::motion::{Axis, BaseMotion, DriveSpec, Level, MotionSpec, ShakerSpec, SignalSpec};
use crate::random::Seed;
use crate::sensors::Lidar;
use crate::spec::Source;
use crate::study::StudyError;
use crate::study::coverage::{Coverage, CoveragePlan, coverage};
use nalgebra::Complex;
use serde::Serialize;
use std::f64::consts::TAU;

/// What a head on its spring comes to, under a hand's [`Shake`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DesignFigures {
    /// Frequency of the slowest mode, Hz.
    pub rocking_hz: f64,
    /// Greatest gain of the pitch rate.
    pub peak_gain: f64,
    /// How far the spring shortens under the head, mm.
    pub sag_mm: f64,
    /// Mass of the spring's active wire, g; nothing for a spring or a material known by its stiffness alone.
    pub spring_mass_g: Option<f64>,
    /// Twice the amplitude of the head's pitch, degrees; from a simulation the forward beam's range in 95 % of the
    /// time.
    pub field_of_view_deg: f64,
    /// Greatest rate of rotation, degrees/s.
    pub rate_deg_per_s: f64,
    /// Greatest stress in the wire over its yield.
    pub stress_share: Option<f64>,
}

/// Frequencies up to which the peak gain is looked for, Hz.
const PEAKS_UP_TO_HZ: f64 = 20.0;

/// The figures of the linearised head: from geometry to static pose, stiffness, modes and gains, in a fraction of a
/// millisecond. The swing is the linear one, however large.
///
/// # Errors
/// When the spec is wrong or the head does not stand; the error does not say how nearly.
pub fn closed_form(spec: &HeadSpec, source: &Source, shake: &Shake) -> Result<DesignFigures, StudyError> {
    let head = HeadModel::new_without_advice(spec, source)?;
    let design = Design::of(spec, &head)?;
    let frequency_hz = shake.frequency_hz.unwrap_or(head.linear_modes().first().map_or(1.0, |mode| mode.frequency_hz));
    let foot = head.default_points().base_in_base;
    let points = GainPoints { base_in_base: foot, head_in_head: head.body().centre_of_mass_in_head };
    let response = head.frequency_response(&points);
    let swing = Swing { head: &head, response: &response, foot, omega: TAU * frequency_hz, shake };
    let pitch = swing.amplitude()[4].norm();
    let phases = (0..12).map(|k| f64::from(k) * TAU / 12.0);
    let stress = phases.filter_map(|phase| design.stress_pa(&swing.state(phase))).reduce(f64::max);
    Ok(design.figures(
        &head,
        &Swung {
            field_of_view_deg: 2.0 * pitch.to_degrees(),
            rate_deg_per_s: (swing.omega * pitch).to_degrees(),
            stress,
        },
    ))
}

/// The same figures from a full simulation of the shake, and what `lidar` saw meanwhile.
///
/// # Errors
/// When the spec is wrong, the head does not stand, or its simulation fails.
pub fn simulated(
    spec: &HeadSpec,
    source: &Source,
    shake: &Shake,
    lidar: &Lidar,
    plan: &CoveragePlan,
) -> Result<(DesignFigures, Coverage), StudyError> {
    let head = HeadModel::new(spec, source)?;
    let design = Design::of(spec, &head)?;
    let frequency_hz = shake.frequency_hz.unwrap_or(head.linear_modes().first().map_or(1.0, |mode| mode.frequency_hz));
    let amplitude = Level::Degrees(shake.pitch_deg);
    let signal = SignalSpec::SweptSine { from_hz: frequency_hz, to_hz: frequency_hz, amplitude };
    let drives = vec![DriveSpec { axis: Axis::Pitch, signal }];
    let shaker = MotionSpec::Shaker(ShakerSpec { height_m: 1.1, still_s: 0.5, onset_s: 2.0, drives });
    let duration_s = plan.from_s + plan.duration_s;
    let shake = shaker.build(&Source::in_memory("the hand's shake", ""), None, duration_s, Seed(1))?;
    let base_from_shaken = Pose::from_parts(head.default_points().base_in_base.into(), Rotation::identity());
    let motion = AboutFoot { shake: shake.as_ref(), shaken_from_base: base_from_shaken.inverse() };
    let (mut stress, mut step) = (None, 0_usize);
    let seen = coverage(&head, &motion, lidar, plan, |state| {
        step += 1;
        // A swing takes hundreds of steps: a tenth of them will do.
        if step.is_multiple_of(10) {
            stress = [stress, design.stress_pa(state)].into_iter().flatten().reduce(f64::max);
        }
    })?;
    let swung = Swung { field_of_view_deg: seen.field_of_view_deg, rate_deg_per_s: seen.gyro.most_deg_per_s, stress };
    Ok((design.figures(&head, &swung), seen))
}

/// A base that is shaken at the spring's foot.
struct AboutFoot<'a> {
    shake: &'a dyn BaseMotion,
    shaken_from_base: Pose,
}

impl BaseMotion for AboutFoot<'_> {
    fn at(&self, t_s: f64) -> Kinematics {
        self.shake.at(t_s).of_frame(&self.shaken_from_base)
    }
}

/// What differs between the linear swing and the simulated one.
struct Swung {
    field_of_view_deg: f64,
    rate_deg_per_s: f64,
    stress: Option<f64>,
}

/// What a design is before it swings.
pub(super) struct Design {
    pub wire: Option<Wire>,
    pub mounting: Option<SpringMounting>,
    /// Whether the spring bears the head alone, without a cable: then its stress follows from the head's motion.
    pub is_alone: bool,
    pub free_length_m: Option<f64>,
    pub mass_kg: Option<f64>,
}

impl Design {
    pub fn of(spec: &HeadSpec, head: &HeadModel) -> Result<Self, StudyError> {
        let mounting = SpringMounting::of(spec, head.body());
        let LinkageSpec::Spring { spring, cable, .. } = &spec.linkage else {
            return Ok(Self { mounting, ..Self::unmounted() });
        };
        let coil = match spring.design().map_err(crate::dynamics::DynamicsError::from)? {
            SpringDesign::Coil(coil) => Some(coil),
            SpringDesign::Stiffness { .. } => None,
        };
        Ok(Self {
            wire: Wire::of(spring)?,
            mounting,
            is_alone: cable.is_none(),
            free_length_m: coil.map(|coil| coil.free_length_m()),
            mass_kg: spring.wire_mass_kg().map_err(crate::dynamics::DynamicsError::from)?,
        })
    }

    /// Of a head that has no place.
    pub fn unmounted() -> Self {
        Self { wire: None, mounting: None, is_alone: false, free_length_m: None, mass_kg: None }
    }

    /// Greatest stress in the wire at an instant, Pa; nothing where there is no one spring that bears the head alone.
    pub fn stress_pa(&self, state: &HeadState) -> Option<f64> {
        let (wire, mounting) = self.wire.zip(self.mounting).filter(|_| self.is_alone)?;
        Some(mounting.stress_pa(&wire, state))
    }

    fn figures(&self, head: &HeadModel, swung: &Swung) -> DesignFigures {
        let response = head.frequency_response(&head.default_points());
        let peak = response.peak(Axis::Pitch, PEAKS_UP_TO_HZ, Quantity::Kinematic);
        let yields = self.wire.and_then(|wire| wire.yield_pa());
        DesignFigures {
            rocking_hz: head.linear_modes().first().map_or(f64::INFINITY, |mode| mode.frequency_hz),
            peak_gain: peak.map_or(1.0, |peak| peak.gain),
            sag_mm: self.sag_m(head) * 1e3,
            spring_mass_g: self.mass_kg.map(|mass_kg| mass_kg * 1e3),
            field_of_view_deg: swung.field_of_view_deg,
            rate_deg_per_s: swung.rate_deg_per_s,
            stress_share: swung.stress.zip(yields).map(|(stress, yields)| stress / yields),
        }
    }

    /// How much nearer foot and top are at rest than without load; 0 where the length without load is not known.
    pub fn sag_m(&self, head: &HeadModel) -> f64 {
        let (Some(mounting), Some(free_length_m)) = (&self.mounting, self.free_length_m) else { return 0.0 };
        free_length_m - mounting.length_m(head.rest_pose_base_from_head())
    }
}

/// The linear swing under a hand's shake.
struct Swing<'a> {
    head: &'a HeadModel,
    response: &'a FrequencyResponse,
    foot: Vector,
    omega: f64,
    shake: &'a Shake,
}

impl Swing<'_> {
    /// Complex displacement and turn of the centre of mass.
    fn amplitude(&self) -> [Complex<f64>; 6] {
        let of_base = self.shake.pitch_deg.to_radians();
        let per_base = self.response.displacement(Axis::Pitch, self.omega / TAU);
        std::array::from_fn(|k| per_base[k] * of_base)
    }

    /// Base and head when the base's pitch is at `phase` of its cosine. Velocities are left out: what they add to
    /// forces is of second order.
    fn state(&self, phase: f64) -> HeadState {
        let turning = Complex::from_polar(1.0, phase);
        let now = crate::elasticity::Vector6::from(self.amplitude().map(|a| (a * turning).re));
        let (shift, turn) = split(&now);
        let rest = self.head.rest_pose_base_from_head();
        let centre_in_head = self.head.body().centre_of_mass_in_head;
        let rotation = Rotation::from_scaled_axis(turn) * rest.rotation;
        let centre = rest * nalgebra::Point3::from(centre_in_head) + shift;
        let arm = rotation * centre_in_head;
        let angular_acceleration = turn * -(self.omega * self.omega);
        let mut head = Kinematics::at_rest(Pose::from_parts((centre.coords - arm).into(), rotation));
        head.angular_acceleration_in_world = angular_acceleration;
        head.acceleration_in_world = shift * -(self.omega * self.omega) - angular_acceleration.cross(&arm);
        let pitch = self.shake.pitch_deg.to_radians() * phase.cos();
        let base_rotation = Rotation::from_scaled_axis(Vector::y() * pitch);
        let origin = self.foot - base_rotation * self.foot;
        let base = Kinematics::at_rest(Pose::from_parts(origin.into(), base_rotation));
        HeadState { t_s: 0.0, head, base }
    }
}
