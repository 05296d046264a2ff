//! A compliant linkage in equilibrium, linearised there.

use super::body::Body;
use super::force_law::{EndStop, ForceLaw, Hold};
use super::modes::{FreeMotions, LinearModel, Mode, modal_damping, modal_sum, modes};
use super::spec::{DampingSpec, EndStopSpec, HoldSpec};
use super::statics::Statics;
use std::f64::consts::TAU;
use zsim_base::geometry::{Matrix, Pose, Vector, gravity_in_world, skew};
use zsim_base::spec::{Source, SpecError};
use zsim_elasticity::{Matrix6, Vector6, blocks, split};

/// A compliant linkage with its equilibrium and linear model.
#[derive(Debug, Clone)]
pub(super) struct CompliantLinkage {
    pub law: ForceLaw,
    /// Equilibrium pose `base_from_head`, with the base upright and at rest.
    pub rest: Pose,
    pub linear: LinearModel,
}

/// The static load of an element of a linkage.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct ElementLoad {
    /// Kind of the element.
    pub kind: ElementKind,
    /// Compressive load of a spring (negative: tension), tension of a cord, or buoyancy of a float, N; none for a
    /// joint, which carries the remaining load.
    pub load_n: Option<f64>,
}

/// The kind of an element of a linkage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ElementKind {
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
    /// Creates a hand hold: stiffness `(2 pi f)^2 M` and damping `4 pi f zeta M`.
    ///
    /// Mass matrix and rest are in the reference coordinates.
    fn new(hand: &HoldSpec, mass: &Matrix6, rest: Vector6) -> Self {
        let (frequency_hz, omega) = (hand.frequency_hz, TAU * hand.frequency_hz);
        let damping = mass * (2.0 * hand.damping_ratio * omega);
        Self { frequency_hz, stiffness: mass * (omega * omega), damping, rest }
    }
}

impl CompliantLinkage {
    /// Linearises the head about the equilibrium pose `rest` and adds modal damping and hand hold.
    ///
    /// `None` if a matrix is singular.
    pub fn linearised(
        mut law: ForceLaw,
        rest: Pose,
        stiffness: Matrix6,
        body: &Body,
        damping: &DampingSpec,
        hand: Option<&HoldSpec>,
    ) -> Option<Self> {
        let (coordinates, rate) = law.rate_matrix(&rest, body);
        let statics = statics(&law, body);
        let coefficients = statics.linear_coefficients(&rest).ok()?;
        let mass = body.mass_matrix(rest.rotation.to_rotation_matrix().matrix()) + coefficients.inertia;
        let turns = law.joint.map(|joint| joint.free_motions(&Pose::identity(), &rest, body));
        let free =
            turns.map_or_else(|| FreeMotions::all(&stiffness), |turns| FreeMotions::of_joint(&turns, &stiffness));
        let mut modes = modes(&mass, &free, &rate, damping)?;
        // Rigid motion: a base displacement (d, phi) moves the head by (d + phi x centre, phi).
        let centre = rest.translation.vector + rest.rotation * body.centre_of_mass_in_head;
        let rigid_motion = blocks(&Matrix::identity(), &-skew(&centre), &Matrix::zeros(), &Matrix::identity());
        let (stiffness, base_stiffness) = match &turns {
            None => (stiffness, statics.stiffness_to_base(&rest).ok()?),
            Some(turns) => {
                let along = modal_sum(&mass, modes.iter().map(|m| (m.shape, (TAU * m.frequency_hz).powi(2))));
                let by_base = statics.unbalanced_wrench_by_base(&rest).ok()?;
                (along, along * rigid_motion + expand_joint_derivatives(&mass, turns, &by_base)?)
            }
        };
        let inverse_rate = rate.try_inverse()?;
        let modal = modal_damping(&mass, &modes);
        let damping = modal + coefficients.damping;
        add_element_damping(&mut modes, &coefficients.damping);
        let base_damping = damping * rigid_motion;
        let base_mass = coefficients.base_mass;
        law.damping = inverse_rate.tr_mul(&(modal * inverse_rate));
        law.hold = hand.map(|hand| Hold::new(hand, &inverse_rate.tr_mul(&(mass * inverse_rate)), coordinates));
        let linear =
            LinearModel { mass, damping, stiffness, base_mass, base_damping, base_stiffness, rigid_motion, modes };
        Some(Self { law, rest, linear })
    }

    /// Adds an end stop.
    ///
    /// # Errors
    /// When the head touches the stop in equilibrium, or the angle is 170 degrees or more.
    pub fn add_end_stop(&mut self, stop: &EndStopSpec, body: &Body, source: &Source) -> Result<(), SpecError> {
        let (coordinates, _) = self.law.rate_matrix(&self.rest, body);
        let (_, turn) = split(&coordinates);
        let tilt_deg = turn.norm().to_degrees();
        if stop.angle_deg <= tilt_deg || stop.angle_deg >= 170.0 {
            let message = format!(
                "the end stop at {} degrees must be above the head's tilt in equilibrium, {tilt_deg:.1} degrees, and below 170",
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

    /// Upper bound of the natural frequencies with hand hold, end stop and all cords taut, Hz.
    pub fn fastest_hz(&self, body: &Body) -> f64 {
        let of_modes = self.linear.modes.iter().map(|mode| mode.frequency_hz).fold(0.0, f64::max);
        let lightest = body.inertia_in_head.symmetric_eigenvalues().min();
        let at_stop = self.law.end_stop.map_or(0.0, |stop| (stop.stiffness_nm_per_rad / lightest).sqrt() / TAU);
        // A cord that is slack in equilibrium is in no mode. When taut with lever r it acts on an effective mass of at
        // least 1 / (1/m + r^2/I).
        let slack = self.law.cords.iter().filter(|cord| cord.tension_n(&self.rest) == 0.0);
        let by_cords = slack.map(|cord| {
            let lever = (cord.point_in_head - body.centre_of_mass_in_head).norm();
            cord.stiffness_n_per_m * (1.0 / body.mass_kg + lever * lever / lightest)
        });
        let when_taut = by_cords.sum::<f64>().sqrt() / TAU;
        let in_hand = self.law.hold.as_ref().map_or(0.0, |hand| hand.frequency_hz);
        of_modes.hypot(in_hand).hypot(at_stop).hypot(when_taut)
    }

    /// The foot of a single spring, or the joint; the base's origin for other linkages.
    pub fn foot_in_base(&self) -> Vector {
        match (&self.law.springs[..], &self.law.joint) {
            (_, Some(joint)) => joint.ends.base_from_foot.translation.vector,
            ([only], None) => only.ends.base_from_foot.translation.vector,
            _ => Vector::zeros(),
        }
    }

    /// The static load of each element.
    pub fn element_loads(&self) -> Vec<ElementLoad> {
        let (law, rest) = (&self.law, &self.rest);
        let springs = law.springs.iter().map(|spring| (ElementKind::Spring, spring.load_n(rest).ok()));
        let cords = law.cords.iter().map(|cord| (ElementKind::Cord, Some(cord.tension_n(rest))));
        let floats =
            law.floats.iter().map(|float| (ElementKind::Float, Some(float.buoyancy_n(rest, &gravity_in_world()))));
        let joint = law.joint.iter().map(|_| (ElementKind::UniversalJoint, None));
        springs.chain(cords).chain(floats).chain(joint).map(|(kind, load_n)| ElementLoad { kind, load_n }).collect()
    }
}

/// Statics of the head under gravity on an upright base.
fn statics<'a>(law: &'a ForceLaw, body: &'a Body) -> Statics<'a> {
    Statics { law, body, gravity_in_base: gravity_in_world(), weight: 1.0, scale_m: 1.0 }
}

/// Adds the diagonal part of the elements' damping to the damping ratios of the modes.
fn add_element_damping(modes: &mut [Mode], damping: &Matrix6) {
    for mode in modes {
        let modal_damping = mode.shape.dot(&(damping * mode.shape));
        mode.damping_ratio += modal_damping / (2.0 * TAU * mode.frequency_hz);
    }
}

/// Expands derivatives by the two joint rotations to all six coordinates: `M Z (Z^T M Z)^-1` times them.
///
/// `by_base` has them at the rows of rotations about x and y; the columns of Z are the joint rotations.
fn expand_joint_derivatives(mass: &Matrix6, turns: &[Vector6; 2], by_base: &Matrix6) -> Option<Matrix6> {
    let directions = nalgebra::Matrix6x2::from_columns(turns);
    let moved = mass * directions;
    let reduced = directions.tr_mul(&moved).try_inverse()?;
    Some(moved * reduced * by_base.fixed_rows::<2>(3))
}
