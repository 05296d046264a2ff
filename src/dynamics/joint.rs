//! A universal joint: two turns are free, four motions are not.

use super::body::Body;
use super::elements::UniversalJointSpec;
use super::engine::ahead;
use super::push::{Ends, Forces, Instant};
use crate::elasticity::{Vector6, stack};
use crate::geometry::{Pose, Rotation, Vector};
use nalgebra::{Matrix4, Matrix6x4, Vector4};

/// A joint whose cross has one arm on the base (the foot's x) and one on the head (the top's y).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct UniversalJoint {
    pub ends: Ends,
    stiffness_nm_per_rad: [f64; 2],
}

/// Iterations of Newton's method for the force that the joint bears.
const MOST_ITERATIONS: usize = 20;

impl UniversalJoint {
    /// The joint of a spec.
    pub fn of(spec: &UniversalJointSpec) -> Self {
        let ends = Ends { base_from_foot: spec.base_from_joint.pose(), head_from_top: spec.head_from_joint.pose() };
        Self { ends, stiffness_nm_per_rad: spec.stiffness_nm_per_rad }
    }

    /// `base_from_head` with both angles at nought.
    pub fn straight(&self) -> Pose {
        self.ends.base_from_foot * self.ends.head_from_top.inverse()
    }

    /// The two angles: of the cross about the base's axis, and of the head about its own on the cross.
    ///
    /// The top is turned by `Rx(a) Ry(b)`, of which the second row holds `cos a` and the third `sin a` in the middle.
    fn angles_rad(&self, base_from_head: &Pose) -> [f64; 2] {
        let turn = self.ends.foot_from_top(base_from_head).rotation.to_rotation_matrix();
        [turn[(2, 1)].atan2(turn[(1, 1)]), turn[(0, 2)].atan2(turn[(0, 0)])]
    }

    /// The axes of the two turns: the base's and the head's, in the frame in which the poses are.
    fn axes(&self, base: &Pose, head: &Pose) -> [Vector; 2] {
        [
            base.rotation * self.ends.base_from_foot.rotation * Vector::x(),
            head.rotation * self.ends.head_from_top.rotation * Vector::y(),
        ]
    }

    /// Adds the torsion springs' torque.
    pub fn push(&self, now: &Instant<'_>, forces: &mut Forces) {
        let base = &now.base.world_from_body;
        let [about_base, about_head] = self.axes(base, now.world_from_head);
        let angles = self.angles_rad(&base.inv_mul(now.world_from_head));
        let [on_base, on_head] = [0, 1].map(|k| -self.stiffness_nm_per_rad[k] * angles[k]);
        // The axes are at right angles: each torque works on its own angle alone.
        forces.add_torque(&(about_base * on_base + about_head * on_head));
    }

    /// Energy in the torsion springs, J.
    pub fn potential_j(&self, base_from_head: &Pose) -> f64 {
        let angles = self.angles_rad(base_from_head);
        0.5 * (0..2).map(|k| self.stiffness_nm_per_rad[k] * angles[k] * angles[k]).sum::<f64>()
    }

    /// The motions that are left to a head: a turn by one radian about each axis, as displacements of its centre of
    /// mass and turns.
    pub fn directions(&self, base: &Pose, head: &Pose, body: &Body) -> [Vector6; 2] {
        let lever = head.rotation * (body.centre_of_mass_in_head - self.ends.head_from_top.translation.vector);
        self.axes(base, head).map(|axis| stack(&axis.cross(&lever), &axis))
    }

    /// The head after a turn about its own axis, then one about the base's: it stays in the joint.
    pub fn turned(&self, base: &Pose, head: &Pose, angles_rad: [f64; 2]) -> Pose {
        let [about_base, about_head] = self.axes(base, head);
        let turn = Rotation::from_scaled_axis(about_base * angles_rad[0])
            * Rotation::from_scaled_axis(about_head * angles_rad[1]);
        let pivot = head * nalgebra::Point3::from(self.ends.head_from_top.translation.vector);
        let rotation = turn * head.rotation;
        let place = pivot.coords - rotation * self.ends.head_from_top.translation.vector;
        Pose::from_parts(place.into(), rotation)
    }

    /// What must be nought: the gap between the joint's halves, m, and the cosine between its axes.
    fn apart(&self, base: &Pose, head: &Pose) -> Vector4<f64> {
        let foot = (base * self.ends.base_from_foot).translation.vector;
        let top = (head * self.ends.head_from_top).translation.vector;
        let [about_base, about_head] = self.axes(base, head);
        let gap = top - foot;
        Vector4::new(gap.x, gap.y, gap.z, about_base.dot(&about_head))
    }

    /// The wrenches that the joint can bear, about the head's centre of mass: those that make what is apart grow.
    fn bears(&self, base: &Pose, head: &Pose, body: &Body) -> Matrix6x4<f64> {
        let lever = head.rotation * (self.ends.head_from_top.translation.vector - body.centre_of_mass_in_head);
        let [about_base, about_head] = self.axes(base, head);
        let force = |axis: Vector| stack(&axis, &lever.cross(&axis));
        let twist = stack(&Vector::zeros(), &about_head.cross(&about_base));
        Matrix6x4::from_columns(&[force(Vector::x()), force(Vector::y()), force(Vector::z()), twist])
    }

    /// The change of the head's twist over a step, `change` without the joint, such that the head is in its joint at
    /// the step's end (SHAKE; Ryckaert, Ciccotti and Berendsen 1977): the joint's wrench works through `implicit`, the
    /// inverse of mass and damping.
    ///
    /// `None` where no wrench brings it there.
    pub fn held(
        &self,
        (now, next_base): (&Instant<'_>, &Pose),
        step_s: f64,
        change: &Vector6,
        implicit: impl Fn(&Matrix6x4<f64>) -> Matrix6x4<f64>,
    ) -> Option<Vector6> {
        let bears = self.bears(&now.base.world_from_body, now.world_from_head, now.body);
        let by_wrench = implicit(&bears);
        let slope: Matrix4<f64> = bears.tr_mul(&by_wrench) * step_s;
        let newton = slope.try_inverse()?;
        // To rounding: where the base is a hundred metres from the world's origin, its place is known to 1e-14 m.
        let as_near_as_told = 1e-14 * (1.0 + next_base.translation.vector.norm());
        let mut held = *change;
        for _ in 0..MOST_ITERATIONS {
            let next = ahead(now.body, now.world_from_head, &(now.twist + held), step_s);
            let apart = self.apart(next_base, &next);
            if apart.amax() <= as_near_as_told {
                return Some(held);
            }
            held -= by_wrench * (newton * apart);
        }
        None
    }
}
