//! A head at rest in its linkage, linearised there.

use super::body::Body;
use super::law::{EndStop, Hold, Law};
use super::modes::{Freedom, LinearModel, Mode, modal_damping, modal_sum, modes};
use super::spec::{DampingSpec, EndStopSpec, HoldSpec};
use super::statics::Statics;
use crate::elasticity::{Matrix6, Vector6, blocks, split};
use crate::geometry::{Matrix, Pose, Vector, gravity_in_world, skew};
use crate::spec::{Source, SpecError};
use std::f64::consts::TAU;

/// A head in a linkage that gives.
#[derive(Debug, Clone)]
pub(super) struct Sprung {
    pub law: Law,
    /// `base_from_head` at rest, the base upright and still.
    pub rest: Pose,
    pub linear: LinearModel,
}

/// What an element of a linkage bears at rest.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Bearing {
    /// What it is.
    pub kind: BearingKind,
    /// The load that presses a spring together (negative: pulls it apart), a cord's tension, or a float's buoyancy, N;
    /// none of a joint, which bears whatever is left.
    pub load_n: Option<f64>,
}

/// What an element of a linkage is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BearingKind {
    /// A spring.
    Spring,
    /// A rope, an elastic cable, or the cable through a spring.
    Cord,
    /// A float.
    Float,
    /// A universal joint.
    UniversalJoint,
}

impl Hold {
    /// A hand on a head of this mass, resting so, both in the seat's coordinates: `(2 pi f)^2 M` and `4 pi f zeta M`.
    fn new(hand: &HoldSpec, mass: &Matrix6, rest: Vector6) -> Self {
        let (frequency_hz, omega) = (hand.frequency_hz, TAU * hand.frequency_hz);
        let damping = mass * (2.0 * hand.damping_ratio * omega);
        Self { frequency_hz, stiffness: mass * (omega * omega), damping, rest }
    }
}

impl Sprung {
    /// The head at rest with its modes damped, and a hand near it; `None` where its mass has no inverse.
    pub fn linearised(
        (mut law, rest, stiffness): (Law, Pose, Matrix6),
        body: &Body,
        damping: &DampingSpec,
        hand: Option<&HoldSpec>,
    ) -> Option<Self> {
        let (coordinates, rate) = law.rate_matrix(&rest, body);
        let statics = statics(&law, body);
        let answer = statics.answer(&rest).ok()?;
        let mass = body.mass_matrix(rest.rotation.to_rotation_matrix().matrix()) + answer.inertia;
        let turns = law.joint.map(|joint| joint.directions(&Pose::identity(), &rest, body));
        let free = turns.map_or_else(|| Freedom::of_all(&stiffness), |turns| Freedom::of_turns(&turns, &stiffness));
        let mut modes = modes(&mass, &free, &rate, damping)?;
        // A base that moves by (d, phi) carries a head that is stuck to it by (d + phi x centre, phi).
        let centre = rest.translation.vector + rest.rotation * body.centre_of_mass_in_head;
        let carried = blocks(&Matrix::identity(), &-skew(&centre), &Matrix::zeros(), &Matrix::identity());
        let (stiffness, base_stiffness) = match &turns {
            None => (stiffness, statics.stiffness_to_base(&rest).ok()?),
            Some(turns) => {
                let along = modal_sum(&mass, modes.iter().map(|m| (m.shape, (TAU * m.frequency_hz).powi(2))));
                let by_base = statics.effort_by_base(&rest).ok()?;
                (along, along * carried + of_turns(&mass, turns, &by_base)?)
            }
        };
        let unrate = rate.try_inverse()?;
        let modal = modal_damping(&mass, &modes);
        let damping = modal + answer.damping;
        damp(&mut modes, &answer.damping);
        let base_damping = damping * carried;
        let base_mass = answer.base_mass;
        law.damping = unrate.tr_mul(&(modal * unrate));
        law.hold = hand.map(|hand| Hold::new(hand, &unrate.tr_mul(&(mass * unrate)), coordinates));
        let linear = LinearModel { mass, damping, stiffness, base_mass, base_damping, base_stiffness, carried, modes };
        Some(Self { law, rest, linear })
    }

    /// Puts an end stop up.
    ///
    /// # Errors
    /// When the head leans on it at rest already.
    pub fn stop(&mut self, stop: &EndStopSpec, body: &Body, source: &Source) -> Result<(), SpecError> {
        let (coordinates, _) = self.law.rate_matrix(&self.rest, body);
        let (_, turn) = split(&coordinates);
        let lean_deg = turn.norm().to_degrees();
        if stop.angle_deg <= lean_deg || stop.angle_deg >= 170.0 {
            let message = format!(
                "the stop at {} degrees must be beyond the head's lean at rest, {lean_deg:.1} degrees, and below 170",
                stop.angle_deg
            );
            return Err(SpecError::about(source, "angle_deg", message));
        }
        self.law.end_stop = Some(EndStop {
            angle_rad: stop.angle_deg.to_radians(),
            stiffness_nm_per_rad: stop.stiffness_nm_per_rad,
            damping_nm_s_per_rad: stop.damping_nm_s_per_rad,
        });
        Ok(())
    }

    /// An upper bound on how fast the head oscillates with a hand, its stop and all its cords taut, Hz.
    pub fn fastest_hz(&self, body: &Body) -> f64 {
        let of_modes = self.linear.modes.iter().map(|mode| mode.frequency_hz).fold(0.0, f64::max);
        let lightest = body.inertia_in_head.symmetric_eigenvalues().min();
        let at_stop = self.law.end_stop.map_or(0.0, |stop| (stop.stiffness_nm_per_rad / lightest).sqrt() / TAU);
        // A cord that is slack at rest is in no mode. Pulled taut at a lever r it moves a mass of 1 / (1/m + r^2/I) at
        // least.
        let slack = self.law.cords.iter().filter(|cord| cord.tension_n(&self.rest) == 0.0);
        let by_cords = slack.map(|cord| {
            let lever = (cord.point_in_head - body.centre_of_mass_in_head).norm();
            cord.stiffness_n_per_m * (1.0 / body.mass_kg + lever * lever / lightest)
        });
        let when_taut = by_cords.sum::<f64>().sqrt() / TAU;
        let in_hand = self.law.hold.as_ref().map_or(0.0, |hand| hand.frequency_hz);
        of_modes.hypot(in_hand).hypot(at_stop).hypot(when_taut)
    }

    /// The foot of the one spring; where there is not one alone, or a joint, the base's origin, or the joint.
    pub fn foot_in_base(&self) -> Vector {
        match (&self.law.springs[..], &self.law.joint) {
            (_, Some(joint)) => joint.ends.base_from_foot.translation.vector,
            ([only], None) => only.ends.base_from_foot.translation.vector,
            _ => Vector::zeros(),
        }
    }

    /// What each element bears at rest.
    pub fn bearings(&self) -> Vec<Bearing> {
        let (law, rest) = (&self.law, &self.rest);
        let springs = law.springs.iter().map(|spring| (BearingKind::Spring, spring.load_n(rest).ok()));
        let cords = law.cords.iter().map(|cord| (BearingKind::Cord, Some(cord.tension_n(rest))));
        let floats =
            law.floats.iter().map(|float| (BearingKind::Float, Some(float.buoyancy_n(rest, &gravity_in_world()))));
        let joint = law.joint.iter().map(|_| (BearingKind::UniversalJoint, None));
        springs.chain(cords).chain(floats).chain(joint).map(|(kind, load_n)| Bearing { kind, load_n }).collect()
    }
}

/// A head under its own weight on an upright base.
fn statics<'a>(law: &'a Law, body: &'a Body) -> Statics<'a> {
    Statics { law, body, gravity_in_base: gravity_in_world(), weight: 1.0, scale_m: 1.0 }
}

/// Adds to each mode's ratio what the elements' own damping takes of it.
fn damp(modes: &mut [Mode], damping: &Matrix6) {
    for mode in modes {
        let taken = mode.shape.dot(&(damping * mode.shape));
        mode.damping_ratio += taken / (2.0 * TAU * mode.frequency_hz);
    }
}

/// A matrix that does on the two turns what `by_base` says in the places of turns about x and y: `M Z (Z^T M Z)^-1` of
/// them.
fn of_turns(mass: &Matrix6, turns: &[Vector6; 2], by_base: &Matrix6) -> Option<Matrix6> {
    let directions = nalgebra::Matrix6x2::from_columns(turns);
    let moved = mass * directions;
    let reduced = directions.tr_mul(&moved).try_inverse()?;
    Some(moved * reduced * by_base.fixed_rows::<2>(3))
}
