//! The force law of a linkage: elements, modal damping, hand hold and end stop; without gravity.

use super::body::Body;
use super::cord::Cord;
use super::float::Float;
use super::forces::{EndFrames, Forces, MotionState, RelativePose};
use super::joint::UniversalJoint;
use super::mounted_spring::MountedSpring;
use std::f64::consts::PI;
use zsim_base::geometry::{Kinematics, Pose, Vector};
use zsim_elasticity::{ElasticityError, Matrix6, SpringState, Vector6, split, stack};

/// The force law of a linkage: the sum of the elements, modal damping, hand hold and end stop.
///
/// Modal damping and hand hold act in the [`Deformation`](zsim_elasticity::Deformation) coordinates e between the two
/// `reference` frames: the force `C e_dot` acts on the head through the transposed Jacobian of e. A rigid motion of
/// head and base together leaves e unchanged and is therefore undamped; the dissipated power `e_dot . C e_dot` is never
/// negative.
#[derive(Debug, Clone)]
pub(super) struct ForceLaw {
    pub springs: Vec<MountedSpring>,
    pub cords: Vec<Cord>,
    pub floats: Vec<Float>,
    /// Leaves the head two rotations only.
    pub joint: Option<UniversalJoint>,
    /// The end frames of a single spring; for several elements, two frames in the head's centre of mass that coincide
    /// in equilibrium.
    pub reference: EndFrames,
    /// Modal damping, in the reference coordinates.
    pub damping: Matrix6,
    pub hold: Option<Hold>,
    pub end_stop: Option<EndStop>,
}

/// A hand that holds the head at `rest`; all values in the reference coordinates.
#[derive(Debug, Clone)]
pub(super) struct Hold {
    /// Natural frequency of the head with the hand as the only support, Hz.
    pub frequency_hz: f64,
    pub stiffness: Matrix6,
    pub damping: Matrix6,
    pub rest: Vector6,
}

/// An elastic, damped stop for the angle between the z axes of the two reference frames.
#[derive(Debug, Clone, Copy)]
pub(super) struct EndStop {
    pub angle_rad: f64,
    pub stiffness_nm_per_rad: f64,
    pub damping_nm_s_per_rad: f64,
}

/// The last solution for the inner nodes of the springs, the start of the next.
#[derive(Debug, Clone)]
pub(super) struct ForceLawState(Vec<SpringState>);

impl ForceLaw {
    /// A state without a solution for the inner nodes.
    pub fn state(&self) -> ForceLawState {
        ForceLawState(self.springs.iter().map(|mounted| mounted.spring.state()).collect())
    }

    /// The forces on the head.
    ///
    /// For a joint they include the torsion springs, not the constraint wrench.
    ///
    /// # Errors
    /// When a segmented spring has no equilibrium.
    pub fn forces(&self, state: &mut ForceLawState, now: &MotionState<'_>) -> Result<Forces, ElasticityError> {
        let mut forces = Forces::none();
        for (mounted, state) in self.springs.iter().zip(&mut state.0) {
            mounted.add_forces(state, now, &mut forces)?;
        }
        self.cords.iter().for_each(|cord| cord.add_forces(now, &mut forces));
        self.floats.iter().for_each(|float| float.add_forces(now, &mut forces));
        if let Some(joint) = &self.joint {
            joint.add_forces(now, &mut forces);
        }
        let between = self.reference.at(now);
        self.add_damping_and_hold(&between, now, &mut forces);
        if let Some(stop) = &self.end_stop {
            let from = between.axes.column(2).into_owned();
            let to = now.world_from_head.rotation * self.reference.head_from_top.rotation * Vector::z();
            let (_, turning) = split(now.twist);
            stop.add_torque(&from, &to, &(turning - now.base.angular_velocity_in_world), &mut forces);
        }
        forces.turn_rad = forces.turn_rad.max(between.turn_rad());
        Ok(forces)
    }

    /// The wrench of the coils that touch.
    ///
    /// # Errors
    /// When a segmented spring has no equilibrium.
    pub fn contact(&self, state: &mut ForceLawState, now: &MotionState<'_>) -> Result<Vector6, ElasticityError> {
        let springs = self.springs.iter().zip(&mut state.0);
        springs.map(|(mounted, state)| mounted.contact(state, now)).sum()
    }

    /// Adds modal damping and hand hold.
    fn add_damping_and_hold(&self, between: &RelativePose, now: &MotionState<'_>, forces: &mut Forces) {
        let rate = between.rate_by_twist();
        let moving = rate * now.relative_twist();
        let (push, damping) = match &self.hold {
            Some(hand) if now.hold > 0.0 => {
                let damping = self.damping + hand.damping * now.hold;
                let away = between.deformation.coordinates - hand.rest;
                (damping * moving + hand.stiffness * away * now.hold, damping)
            }
            _ => (self.damping * moving, self.damping),
        };
        forces.wrench -= rate.tr_mul(&push);
        forces.damping += rate.tr_mul(&(damping * rate));
    }

    /// Inertial forces of wire and fluid that are quadratic in the head's twist.
    pub fn quadratic_forces(&self, now: &MotionState<'_>, twist: &Vector6) -> Vector6 {
        let of_springs = self.springs.iter().map(|mounted| mounted.quadratic_forces(now, twist)).sum::<Vector6>();
        of_springs + self.floats.iter().map(|float| float.quadratic_forces(now, twist)).sum::<Vector6>()
    }

    /// Potential energy of the linkage, end stop included, J.
    ///
    /// # Errors
    /// When a segmented spring has no equilibrium.
    pub fn potential_j(
        &self,
        world_from_base: &Pose,
        base_from_head: &Pose,
        gravity_in_world: &Vector,
    ) -> Result<f64, ElasticityError> {
        let mut energy_j = 0.0;
        for mounted in &self.springs {
            energy_j += mounted.potential_j(world_from_base, base_from_head, gravity_in_world)?;
        }
        energy_j += self.cords.iter().map(|cord| cord.potential_j(base_from_head)).sum::<f64>();
        let of_float = |float: &Float| float.potential_j(world_from_base, base_from_head, gravity_in_world);
        energy_j += self.floats.iter().map(of_float).sum::<f64>();
        energy_j += self.joint.map_or(0.0, |joint| joint.potential_j(base_from_head));
        let tilt = Vector::z().angle(&(self.reference.foot_from_top(base_from_head).rotation * Vector::z()));
        let in_stop = self.end_stop.map_or(0.0, |stop| {
            let beyond = (tilt - stop.angle_rad).max(0.0);
            0.5 * stop.stiffness_nm_per_rad * beyond * beyond
        });
        Ok(energy_j + in_stop)
    }

    /// The reference coordinates and their Jacobian at a pose.
    ///
    /// The Jacobian is the derivative by the head's twist about the centre of mass, in the axes of the base.
    pub fn rate_matrix(&self, base_from_head: &Pose, body: &Body) -> (Vector6, Matrix6) {
        let between = at_rest(base_from_head, body, |now| self.reference.at(now));
        (between.deformation.coordinates, between.rate_by_twist())
    }

    /// The sum of the contact stiffnesses of all springs by the head's twist, all coils touching; `None` without contact.
    pub fn contact_stiffness(&self, base_from_head: &Pose, body: &Body) -> Option<Matrix6> {
        let of = |mounted: &MountedSpring| at_rest(base_from_head, body, |now| mounted.contact_stiffness(now));
        self.springs.iter().filter_map(of).reduce(|sum, stiffness| sum + stiffness)
    }

    /// Relaxation time of the contact, s: the damping over the stiffness of the contact; zero without contact.
    ///
    /// That of the spring with the longest one, for a clash along its axis with the inertia `mass` of the head.
    pub fn contact_relaxation_s(&self, base_from_head: &Pose, body: &Body, mass: &Matrix6) -> f64 {
        let of = |mounted: &MountedSpring| {
            let mobility = at_rest(base_from_head, body, |now| mounted.axial_mobility_per_kg(now, mass))?;
            let closed = mounted.spring.contact_stiffness()?.m33;
            let omega = ((closed + mounted.spring.axial_n_per_m()) * mobility).sqrt();
            Some(2.0 * damping_ratio(mounted.coil?.restitution()) * omega / (closed * mobility))
        };
        self.springs.iter().filter_map(of).fold(0.0, f64::max)
    }
}

/// The damping ratio of a mass on a Kelvin-Voigt element for a coefficient of restitution.
///
/// A mass leaves the element with `e = exp(-pi zeta / sqrt(1 - zeta^2))` times the speed of its arrival.
fn damping_ratio(restitution: f64) -> f64 {
    let decrement = -restitution.max(1e-6).ln();
    decrement / decrement.hypot(PI)
}

/// What `of` gives for a head and a base at rest.
fn at_rest<T>(base_from_head: &Pose, body: &Body, of: impl FnOnce(&MotionState<'_>) -> T) -> T {
    of(&MotionState {
        base: &Kinematics::at_rest(Pose::identity()),
        world_from_head: base_from_head,
        twist: &Vector6::zeros(),
        body,
        hold: 0.0,
        gravity_in_world: Vector::zeros(),
    })
}

impl EndStop {
    /// Adds the torque and damping of the stop if the angle from axis `from` to axis `to` exceeds the limit.
    ///
    /// `turning` is the relative angular velocity.
    fn add_torque(&self, from: &Vector, to: &Vector, turning: &Vector, forces: &mut Forces) {
        let across = from.cross(to);
        let sine = across.norm();
        let beyond = sine.atan2(from.dot(to)) - self.angle_rad;
        if beyond <= 0.0 || sine == 0.0 {
            return;
        }
        let axis = across / sine;
        let torque = -(self.stiffness_nm_per_rad * beyond + self.damping_nm_s_per_rad * axis.dot(turning));
        forces.wrench += stack(&Vector::zeros(), &(axis * torque));
        let mut block = forces.damping.fixed_view_mut::<3, 3>(3, 3);
        block += axis * axis.transpose() * self.damping_nm_s_per_rad;
    }
}
