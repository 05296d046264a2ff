//! A head that a motor rotates about an axis: spinning and nodding mounts.

use super::placement::PlacementSpec;
use nalgebra::Unit;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use zsim_base::geometry::{Kinematics, Pose, Rotation, Vector};
use zsim_base::spec::checked::{FiniteArray, NonNegative, Positive};
use zsim_base::spec::{Source, SpecError};

/// A motor between base and head.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct MotorSpec {
    /// Direction of the rotation axis in the head frame; any length but 0.
    #[serde(with = "FiniteArray::<3>")]
    pub axis_in_head: [f64; 3],
    /// A point on the rotation axis, in the head frame, m.
    #[serde(default, with = "FiniteArray::<3>")]
    pub pivot_in_head_m: [f64; 3],
    /// Motion of the motor: continuous rotation or a sine.
    pub turn: TurnSpec,
    /// Time at rest before the motor starts, s.
    #[serde(default = "crate::usual::still_s", with = "NonNegative")]
    pub still_s: f64,
    /// Time over which the motion then builds up to the full rate or amplitude, s.
    #[serde(with = "Positive")]
    pub start_s: f64,
}

/// Motion of a motor.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum TurnSpec {
    /// Continuous rotation at a constant rate.
    Spin {
        /// Rotation rate, Hz (revolutions per second).
        #[serde(with = "Positive")]
        rate_hz: f64,
    },
    /// Oscillation about the axis: angle = amplitude x sin(2 pi frequency t).
    Nod {
        /// Amplitude: maximum angle to either side, degrees.
        #[serde(with = "Positive")]
        amplitude_deg: f64,
        /// Frequency of the oscillation, Hz.
        #[serde(with = "Positive")]
        frequency_hz: f64,
    },
}

/// Maximum rotation rate of a motor, revolutions per second.
///
/// It is a tenth of a radian per millisecond. Above it, poses interpolated between two simulation steps would be too
/// inaccurate for the beams.
const MAX_RATE_HZ: f64 = 15.0;

impl TurnSpec {
    /// The maximum rotation rate, revolutions per second.
    fn max_rate_hz(&self) -> f64 {
        match self {
            Self::Spin { rate_hz } => *rate_hz,
            Self::Nod { amplitude_deg, frequency_hz } => amplitude_deg.to_radians() * frequency_hz,
        }
    }
}

/// A head on a motor.
#[derive(Debug, Clone)]
pub(super) struct Actuated {
    /// `base_from_head` before the motor starts.
    pub start: Pose,
    base_from_pivot: Pose,
    pivot_from_head: Pose,
    /// In the pivot frame, whose axes are parallel to those of the head before the start.
    axis: Unit<Vector>,
    motor: MotorSpec,
}

impl Actuated {
    /// Creates the mount of a head that is at `base_from_head` until `motor` starts.
    ///
    /// # Errors
    /// When the axis has length zero, or the motor exceeds the limits of angle or rate.
    pub fn new(base_from_head: &PlacementSpec, motor: &MotorSpec, source: &Source) -> Result<Self, SpecError> {
        let Some(axis) = Unit::try_new(Vector::from(motor.axis_in_head), 1e-9) else {
            let message = "the axis has length zero: give a direction, for example (1.0, 0.0, 0.0) for x";
            return Err(SpecError::about(source, "axis_in_head", message));
        };
        if let TurnSpec::Nod { amplitude_deg, .. } = motor.turn
            && amplitude_deg > 180.0
        {
            let message =
                format!("an amplitude of {amplitude_deg} degrees to either side is too large: the maximum is 180");
            return Err(SpecError::about(source, "amplitude_deg", message));
        }
        let rate_hz = motor.turn.max_rate_hz();
        if rate_hz > MAX_RATE_HZ {
            let message = format!(
                "the motor reaches {rate_hz:.1} revolutions per second; the maximum is {MAX_RATE_HZ}: reduce the rate or the \
                 amplitude"
            );
            return Err(SpecError::about(source, "turn", message));
        }
        let (start, pivot) = (base_from_head.pose(), Vector::from(motor.pivot_in_head_m));
        let base_from_pivot = start * Pose::from_parts(pivot.into(), Rotation::identity());
        let pivot_from_head = Pose::from_parts((-pivot).into(), Rotation::identity());
        Ok(Self { start, base_from_pivot, pivot_from_head, axis, motor: *motor })
    }

    /// The motion of the head for a given motion of the base, `t_s` seconds after the start.
    ///
    /// The head rotates by phi about the axis n, which is fixed in the base. With the angular velocity W and angular
    /// acceleration A of the base, `w = W + phi' n` and `a = A + phi'' n + W x phi' n`.
    pub fn head_kinematics(&self, base: &Kinematics, t_s: f64) -> Kinematics {
        let [angle, rate, acceleration] = self.motor.angle_rad(t_s);
        let pivot = base.of_frame(&self.base_from_pivot);
        let axis = pivot.world_from_body.rotation * self.axis.into_inner();
        let turn = Rotation::from_axis_angle(&self.axis, angle);
        let turned = Kinematics {
            world_from_body: pivot.world_from_body * turn,
            angular_velocity_in_world: pivot.angular_velocity_in_world + axis * rate,
            angular_acceleration_in_world: pivot.angular_acceleration_in_world
                + axis * acceleration
                + pivot.angular_velocity_in_world.cross(&axis) * rate,
            ..pivot
        };
        turned.of_frame(&self.pivot_from_head)
    }
}

impl MotorSpec {
    /// The motor angle since the start, rad, and its first and second time derivatives.
    ///
    /// The angle is twice continuously differentiable: the rate of a spin and the amplitude of a nod rise as the
    /// quintic `s = 10 u^3 - 15 u^4 + 6 u^5`, whose first two derivatives vanish at both ends.
    fn angle_rad(&self, t_s: f64) -> [f64; 3] {
        let after_s = t_s - self.still_s;
        if after_s <= 0.0 {
            return [0.0; 3];
        }
        let u = (after_s / self.start_s).min(1.0);
        let rise = u * u * u * (10.0 + u * (6.0 * u - 15.0));
        let (rise_rate, rise_acceleration) = (
            30.0 * (u * (1.0 - u)).powi(2) / self.start_s,
            60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / self.start_s.powi(2),
        );
        match self.turn {
            TurnSpec::Spin { rate_hz } => {
                // The integral of s over time: start_s u^4 (5/2 - 3 u + u^2) during the rise, which ends at start_s /
                // 2.
                let risen_s = self.start_s * u.powi(4) * (2.5 + u * (u - 3.0));
                let full_s = risen_s + (after_s - self.start_s).max(0.0);
                [full_s, rise, rise_rate].map(|x| TAU * rate_hz * x)
            }
            TurnSpec::Nod { amplitude_deg, frequency_hz } => {
                let omega = TAU * frequency_hz;
                let (sin, cos) = (omega * after_s).sin_cos();
                let nod = [
                    rise * sin,
                    rise_rate * sin + rise * omega * cos,
                    rise_acceleration * sin + 2.0 * rise_rate * omega * cos - rise * omega * omega * sin,
                ];
                nod.map(|x| amplitude_deg.to_radians() * x)
            }
        }
    }
}
