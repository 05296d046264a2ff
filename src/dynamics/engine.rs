//! Time integration of one free body by rapier; the only file that uses rapier's types.

use super::body::Body;
use rapier3d_f64::prelude::{MassProperties, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle};
use zsim_base::geometry::Pose;
use zsim_elasticity::{Vector6, split, stack};

/// A free rigid body in an empty world without gravity.
///
/// A step updates the velocities with wrench over mass, then the pose with the new velocities (symplectic Euler). One
/// solver iteration a step: with several, rapier repeats the update with the same wrench, which adds energy to an
/// oscillation. The gyroscopic term of rapier is explicit and therefore disabled; it is part of the wrench.
pub(super) struct Engine {
    world: PhysicsWorld,
    handle: RigidBodyHandle,
}

impl Engine {
    /// Creates the body at `world_from_head` with `twist`.
    ///
    /// The twist is the velocity of the centre of mass and the angular velocity, in the world.
    pub fn new(body: &Body, world_from_head: &Pose, twist: &Vector6) -> Self {
        let mut world = PhysicsWorld::new();
        world.gravity = Default::default();
        world.integration_parameters.num_solver_iterations = 1;
        let inertia = rapier3d_f64::math::Matrix::from_cols(
            body.inertia_in_head.column(0).into_owned().into(),
            body.inertia_in_head.column(1).into_owned().into(),
            body.inertia_in_head.column(2).into_owned().into(),
        );
        let mass = MassProperties::with_inertia_matrix(body.centre_of_mass_in_head.into(), body.mass_kg, inertia);
        let (velocity, turning) = split(twist);
        let builder = RigidBodyBuilder::dynamic()
            .pose((*world_from_head).into())
            .linvel(velocity.into())
            .angvel(turning.into())
            .additional_mass_properties(mass)
            .can_sleep(false)
            .gyroscopic_forces_enabled(false)
            .allow_fast_rotation(true);
        let handle = world.insert_body(builder);
        Self { world, handle }
    }

    /// Advances one step of `step_s` under a force and a torque about the centre of mass, in the world.
    pub fn step(&mut self, wrench: &Vector6, step_s: f64) {
        let (force, torque) = split(wrench);
        self.world.integration_parameters.dt = step_s;
        if let Some(body) = self.world.bodies.get_mut(self.handle) {
            body.reset_forces(false);
            body.reset_torques(false);
            body.add_force(force.into(), false);
            body.add_torque(torque.into(), false);
        }
        self.world.step();
    }

    /// The pose `world_from_head`.
    pub fn pose(&self) -> Pose {
        (*self.world.bodies[self.handle].position()).into()
    }

    /// Velocity of the centre of mass and angular velocity, in the world.
    ///
    /// They apply half a step before the time of the pose (leapfrog).
    pub fn twist(&self) -> Vector6 {
        let body = &self.world.bodies[self.handle];
        stack(&body.linvel().into(), &body.angvel().into())
    }
}

/// Predicts the pose after one step with `twist`.
///
/// Rapier rotates by `2 atan(|w| h / 2)` instead of `|w| h`.
pub(super) fn predicted_pose(body: &Body, pose: &Pose, twist: &Vector6, step_s: f64) -> Pose {
    let (shift, turn) = split(&(twist * step_s));
    let angle = turn.norm();
    let turned = if angle > 0.0 { turn * (2.0 * (0.5 * angle).atan() / angle) } else { turn };
    body.displaced(pose, &stack(&shift, &turned))
}
