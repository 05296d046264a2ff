//! Simulation of the head's motion on a moving base.

use super::actuated::Actuated;
use super::body::Body;
use super::compliant::CompliantLinkage;
use super::contact_steps::ContactSteps;
use super::engine::Engine;
use super::error::DynamicsError;
use super::force_law::{ForceLaw, ForceLawState};
use super::forces::{Forces, MotionState};
use super::head::{HeadModel, Linkage};
use super::joint::UniversalJoint;
use super::statics::Statics;
use nalgebra::{Cholesky, U6};
use std::f64::consts::TAU;
use zsim_base::geometry::{Kinematics, Pose, Rotation, Vector, gravity_in_world};
use zsim_elasticity::{Matrix6, Vector6, split, stack};
use zsim_motion::BaseMotion;

/// The motion of head and base at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadState {
    /// Time since the start, s.
    pub t_s: f64,
    /// Motion of the head frame.
    pub head: Kinematics,
    /// Motion of the base frame.
    pub base: Kinematics,
}

/// The motion of a head on a moving base: an endless iterator of [`HeadState`]s at 0, dt, 2 dt, ...
///
/// At the start the head is in equilibrium relative to the base and has the velocity of the base. Rigid and actuated
/// heads move in closed form. On a compliant linkage the head is a free body in rapier under the wrench of the linkage
/// (leapfrog): velocities v apply half a step before the poses q, and at step n
///
/// `M (v[n+1/2] - v[n-1/2]) / dt = F(q[n]) - C (mean v - v_base) - mean w x I mean w`, `q[n+1] = q[n] + dt v[n+1/2]`,
///
/// where the mean is over the two half steps. For a joint, the right side includes the constraint wrench such that
/// `q[n+1]` satisfies the constraint. The scheme is time-reversible, so without damping the energy has no drift. The
/// output is for the head frame at the time of the pose: the velocity is interpolated from the mean velocities of the
/// steps to third order in dt, the acceleration to second order.
///
/// While coils touch, a step is divided into parts. Their contact force acts in each part; the impulses of all other
/// forces remain those of the whole step (impulse method, r-RESPA; Tuckerman, Berne and Martyna 1992). With shorter steps
/// for all forces, each clash would change the energy: the energy that leapfrog conserves depends on the step, and the
/// steps become shorter and longer again in different states. Within two steps of contact, the velocity is the mean of
/// those before and after the impulse at the pose.
///
/// The iterator ends after the first error.
pub struct HeadSimulation<'a> {
    model: &'a HeadModel,
    motion: &'a dyn BaseMotion,
    step_s: f64,
    count: u64,
    mechanism: Mechanism<'a>,
}

enum Mechanism<'a> {
    Rigid { base_from_head: Pose },
    Actuated(&'a Actuated),
    Compliant(Box<CompliantMotion<'a>>),
    Failed,
}

impl<'a> HeadSimulation<'a> {
    /// Creates a simulation of `model` on the base motion `motion` with the time step `step_s`.
    ///
    /// # Errors
    /// When the step exceeds the stability limit, or the head has no equilibrium at the initial attitude of the base.
    pub fn new(model: &'a HeadModel, motion: &'a dyn BaseMotion, step_s: f64) -> Result<Self, DynamicsError> {
        let fastest_hz = model.fastest_hz();
        let max_s = if fastest_hz > 0.0 { 1.0 / (TAU * fastest_hz) } else { f64::INFINITY };
        if !(step_s > 0.0 && step_s <= max_s && step_s.is_finite()) {
            return Err(DynamicsError::Step { step_s, max_s, fastest_hz });
        }
        let mechanism = match &model.linkage {
            Linkage::Rigid { base_from_head } => Mechanism::Rigid { base_from_head: *base_from_head },
            Linkage::Actuated(actuated) => Mechanism::Actuated(actuated),
            Linkage::Compliant(compliant) => {
                let start = motion.at(0.0);
                Mechanism::Compliant(Box::new(CompliantMotion::new(&model.body, compliant, &start, step_s)?))
            }
        };
        Ok(Self { model, motion, step_s, count: 0, mechanism })
    }

    /// The simulated model.
    pub fn model(&self) -> &HeadModel {
        self.model
    }
}

impl Iterator for HeadSimulation<'_> {
    type Item = Result<HeadState, DynamicsError>;

    fn next(&mut self) -> Option<Self::Item> {
        let t_s = self.count as f64 * self.step_s;
        self.count += 1;
        let base = self.motion.at(t_s);
        let head = match &mut self.mechanism {
            Mechanism::Failed => return None,
            Mechanism::Rigid { base_from_head } => Ok(base.of_frame(base_from_head)),
            Mechanism::Actuated(actuated) => Ok(actuated.head_kinematics(&base, t_s)),
            Mechanism::Compliant(compliant) => compliant.advance(self.count - 1, &base, self.motion),
        };
        if head.is_err() {
            self.mechanism = Mechanism::Failed;
        }
        Some(head.map(|head| HeadState { t_s, head, base }))
    }
}

/// State of a head on a compliant linkage.
struct CompliantMotion<'a> {
    body: &'a Body,
    compliant: &'a CompliantLinkage,
    engine: Engine,
    state: ForceLawState,
    step_s: f64,
    contact: ContactSteps,
    pose: Pose,
    /// Mean velocity of the head's origin and mean angular velocity over the last step, in the world.
    before: Vector6,
    /// The same over the second-last step.
    earlier: Vector6,
}

impl<'a> CompliantMotion<'a> {
    fn new(
        body: &'a Body,
        compliant: &'a CompliantLinkage,
        base: &Kinematics,
        step_s: f64,
    ) -> Result<Self, DynamicsError> {
        let gravity_in_base = base.world_from_body.rotation.inverse() * gravity_in_world();
        let scale_m = compliant.law.springs.first().map_or(0.1, |mounted| mounted.spring.length_m());
        let (rest, _) = Statics { law: &compliant.law, body, gravity_in_base, weight: 1.0, scale_m }
            .find_equilibrium(&compliant.rest)
            .map_err(|failure| DynamicsError::NoEquilibriumAtStart { reason: failure.to_string() })?;
        let head = base.of_frame(&rest);
        let centre = head.of_frame(&Pose::from_parts(body.centre_of_mass_in_head.into(), Rotation::identity()));
        let engine = Engine::new(body, &head.world_from_body, &velocity_before(&centre, 0.5 * step_s));
        Ok(Self {
            body,
            compliant,
            engine,
            state: compliant.law.state(),
            step_s,
            contact: ContactSteps::new(body, compliant, step_s),
            pose: head.world_from_body,
            before: velocity_before(&head, 0.5 * step_s),
            earlier: velocity_before(&head, 1.5 * step_s),
        })
    }

    /// Returns the head's motion at step `count` and advances to the next step.
    fn advance(&mut self, count: u64, base: &Kinematics, motion: &dyn BaseMotion) -> Result<Kinematics, DynamicsError> {
        let (start, twist, step_s) = (self.pose, self.engine.twist(), self.step_s);
        let (start_s, end_s) = (count as f64 * step_s, (count + 1) as f64 * step_s);
        let mut part = Part { motion, base: *base, start_s, end_s, length_s: step_s };
        let forces = self.compliant.law.forces(&mut self.state, &part.state(&start, &twist, self.body))?;
        check_bounds(start_s, forces.turn_rad, &twist)?;
        let parts = self.contact.count_parts(forces.overlap_m);
        let length_s = step_s / f64::from(parts);
        let end_of = |k: u32| if k == parts { end_s } else { start_s + f64::from(k) * length_s };
        (part.length_s, part.end_s) = (length_s, end_of(1));
        let change = self.change_of_twist(&forces, &part)?;
        self.drift(&change, length_s);
        for k in 2..=parts {
            part = part.next(end_of(k));
            let change = self.change_by_contact(&forces.inertia, &part)?;
            self.drift(&change, length_s);
        }
        let after = velocity_between(&start, &self.pose, step_s);
        let mut head = kinematics(&start, [&self.earlier, &self.before, &after], step_s);
        if self.contact.are_short() {
            self.set_velocity(&mut head, &(twist + change * 0.5));
        }
        self.earlier = std::mem::replace(&mut self.before, after);
        Ok(head)
    }

    /// Changes the twist and moves the head with the new one.
    fn drift(&mut self, change: &Vector6, length_s: f64) {
        self.engine.step(&(self.mass() * change / length_s), length_s);
        self.pose = self.engine.pose();
    }

    /// The mass matrix at the present pose, in the axes of the world.
    fn mass(&self) -> Matrix6 {
        self.body.mass_matrix(&self.pose.rotation.to_rotation_matrix().into_inner())
    }

    /// The change of the twist at the start of a step, whose first part is `part`.
    ///
    /// Damping and gyroscopic torque are evaluated at the mean of the old and the new twist.
    fn change_of_twist(&mut self, forces: &Forces, part: &Part<'_>) -> Result<Vector6, DynamicsError> {
        let law = &self.compliant.law;
        let joint = part.joint(law);
        let twist = self.engine.twist();
        let now = part.state(&self.pose, &twist, self.body);
        let mass = self.mass();
        let weight = stack(&(now.gravity_in_world * self.body.mass_kg), &Vector::zeros());
        let implicit = mass + forces.inertia + forces.damping * (0.5 * self.step_s);
        let implicit = implicit.cholesky().ok_or_else(|| part.singular())?;
        let inertia = mass.fixed_view::<3, 3>(3, 3);
        let contact = self.contact.impulse(&forces.contact, part.length_s);
        let other = forces.wrench - forces.contact;
        let (mut change, mut quadratic) = (Vector6::zeros(), Vector6::zeros());
        // Fixed-point iteration: each pass changes the gyroscopic torque by at most 1 %, and the quadratic forces, which are
        // smaller, less.
        for pass in 0..3 {
            let mean = now.twist + change * 0.5;
            let (_, turning) = split(&mean);
            let gyroscopic = stack(&Vector::zeros(), &-turning.cross(&(inertia * turning)));
            if pass < 2 {
                quadratic = law.quadratic_forces(&now, &mean);
            }
            let push = other + weight + gyroscopic + quadratic;
            change = implicit.solve(&(push * self.step_s + contact));
            if let Some(joint) = &joint {
                change = part.constrained(joint, &now, &change, &implicit)?;
            }
        }
        Ok(change)
    }

    /// The change of the twist by the contact at the start of a part within a step.
    fn change_by_contact(&mut self, inertia: &Matrix6, part: &Part<'_>) -> Result<Vector6, DynamicsError> {
        let twist = self.engine.twist();
        let now = part.state(&self.pose, &twist, self.body);
        let contact = self.compliant.law.contact(&mut self.state, &now)?;
        let factor = (self.mass() + inertia).cholesky().ok_or_else(|| part.singular())?;
        let change = factor.solve(&self.contact.impulse(&contact, part.length_s));
        match part.joint(&self.compliant.law) {
            None => Ok(change),
            Some(joint) => part.constrained(&joint, &now, &change, &factor),
        }
    }

    /// Sets the velocities of the head frame to those of `twist`, that of the centre of mass.
    fn set_velocity(&self, head: &mut Kinematics, twist: &Vector6) {
        let (velocity, turning) = split(twist);
        let arm = head.world_from_body.rotation * self.body.centre_of_mass_in_head;
        head.velocity_in_world = velocity - turning.cross(&arm);
        head.angular_velocity_in_world = turning;
    }
}

/// A time step, or a part of it.
struct Part<'a> {
    motion: &'a dyn BaseMotion,
    /// Motion of the base at the start.
    base: Kinematics,
    start_s: f64,
    end_s: f64,
    length_s: f64,
}

impl Part<'_> {
    /// The next part, up to `end_s`.
    fn next(self, end_s: f64) -> Self {
        Self { base: self.motion.at(self.end_s), start_s: self.end_s, end_s, ..self }
    }

    /// The state at the start, with a head at `world_from_head`.
    fn state<'b>(&'b self, world_from_head: &'b Pose, twist: &'b Vector6, body: &'b Body) -> MotionState<'b> {
        let (hold, gravity_in_world) = (self.motion.hold(self.start_s), gravity_in_world());
        MotionState { base: &self.base, world_from_head, twist, body, hold, gravity_in_world }
    }

    /// The joint of a linkage and the pose of the base at the end; `None` without a joint.
    fn joint<'b>(&self, law: &'b ForceLaw) -> Option<(&'b UniversalJoint, Pose)> {
        law.joint.as_ref().map(|joint| (joint, self.motion.at(self.end_s).world_from_body))
    }

    /// The change of the twist with the constraint wrench of the joint.
    fn constrained(
        &self,
        (joint, next_base): &(&UniversalJoint, Pose),
        now: &MotionState<'_>,
        change: &Vector6,
        inertia: &Cholesky<f64, U6>,
    ) -> Result<Vector6, DynamicsError> {
        joint
            .constrained_change(now, next_base, self.length_s, change, |wrenches| inertia.solve(wrenches))
            .ok_or_else(|| self.singular())
    }

    fn singular(&self) -> DynamicsError {
        let what = "the matrix of mass and damping is singular".to_owned();
        DynamicsError::Diverged { t_s: self.start_s, what }
    }
}

/// Velocity and angular velocity `earlier_s` before, by linear extrapolation.
fn velocity_before(now: &Kinematics, earlier_s: f64) -> Vector6 {
    stack(
        &(now.velocity_in_world - now.acceleration_in_world * earlier_s),
        &(now.angular_velocity_in_world - now.angular_acceleration_in_world * earlier_s),
    )
}

/// The constant velocity and angular velocity that lead from one pose to the next.
fn velocity_between(from: &Pose, to: &Pose, step_s: f64) -> Vector6 {
    let turn = (to.rotation * from.rotation.inverse()).scaled_axis();
    stack(&(to.translation.vector - from.translation.vector), &turn) / step_s
}

/// The motion at a pose, from the mean velocities over the two steps before and the step after it.
///
/// The velocity `(2 after + 5 before - earlier) / 6` is that of the parabola with those three means; the acceleration
/// is the difference of `after` and `before` over the step.
fn kinematics(pose: &Pose, [earlier, before, after]: [&Vector6; 3], step_s: f64) -> Kinematics {
    let (velocity, turning) = split(&((after * 2.0 + before * 5.0 - earlier) / 6.0));
    let (acceleration, angular_acceleration) = split(&((after - before) / step_s));
    Kinematics {
        world_from_body: *pose,
        velocity_in_world: velocity,
        angular_velocity_in_world: turning,
        acceleration_in_world: acceleration,
        angular_acceleration_in_world: angular_acceleration,
    }
}

/// Largest rotation that the force law covers, rad.
///
/// The rotation of a spring's top or of the head; the logarithm of a rotation is singular at pi.
const MAX_ROTATION_RAD: f64 = 3.0;

/// Speed above which the simulation is considered diverged, m/s.
const MAX_SPEED_M_PER_S: f64 = 300.0;

fn check_bounds(t_s: f64, turn_rad: f64, twist: &Vector6) -> Result<(), DynamicsError> {
    let (velocity, _) = split(twist);
    let what = if !turn_rad.is_finite() || !twist.iter().all(|x| x.is_finite()) {
        "the pose or velocity of the head is not finite".to_owned()
    } else if turn_rad > MAX_ROTATION_RAD {
        format!(
            "the head has rotated by {:.0} degrees, and the force law is valid up to {:.0}: add an end stop or reduce the base \
             motion",
            turn_rad.to_degrees(),
            MAX_ROTATION_RAD.to_degrees()
        )
    } else if velocity.norm() > MAX_SPEED_M_PER_S {
        format!("the speed of the head is {:.0} m/s, above the limit of {MAX_SPEED_M_PER_S:.0}", velocity.norm())
    } else {
        return Ok(());
    };
    Err(DynamicsError::Diverged { t_s, what })
}
