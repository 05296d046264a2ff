//! The head's motion, step by step.

use super::actuated::Actuated;
use super::body::Body;
use super::engine::Engine;
use super::error::DynamicsError;
use super::head::{HeadModel, Linkage};
use super::law::LawState;
use super::push::{Forces, Instant};
use super::sprung::Sprung;
use super::statics::Statics;
use crate::elasticity::{Matrix6, Vector6, split, stack};
use crate::geometry::{Kinematics, Pose, Rotation, Vector, gravity_in_world};
use crate::motion::BaseMotion;
use std::f64::consts::TAU;

/// Head and base at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadState {
    /// Seconds since the start.
    pub t_s: f64,
    /// The head.
    pub head: Kinematics,
    /// The base.
    pub base: Kinematics,
}

/// The motion of a head on a moving base: an endless iterator of [`HeadState`]s at 0, dt, 2 dt, ...
///
/// At the start the head rests on its base, and moves along if that moves. A rigid head, or one that a motor turns,
/// moves in closed form. A head that gives is a free body in rapier, pushed by its linkage's wrench (leapfrog):
/// velocities v live half a step before poses, and at step n
///
/// `M (v[n+1/2] - v[n-1/2]) / dt = F(q[n]) - C (mean v - v_base) - mean w x I mean w`, `q[n+1] = q[n] + dt v[n+1/2]`,
///
/// where the mean is that of the two half steps. In a joint the wrench that holds it together comes to the right side,
/// such that `q[n+1]` is in the joint again. The same rule runs backwards in time, so without damping energy has no
/// trend. What is handed out is of the head's own frame and belongs to the pose: from the steps' mean velocities, which
/// lead from pose to pose exactly, the velocity at the pose to third order in dt, and the acceleration to second order.
///
/// It ends after the first error.
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
    Sprung(Box<SprungMotion<'a>>),
    Failed,
}

impl<'a> HeadSimulation<'a> {
    /// The motion of `model` on `motion`, in steps of `step_s`.
    ///
    /// # Errors
    /// When the step is too long for the head's fastest oscillation, or the head finds no rest on the base as that
    /// starts.
    pub fn new(model: &'a HeadModel, motion: &'a dyn BaseMotion, step_s: f64) -> Result<Self, DynamicsError> {
        let fastest_hz = model.fastest_hz();
        let most_s = if fastest_hz > 0.0 { 1.0 / (TAU * fastest_hz) } else { f64::INFINITY };
        if !(step_s > 0.0 && step_s <= most_s && step_s.is_finite()) {
            return Err(DynamicsError::Step { step_s, most_s, fastest_hz });
        }
        let mechanism = match &model.linkage {
            Linkage::Rigid { base_from_head } => Mechanism::Rigid { base_from_head: *base_from_head },
            Linkage::Actuated(actuated) => Mechanism::Actuated(actuated),
            Linkage::Sprung(sprung) => {
                let start = motion.at(0.0);
                Mechanism::Sprung(Box::new(SprungMotion::new(&model.body, sprung, &start, step_s)?))
            }
        };
        Ok(Self { model, motion, step_s, count: 0, mechanism })
    }

    /// The model that moves.
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
            Mechanism::Actuated(actuated) => Ok(actuated.carried(&base, t_s)),
            Mechanism::Sprung(sprung) => {
                let next_base = || self.motion.at(self.count as f64 * self.step_s).world_from_body;
                sprung.advance(t_s, &base, self.motion.hold(t_s), &next_base)
            }
        };
        if head.is_err() {
            self.mechanism = Mechanism::Failed;
        }
        Some(head.map(|head| HeadState { t_s, head, base }))
    }
}

/// A head that swings.
struct SprungMotion<'a> {
    body: &'a Body,
    sprung: &'a Sprung,
    engine: Engine,
    state: LawState,
    step_s: f64,
    pose: Pose,
    /// Mean velocity of the head's origin and mean angular velocity over the step before, in the world.
    before: Vector6,
    /// Those over the step before that.
    earlier: Vector6,
}

impl<'a> SprungMotion<'a> {
    fn new(body: &'a Body, sprung: &'a Sprung, base: &Kinematics, step_s: f64) -> Result<Self, DynamicsError> {
        let gravity_in_base = base.world_from_body.rotation.inverse() * gravity_in_world();
        let scale_m = sprung.law.springs.first().map_or(0.1, |mounted| mounted.spring.length_m());
        let (rest, _) = Statics { law: &sprung.law, body, gravity_in_base, weight: 1.0, scale_m }
            .settle(&sprung.rest)
            .map_err(|unrest| DynamicsError::NoRestAtStart { reason: unrest.to_string() })?;
        let head = base.of_frame(&rest);
        let centre = head.of_frame(&Pose::from_parts(body.centre_of_mass_in_head.into(), Rotation::identity()));
        let engine = Engine::new(body, &head.world_from_body, &velocity_before(&centre, 0.5 * step_s), step_s);
        Ok(Self {
            body,
            sprung,
            engine,
            state: sprung.law.state(),
            step_s,
            pose: head.world_from_body,
            before: velocity_before(&head, 0.5 * step_s),
            earlier: velocity_before(&head, 1.5 * step_s),
        })
    }

    /// The head at `t_s`, having moved on to the step after, at which the base will be at `next_base`.
    fn advance(
        &mut self,
        t_s: f64,
        base: &Kinematics,
        hold: f64,
        next_base: &dyn Fn() -> Pose,
    ) -> Result<Kinematics, DynamicsError> {
        let twist = self.engine.twist();
        let gravity_in_world = gravity_in_world();
        let now = Instant { base, world_from_head: &self.pose, twist: &twist, body: self.body, hold, gravity_in_world };
        let forces = self.sprung.law.forces(&mut self.state, &now)?;
        check_bounds(t_s, forces.turn_rad, &twist)?;
        let rotation = self.pose.rotation.to_rotation_matrix().into_inner();
        let mass = self.body.mass_matrix(&rotation);
        let change = self
            .change_of_twist(&mass, &forces, &now, next_base)
            .ok_or_else(|| DynamicsError::Diverged { t_s, what: "mass and damping have no inverse".to_owned() })?;
        self.engine.step(&(mass * change / self.step_s));
        let next = self.engine.pose();
        let after = velocity_between(&self.pose, &next, self.step_s);
        let head = kinematics(&self.pose, [&self.earlier, &self.before, &after], self.step_s);
        self.pose = next;
        self.earlier = std::mem::replace(&mut self.before, after);
        Ok(head)
    }

    /// The change of the twist over the step, with damping and gyroscopic torque at the mean of old and new twist.
    fn change_of_twist(
        &self,
        mass: &Matrix6,
        forces: &Forces,
        now: &Instant<'_>,
        next_base: &dyn Fn() -> Pose,
    ) -> Option<Vector6> {
        let law = &self.sprung.law;
        let weight = stack(&(now.gravity_in_world * self.body.mass_kg), &Vector::zeros());
        let implicit = (mass + forces.inertia + forces.damping * (0.5 * self.step_s)).cholesky()?;
        let inertia = mass.fixed_view::<3, 3>(3, 3);
        let joint = law.joint.as_ref().map(|joint| (joint, next_base()));
        let mut change = Vector6::zeros();
        // The gyroscopic torque changes by a hundredth of itself at most from one pass to the next.
        for _ in 0..3 {
            let mean = now.twist + change * 0.5;
            let (_, turning) = split(&mean);
            let gyroscopic = stack(&Vector::zeros(), &-turning.cross(&(inertia * turning)));
            let push = forces.wrench + weight + gyroscopic + law.bend(now, &mean);
            change = implicit.solve(&(push * self.step_s));
            if let Some((joint, next_base)) = &joint {
                change = joint.held((now, next_base), self.step_s, &change, |wrenches| implicit.solve(wrenches))?;
            }
        }
        Some(change)
    }
}

/// Velocity and angular velocity `earlier_s` before the instant given.
fn velocity_before(now: &Kinematics, earlier_s: f64) -> Vector6 {
    stack(
        &(now.velocity_in_world - now.acceleration_in_world * earlier_s),
        &(now.angular_velocity_in_world - now.angular_acceleration_in_world * earlier_s),
    )
}

/// The steady velocity and angular velocity that lead from one pose to the next.
fn velocity_between(from: &Pose, to: &Pose, step_s: f64) -> Vector6 {
    let turn = (to.rotation * from.rotation.inverse()).scaled_axis();
    stack(&(to.translation.vector - from.translation.vector), &turn) / step_s
}

/// The motion at a pose between two steps.
///
/// From the mean velocities over the two steps before it and the one after, the velocity in between is
/// `(2 after + 5 before - earlier) / 6`, of the parabola with those three means, and the acceleration their difference.
fn kinematics(pose: &Pose, [earlier, before, after]: [&Vector6; 3], step_s: f64) -> Kinematics {
    let (velocity, turning) = split(&((after * 2.0 + before * 5.0 - earlier) / 6.0));
    let (acceleration, turning_faster) = split(&((after - before) / step_s));
    Kinematics {
        world_from_body: *pose,
        velocity_in_world: velocity,
        angular_velocity_in_world: turning,
        acceleration_in_world: acceleration,
        angular_acceleration_in_world: turning_faster,
    }
}

/// Greatest turn of a spring's top from its foot, or of the head from its rest, that the force law covers, rad; its
/// logarithm ends at pi.
const MOST_TURN_RAD: f64 = 3.0;

/// Greatest speed of a head, m/s.
const MOST_SPEED_M_PER_S: f64 = 300.0;

fn check_bounds(t_s: f64, turn_rad: f64, twist: &Vector6) -> Result<(), DynamicsError> {
    let (velocity, _) = split(twist);
    let what = if !turn_rad.is_finite() || !twist.iter().all(|x| x.is_finite()) {
        "the head's pose or velocity is no number".to_owned()
    } else if turn_rad > MOST_TURN_RAD {
        format!(
            "the head has turned by {:.0} degrees; its linkage's force law covers {:.0}: an end stop would hold the head",
            turn_rad.to_degrees(),
            MOST_TURN_RAD.to_degrees()
        )
    } else if velocity.norm() > MOST_SPEED_M_PER_S {
        format!("the head flies at {:.0} m/s", velocity.norm())
    } else {
        return Ok(());
    };
    Err(DynamicsError::Diverged { t_s, what })
}
