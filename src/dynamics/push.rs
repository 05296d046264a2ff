//! What the elements of a linkage are asked, and what they answer.

use super::body::Body;
use crate::elasticity::{Deformation, Matrix6, Vector6, blocks, split, stack};
use crate::geometry::{Kinematics, Matrix, Pose, Vector, skew};

/// Where head and base are at an instant, and how fast.
pub(super) struct Instant<'a> {
    pub base: &'a Kinematics,
    pub world_from_head: &'a Pose,
    /// Velocity of the head's centre of mass, and angular velocity, in the world.
    pub twist: &'a Vector6,
    pub body: &'a Body,
    /// How firmly the hand holds, 0 to 1.
    pub hold: f64,
    /// Acceleration of free fall, m/s^2.
    pub gravity_in_world: Vector,
}

impl Instant<'_> {
    /// From the head's centre of mass to a point of the head, in the world.
    pub fn lever(&self, point_in_head: &Vector) -> Vector {
        self.world_from_head.rotation * (point_in_head - self.body.centre_of_mass_in_head)
    }

    /// The head's centre of mass in the world.
    pub fn centre(&self) -> Vector {
        (self.world_from_head * nalgebra::Point3::from(self.body.centre_of_mass_in_head)).coords
    }

    /// The head's twist as seen from the base: what is left when both move as one body is nothing.
    pub fn relative_twist(&self) -> Vector6 {
        let arm = self.centre() - self.base.world_from_body.translation.vector;
        let carried = self.base.velocity_in_world + self.base.angular_velocity_in_world.cross(&arm);
        self.twist - stack(&carried, &self.base.angular_velocity_in_world)
    }

    /// Acceleration that the point of the base at `place` in the world has.
    pub fn carried_acceleration(&self, place: &Vector) -> Vector {
        let (base, arm) = (self.base, place - self.base.world_from_body.translation.vector);
        let omega = base.angular_velocity_in_world;
        base.acceleration_in_world + base.angular_acceleration_in_world.cross(&arm) + omega.cross(&omega.cross(&arm))
    }
}

/// What acts on the head, about its centre of mass, in the world.
pub(super) struct Forces {
    /// Force and torque at the instant's velocities.
    pub wrench: Vector6,
    /// Minus the derivative of the wrench by the head's twist: symmetric, never negative.
    pub damping: Matrix6,
    /// Mass that moves along, beside the head's own: minus the derivative of the wrench by the head's acceleration.
    pub inertia: Matrix6,
    /// How far the head has turned from the base in the coordinates of its damping, or the top of one of its springs
    /// from its foot, rad.
    pub turn_rad: f64,
}

impl Forces {
    /// Nothing yet.
    pub fn none() -> Self {
        Self { wrench: Vector6::zeros(), damping: Matrix6::zeros(), inertia: Matrix6::zeros(), turn_rad: 0.0 }
    }

    /// Adds a force at the end of `lever`.
    pub fn add_force(&mut self, lever: &Vector, force: &Vector) {
        self.wrench += stack(force, &lever.cross(force));
    }

    /// Adds a damper `c` (N s/m) of the point at the end of `lever`, whose force is among the forces already.
    pub fn add_damper(&mut self, lever: &Vector, c: &Matrix) {
        self.damping += at_lever(lever, c);
    }

    /// Adds a torque.
    pub fn add_torque(&mut self, torque: &Vector) {
        self.wrench += stack(&Vector::zeros(), torque);
    }
}

/// A matrix for the motion of the point at the end of `lever` as one for the centre of mass.
pub(super) fn at_lever(lever: &Vector, matrix: &Matrix) -> Matrix6 {
    let arm = -skew(lever);
    let moved = matrix * arm;
    blocks(matrix, &moved, &moved.transpose(), &(arm.transpose() * moved))
}

/// A frame on the base and one on the head between which something gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ends {
    pub base_from_foot: Pose,
    pub head_from_top: Pose,
}

/// The two frames of [`Ends`] at an instant.
pub(super) struct Between {
    pub foot_from_top: Pose,
    pub deformation: Deformation,
    /// The foot's axes in the world.
    pub axes: Matrix,
    /// From the head's centre of mass to the top, in the world.
    pub lever: Vector,
}

impl Ends {
    pub fn at(&self, now: &Instant<'_>) -> Between {
        let world_from_foot = now.base.world_from_body * self.base_from_foot;
        let foot_from_top = world_from_foot.inv_mul(&(now.world_from_head * self.head_from_top));
        Between {
            foot_from_top,
            deformation: Deformation::of(&foot_from_top),
            axes: world_from_foot.rotation.to_rotation_matrix().into_inner(),
            lever: now.lever(&self.head_from_top.translation.vector),
        }
    }

    /// Pose of the top seen from the foot.
    pub fn foot_from_top(&self, base_from_head: &Pose) -> Pose {
        self.base_from_foot.inv_mul(&(base_from_head * self.head_from_top))
    }
}

impl Between {
    /// The rate of the deformation's coordinates by the head's twist about its centre of mass, seen from the base, in
    /// the world's axes.
    pub fn rate_by_twist(&self) -> Matrix6 {
        let by_velocity = self.deformation.straight * self.axes.transpose();
        let by_turning = self.deformation.mixed * self.axes.transpose() - by_velocity * skew(&self.lever);
        blocks(&by_velocity, &by_turning, &Matrix::zeros(), &by_velocity)
    }

    /// A wrench on the top, about the top and in the foot's axes, as one about the centre of mass in the world's.
    pub fn to_centre(&self, on_top: &Vector6) -> Vector6 {
        let (force, torque) = split(on_top);
        let force = self.axes * force;
        stack(&force, &(self.axes * torque + self.lever.cross(&force)))
    }

    /// How far the top has turned, rad.
    pub fn turn_rad(&self) -> f64 {
        let (_, turn) = split(&self.deformation.coordinates);
        turn.norm()
    }
}
