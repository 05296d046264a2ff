//! A head that a motor turns about an axis as it is told, whatever the base does: spinning and nodding mounts.

use super::spec::PlacementSpec;
use crate::geometry::{Kinematics, Pose, Rotation, Vector};
use crate::spec::checked::{FiniteArray, NonNegative, Positive};
use crate::spec::{Source, SpecError};
use nalgebra::Unit;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// A motor between base and head.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct MotorSpec {
    /// Direction of the axis that it turns the head about, in the head; of any length but 0.
    #[serde(with = "FiniteArray::<3>")]
    pub axis_in_head: [f64; 3],
    /// A point on that axis, in the head, m.
    #[serde(with = "FiniteArray::<3>")]
    pub pivot_in_head_m: [f64; 3],
    /// How it turns.
    pub turn: TurnSpec,
    /// How long it stands still first, s.
    #[serde(with = "NonNegative")]
    pub still_s: f64,
    /// How long it then takes to come to its full turn, s.
    #[serde(with = "Positive")]
    pub start_s: f64,
}

/// How a motor turns a head.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, schemars::JsonSchema, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum TurnSpec {
    /// Round and round, at a steady rate.
    Spin {
        /// Turns a second, Hz.
        #[serde(with = "Positive")]
        rate_hz: f64,
    },
    /// To and fro, as a sine.
    Nod {
        /// Greatest angle to either side, degrees.
        #[serde(with = "Positive")]
        amplitude_deg: f64,
        /// How often, Hz.
        #[serde(with = "Positive")]
        frequency_hz: f64,
    },
}

/// Greatest rate of a motor, turns a second: a tenth of a radian in a millisecond, beyond which beams between two
/// instants of the simulation would be off their course.
const MOST_TURNS_PER_S: f64 = 15.0;

impl TurnSpec {
    /// The greatest rate, turns a second.
    fn most_turns_per_s(&self) -> f64 {
        match self {
            Self::Spin { rate_hz } => *rate_hz,
            Self::Nod { amplitude_deg, frequency_hz } => amplitude_deg.to_radians() * frequency_hz,
        }
    }
}

/// A head on a motor's axis.
#[derive(Debug, Clone)]
pub(super) struct Actuated {
    /// `base_from_head` before the motor starts.
    pub start: Pose,
    base_from_pivot: Pose,
    pivot_from_head: Pose,
    /// In the pivot's frame, whose axes are the head's before the start.
    axis: Unit<Vector>,
    motor: MotorSpec,
}

impl Actuated {
    /// The head that stands at `base_from_head` until `motor` starts.
    ///
    /// # Errors
    /// When the axis has no direction, or the motor turns too fast.
    pub fn new(base_from_head: &PlacementSpec, motor: &MotorSpec, source: &Source) -> Result<Self, SpecError> {
        let Some(axis) = Unit::try_new(Vector::from(motor.axis_in_head), 1e-9) else {
            let message = "an axis of no length points nowhere: give a direction, as (1.0, 0.0, 0.0) for x";
            return Err(SpecError::about(source, "axis_in_head", message));
        };
        if let TurnSpec::Nod { amplitude_deg, .. } = motor.turn
            && amplitude_deg > 180.0
        {
            let message =
                format!("a head that nods by {amplitude_deg} degrees to either side overlaps itself: 180 is most");
            return Err(SpecError::about(source, "amplitude_deg", message));
        }
        let turns_per_s = motor.turn.most_turns_per_s();
        if turns_per_s > MOST_TURNS_PER_S {
            let message = format!(
                "the motor turns the head by up to {turns_per_s:.1} turns a second; {MOST_TURNS_PER_S} are most: turn it \
                 slower"
            );
            return Err(SpecError::about(source, "turn", message));
        }
        let (start, pivot) = (base_from_head.pose(), Vector::from(motor.pivot_in_head_m));
        let base_from_pivot = start * Pose::from_parts(pivot.into(), Rotation::identity());
        let pivot_from_head = Pose::from_parts((-pivot).into(), Rotation::identity());
        Ok(Self { start, base_from_pivot, pivot_from_head, axis, motor: *motor })
    }

    /// The head's motion on a base that moves so, `t_s` seconds after the start.
    ///
    /// About its axis n, fixed in the base, the head turns by phi on top of the base's turn: with the base's angular
    /// velocity W and acceleration A, `w = W + phi' n` and `a = A + phi'' n + W x phi' n`.
    pub fn carried(&self, base: &Kinematics, t_s: f64) -> Kinematics {
        let [angle, rate, gain] = self.motor.angle_rad(t_s);
        let pivot = base.of_frame(&self.base_from_pivot);
        let axis = pivot.world_from_body.rotation * self.axis.into_inner();
        let turn = Rotation::from_axis_angle(&self.axis, angle);
        let turned = Kinematics {
            world_from_body: pivot.world_from_body * turn,
            angular_velocity_in_world: pivot.angular_velocity_in_world + axis * rate,
            angular_acceleration_in_world: pivot.angular_acceleration_in_world
                + axis * gain
                + pivot.angular_velocity_in_world.cross(&axis) * rate,
            ..pivot
        };
        turned.of_frame(&self.pivot_from_head)
    }
}

impl MotorSpec {
    /// The angle turned since the start, rad, with its first and second derivative by time: twice continuously
    /// differentiable.
    ///
    /// The rate of a spin, and the amplitude of a nod, rises as the quintic `s = 10 u^3 - 15 u^4 + 6 u^5`, whose first
    /// two derivatives vanish at both ends.
    fn angle_rad(&self, t_s: f64) -> [f64; 3] {
        let after_s = t_s - self.still_s;
        if after_s <= 0.0 {
            return [0.0; 3];
        }
        let u = (after_s / self.start_s).min(1.0);
        let share = u * u * u * (10.0 + u * (6.0 * u - 15.0));
        let (faster, faster_still) = (
            30.0 * (u * (1.0 - u)).powi(2) / self.start_s,
            60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / self.start_s.powi(2),
        );
        match self.turn {
            TurnSpec::Spin { rate_hz } => {
                // The integral of the share: start_s u^4 (5/2 - 3 u + u^2) while it rises, which ends at start_s / 2.
                let risen_s = self.start_s * u.powi(4) * (2.5 + u * (u - 3.0));
                let full_s = risen_s + (after_s - self.start_s).max(0.0);
                [full_s, share, faster].map(|x| TAU * rate_hz * x)
            }
            TurnSpec::Nod { amplitude_deg, frequency_hz } => {
                let omega = TAU * frequency_hz;
                let (sin, cos) = (omega * after_s).sin_cos();
                let nod = [
                    share * sin,
                    faster * sin + share * omega * cos,
                    faster_still * sin + 2.0 * faster * omega * cos - share * omega * omega * sin,
                ];
                nod.map(|x| amplitude_deg.to_radians() * x)
            }
        }
    }
}
