//! Motion of head and base as input of the elements of a linkage, and the resulting forces.

use super::body::Body;
use zsim_base::geometry::{Kinematics, Matrix, Pose, Vector, skew};
use zsim_elasticity::{Deformation, Matrix6, Vector6, blocks, split, stack};

/// Poses and velocities of head and base at one time.
pub(super) struct MotionState<'a> {
    pub base: &'a Kinematics,
    pub world_from_head: &'a Pose,
    /// Velocity of the head's centre of mass and angular velocity, in the world.
    pub twist: &'a Vector6,
    pub body: &'a Body,
    /// Strength of the hand hold, 0 (free) to 1 (firm).
    pub hold: f64,
    /// Gravitational acceleration, m/s^2.
    pub gravity_in_world: Vector,
}

impl MotionState<'_> {
    /// The vector from the head's centre of mass to a point of the head, in the world.
    pub fn lever(&self, point_in_head: &Vector) -> Vector {
        self.world_from_head.rotation * (point_in_head - self.body.centre_of_mass_in_head)
    }

    /// The head's centre of mass in the world, m.
    pub fn centre(&self) -> Vector {
        (self.world_from_head * nalgebra::Point3::from(self.body.centre_of_mass_in_head)).coords
    }

    /// The head's twist relative to the base; zero if both move as one rigid body.
    pub fn relative_twist(&self) -> Vector6 {
        let arm = self.centre() - self.base.world_from_body.translation.vector;
        let carried = self.base.velocity_in_world + self.base.angular_velocity_in_world.cross(&arm);
        self.twist - stack(&carried, &self.base.angular_velocity_in_world)
    }

    /// Acceleration of the point of the base that is at `point_in_world`, m/s^2.
    pub fn carried_acceleration(&self, point_in_world: &Vector) -> Vector {
        let (base, arm) = (self.base, point_in_world - self.base.world_from_body.translation.vector);
        let omega = base.angular_velocity_in_world;
        base.acceleration_in_world + base.angular_acceleration_in_world.cross(&arm) + omega.cross(&omega.cross(&arm))
    }
}

/// The forces on the head, about the centre of mass, in the world.
pub(super) struct Forces {
    /// Force and torque at the present velocities.
    pub wrench: Vector6,
    /// Minus the derivative of the wrench by the head's twist: symmetric and positive semidefinite.
    pub damping: Matrix6,
    /// Added mass: minus the derivative of the wrench by the head's acceleration.
    pub inertia: Matrix6,
    /// Largest rotation between the two frames of the linkage's reference or of a spring, rad.
    pub turn_rad: f64,
    /// The part of `wrench` by coils that touch.
    pub contact: Vector6,
    /// Largest overlap of the coils of a spring's segment, m; negative without contact.
    pub overlap_m: f64,
}

impl Forces {
    /// Zero forces.
    pub fn none() -> Self {
        Self {
            wrench: Vector6::zeros(),
            damping: Matrix6::zeros(),
            inertia: Matrix6::zeros(),
            turn_rad: 0.0,
            contact: Vector6::zeros(),
            overlap_m: f64::NEG_INFINITY,
        }
    }

    /// Adds a force that acts at the end of `lever`.
    pub fn add_force(&mut self, lever: &Vector, force: &Vector) {
        self.wrench += stack(force, &lever.cross(force));
    }

    /// Adds the damping matrix `c` (N s/m) of the point at the end of `lever`.
    ///
    /// The damping force itself must be added with [`Forces::add_force`].
    pub fn add_damper(&mut self, lever: &Vector, c: &Matrix) {
        self.damping += at_lever(lever, c);
    }

    /// Adds a pure torque.
    pub fn add_torque(&mut self, torque: &Vector) {
        self.wrench += stack(&Vector::zeros(), torque);
    }
}

/// Transforms a matrix for the point at the end of `lever` into one for the centre of mass.
pub(super) fn at_lever(lever: &Vector, matrix: &Matrix) -> Matrix6 {
    let arm = -skew(lever);
    let moved = matrix * arm;
    blocks(matrix, &moved, &moved.transpose(), &(arm.transpose() * moved))
}

/// A frame on the base and one on the head, connected by an element or a reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct EndFrames {
    pub base_from_foot: Pose,
    pub head_from_top: Pose,
}

/// The relative pose and deformation of two frames at one time.
pub(super) struct RelativePose {
    pub foot_from_top: Pose,
    pub deformation: Deformation,
    /// Axes of the foot in the world.
    pub axes: Matrix,
    /// The vector from the head's centre of mass to the top, in the world.
    pub lever: Vector,
}

impl EndFrames {
    /// The frames at the ends of the active coils, between rigid ends of `end_m` each.
    pub fn at_active_coils(&self, end_m: f64) -> Self {
        Self {
            base_from_foot: self.base_from_foot * Pose::translation(0.0, 0.0, end_m),
            head_from_top: self.head_from_top * Pose::translation(0.0, 0.0, -end_m),
        }
    }

    pub fn at(&self, now: &MotionState<'_>) -> RelativePose {
        let world_from_foot = now.base.world_from_body * self.base_from_foot;
        let foot_from_top = self.foot_from_top_in_world(&now.base.world_from_body, now.world_from_head);
        RelativePose {
            foot_from_top,
            deformation: Deformation::of(&foot_from_top),
            axes: world_from_foot.rotation.to_rotation_matrix().into_inner(),
            lever: now.lever(&self.head_from_top.translation.vector),
        }
    }

    /// Pose of the top relative to the foot, from the poses of base and head in the world.
    pub fn foot_from_top_in_world(&self, world_from_base: &Pose, world_from_head: &Pose) -> Pose {
        (world_from_base * self.base_from_foot).inv_mul(&(world_from_head * self.head_from_top))
    }

    /// Pose of the top relative to the foot.
    pub fn foot_from_top(&self, base_from_head: &Pose) -> Pose {
        self.base_from_foot.inv_mul(&(base_from_head * self.head_from_top))
    }
}

impl RelativePose {
    /// The Jacobian of the deformation coordinates by the head's twist about the centre of mass.
    ///
    /// The twist is relative to the base, in the axes of the world.
    pub fn rate_by_twist(&self) -> Matrix6 {
        let by_velocity = self.deformation.jacobian() * self.axes.transpose();
        let by_turning = self.deformation.coupling() * self.axes.transpose() - by_velocity * skew(&self.lever);
        blocks(&by_velocity, &by_turning, &Matrix::zeros(), &by_velocity)
    }

    /// Transforms a wrench about the top, in the axes of the foot, to the centre of mass and the axes of the world.
    pub fn to_centre(&self, on_top: &Vector6) -> Vector6 {
        let (force, torque) = split(on_top);
        let force = self.axes * force;
        stack(&force, &(self.axes * torque + self.lever.cross(&force)))
    }

    /// Rotation of the top relative to the foot, rad.
    pub fn turn_rad(&self) -> f64 {
        let (_, turn) = split(&self.deformation.coordinates);
        turn.norm()
    }
}
