//! A universal joint: two rotations are free, the other four motions are constrained.

use super::body::Body;
use super::elements::UniversalJointSpec;
use super::engine::predicted_pose;
use super::forces::{EndFrames, Forces, MotionState};
use nalgebra::{Matrix4, Matrix6x4, Vector4};
use zsim_base::geometry::{Pose, Rotation, Vector};
use zsim_elasticity::{Vector6, stack};

/// A universal joint: the cross has one arm on the base (the foot's x) and one on the head (the top's y).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct UniversalJoint {
    pub ends: EndFrames,
    stiffness_nm_per_rad: [f64; 2],
}

/// Maximum Newton iterations for the constraint wrench.
const MAX_ITERATIONS: usize = 20;

impl UniversalJoint {
    /// Creates the joint that a spec describes.
    pub fn of(spec: &UniversalJointSpec) -> Self {
        let ends =
            EndFrames { base_from_foot: spec.base_from_joint.pose(), head_from_top: spec.head_from_joint.pose() };
        Self { ends, stiffness_nm_per_rad: spec.stiffness_nm_per_rad }
    }

    /// The pose `base_from_head` with both angles zero.
    pub fn pose_at_zero_angles(&self) -> Pose {
        self.ends.base_from_foot * self.ends.head_from_top.inverse()
    }

    /// The two joint angles: cross about the base's axis, head about the head's axis.
    ///
    /// The rotation of the top is `Rx(a) Ry(b)`, whose entries (1, 1) and (2, 1) are `cos a` and `sin a`.
    fn angles_rad(&self, base_from_head: &Pose) -> [f64; 2] {
        let turn = self.ends.foot_from_top(base_from_head).rotation.to_rotation_matrix();
        [turn[(2, 1)].atan2(turn[(1, 1)]), turn[(0, 2)].atan2(turn[(0, 0)])]
    }

    /// The two rotation axes, base's and head's, in the frame of the poses.
    fn axes(&self, base: &Pose, head: &Pose) -> [Vector; 2] {
        [
            base.rotation * self.ends.base_from_foot.rotation * Vector::x(),
            head.rotation * self.ends.head_from_top.rotation * Vector::y(),
        ]
    }

    /// Adds the torque of the torsion springs.
    pub fn add_forces(&self, now: &MotionState<'_>, forces: &mut Forces) {
        let base = &now.base.world_from_body;
        let [about_base, about_head] = self.axes(base, now.world_from_head);
        let angles = self.angles_rad(&base.inv_mul(now.world_from_head));
        let [on_base, on_head] = [0, 1].map(|k| -self.stiffness_nm_per_rad[k] * angles[k]);
        // The axes are perpendicular, so each torque does work on one angle only.
        forces.add_torque(&(about_base * on_base + about_head * on_head));
    }

    /// Elastic energy of the torsion springs, J.
    pub fn potential_j(&self, base_from_head: &Pose) -> f64 {
        let angles = self.angles_rad(base_from_head);
        0.5 * (0..2).map(|k| self.stiffness_nm_per_rad[k] * angles[k] * angles[k]).sum::<f64>()
    }

    /// The free motions of the head: unit rotations about the two axes.
    ///
    /// Each is a displacement of the centre of mass and a rotation of the head.
    pub fn free_motions(&self, base: &Pose, head: &Pose, body: &Body) -> [Vector6; 2] {
        let lever = head.rotation * (body.centre_of_mass_in_head - self.ends.head_from_top.translation.vector);
        self.axes(base, head).map(|axis| stack(&axis.cross(&lever), &axis))
    }

    /// The head's pose after a rotation about the head's axis, then one about the base's axis.
    ///
    /// The result satisfies the joint constraint.
    pub fn rotated(&self, base: &Pose, head: &Pose, angles_rad: [f64; 2]) -> Pose {
        let [about_base, about_head] = self.axes(base, head);
        let turn = Rotation::from_scaled_axis(about_base * angles_rad[0])
            * Rotation::from_scaled_axis(about_head * angles_rad[1]);
        let pivot = head * nalgebra::Point3::from(self.ends.head_from_top.translation.vector);
        let rotation = turn * head.rotation;
        let origin = pivot.coords - rotation * self.ends.head_from_top.translation.vector;
        Pose::from_parts(origin.into(), rotation)
    }

    /// The constraint violation: gap between the halves of the joint, m, and cosine between the axes.
    fn constraint_violation(&self, base: &Pose, head: &Pose) -> Vector4<f64> {
        let foot = (base * self.ends.base_from_foot).translation.vector;
        let top = (head * self.ends.head_from_top).translation.vector;
        let [about_base, about_head] = self.axes(base, head);
        let gap = top - foot;
        Vector4::new(gap.x, gap.y, gap.z, about_base.dot(&about_head))
    }

    /// The constraint wrenches about the head's centre of mass: the gradient of the constraint violation.
    fn constraint_wrenches(&self, base: &Pose, head: &Pose, body: &Body) -> Matrix6x4<f64> {
        let lever = head.rotation * (self.ends.head_from_top.translation.vector - body.centre_of_mass_in_head);
        let [about_base, about_head] = self.axes(base, head);
        let force = |axis: Vector| stack(&axis, &lever.cross(&axis));
        let twist = stack(&Vector::zeros(), &about_head.cross(&about_base));
        Matrix6x4::from_columns(&[force(Vector::x()), force(Vector::y()), force(Vector::z()), twist])
    }

    /// The change of the head's twist over a step such that the constraint holds at the end of the step.
    ///
    /// `change` is the change without the constraint wrench. Method: SHAKE (Ryckaert, Ciccotti and Berendsen 1977);
    /// `implicit` multiplies by the inverse of mass and damping.
    ///
    /// `None` if the iteration does not converge.
    pub fn constrained_change(
        &self,
        now: &MotionState<'_>,
        next_base: &Pose,
        step_s: f64,
        change: &Vector6,
        implicit: impl Fn(&Matrix6x4<f64>) -> Matrix6x4<f64>,
    ) -> Option<Vector6> {
        let wrenches = self.constraint_wrenches(&now.base.world_from_body, now.world_from_head, now.body);
        let by_wrench = implicit(&wrenches);
        let slope: Matrix4<f64> = wrenches.tr_mul(&by_wrench) * step_s;
        let newton = slope.try_inverse()?;
        // Rounding error: at 100 m from the world origin, positions are accurate to 1e-14 m.
        let tolerance = 1e-14 * (1.0 + next_base.translation.vector.norm());
        let mut constrained = *change;
        for _ in 0..MAX_ITERATIONS {
            let next = predicted_pose(now.body, now.world_from_head, &(now.twist + constrained), step_s);
            let violation = self.constraint_violation(next_base, &next);
            if violation.amax() <= tolerance {
                return Some(constrained);
            }
            constrained -= by_wrench * (newton * violation);
        }
        None
    }
}
