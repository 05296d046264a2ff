//! Poses of the base from the motion of the head, by inversion of the linkage's force law.

use super::body::Body;
use super::compliant::CompliantLinkage;
use super::error::DynamicsError;
use super::force_law::ForceLawState;
use super::forces::{Forces, MotionState};
use super::head::{HeadModel, Linkage};
use zsim_base::geometry::{Kinematics, Pose, Rotation, Trajectory, Vector, gravity_in_world};
use zsim_base::time::Stamp;
use zsim_elasticity::{Matrix6, Vector6, split, stack};

/// Step of the central differences by the base's pose, m and rad.
const DIFFERENCE: f64 = 1e-6;
/// Newton's method stops at a step below this, m and rad, and fails after this number of iterations.
const STEP_TOLERANCE: f64 = 1e-7;
const MAX_ITERATIONS: usize = 20;

impl HeadModel {
    /// The poses of the base if the linkage were rigid at the equilibrium: the paper's figures 11 to 13.
    pub fn base_from_rigid_link(&self, world_from_head: &Trajectory) -> Vec<(Stamp, Pose)> {
        let head_from_base = self.base_from_head_at_rest().inverse();
        world_from_head.iter().map(|(stamp, head)| (stamp, head * head_from_base)).collect()
    }

    /// The poses of the base from those of the head, by the force law of the linkage.
    ///
    /// At each pose of the head but the first and the last, solves for the base pose at which the wrench of the linkage
    /// explains the head's acceleration. The poses must be about evenly spaced, as those of an estimator or the ground
    /// truth, and the world has z up. Not modelled: a hand hold, and the effect of the base's acceleration on wire and
    /// fluid. Poses without a solution are omitted, for instance where the base shakes faster than the sampling of the
    /// head's poses.
    ///
    /// # Errors
    /// When a motor or a joint constrains the head, since the constraint wrench is unknown, or when no pose has a
    /// solution.
    pub fn base_from_force_law(&self, world_from_head: &Trajectory) -> Result<Vec<(Stamp, Pose)>, DynamicsError> {
        let compliant = match &self.linkage {
            Linkage::Rigid { .. } => return Ok(self.base_from_rigid_link(world_from_head)),
            Linkage::Compliant(compliant) if compliant.law.joint.is_none() => compliant,
            Linkage::Actuated(_) => return Err(DynamicsError::BaseUnknown { constraint: "a motor" }),
            Linkage::Compliant(_) => return Err(DynamicsError::BaseUnknown { constraint: "a joint" }),
        };
        let mut solver = BaseSolver::new(&self.body, compliant);
        let (stamps, poses) = (world_from_head.stamps(), world_from_head.poses());
        let mut bases = Vec::new();
        for k in 1..poses.len().saturating_sub(1) {
            let steps_s = [stamps[k].seconds_since(stamps[k - 1]), stamps[k + 1].seconds_since(stamps[k])];
            let motion = HeadMotion::from_poses([&poses[k - 1], &poses[k], &poses[k + 1]], steps_s, &self.body);
            bases.extend(solver.solve_next(&motion, steps_s[0]).map(|base| (stamps[k], base)));
        }
        if bases.is_empty() && poses.len() > 2 {
            return Err(DynamicsError::Diverged {
                t_s: 0.0,
                what: "no pose of the base explains the motion of the head".to_owned(),
            });
        }
        Ok(bases)
    }
}

/// The motion of the head at one pose.
struct HeadMotion {
    pose: Pose,
    /// Velocity of the centre of mass and angular velocity, in the world.
    twist: Vector6,
    /// Time derivative of the twist.
    twist_rate: Vector6,
}

impl HeadMotion {
    /// Computes the motion at the middle of three successive poses by finite differences of second order.
    fn from_poses([before, now, after]: [&Pose; 3], [first_s, second_s]: [f64; 2], body: &Body) -> Self {
        let centre = |pose: &Pose| (pose * nalgebra::Point3::from(body.centre_of_mass_in_head)).coords;
        let twist = |from: &Pose, to: &Pose, step_s: f64| {
            let turn = (to.rotation * from.rotation.inverse()).scaled_axis();
            stack(&(centre(to) - centre(from)), &turn) / step_s
        };
        let (earlier, later) = (twist(before, now, first_s), twist(now, after, second_s));
        let whole_s = first_s + second_s;
        Self {
            pose: *now,
            twist: (earlier * second_s + later * first_s) / whole_s,
            twist_rate: (later - earlier) * (2.0 / whole_s),
        }
    }
}

/// Solves for the base at successive poses of the head.
struct BaseSolver<'a> {
    body: &'a Body,
    compliant: &'a CompliantLinkage,
    state: ForceLawState,
    /// Head and base at the previous pose; `None` if it had no solution.
    before: Option<[Pose; 2]>,
}

impl<'a> BaseSolver<'a> {
    fn new(body: &'a Body, compliant: &'a CompliantLinkage) -> Self {
        Self { body, compliant, state: compliant.law.state(), before: None }
    }

    /// The base pose for a motion of the head, `step_s` after the previous pose.
    fn solve_next(&mut self, motion: &HeadMotion, step_s: f64) -> Option<Pose> {
        let before = self.before.take();
        // First guess: the spring keeps the previous deformation. Second guess: the head is in equilibrium.
        let previous = before.map(|[head, base]| motion.pose * (head.inverse() * base));
        let rest = motion.pose * self.compliant.rest.inverse();
        let base_before = before.map(|[_, base]| base);
        let starts = previous.into_iter().chain([rest]);
        let base = starts.into_iter().find_map(|start| self.solve(motion, start, base_before.as_ref(), step_s))?;
        self.before = Some([motion.pose, base]);
        Some(base)
    }

    /// The base pose that explains the motion, by Newton's method from `start`; `None` without convergence.
    fn solve(&mut self, motion: &HeadMotion, start: Pose, before: Option<&Pose>, step_s: f64) -> Option<Pose> {
        let mut base = start;
        for _ in 0..MAX_ITERATIONS {
            let residual_wrench = self.residual_wrench(motion, &base, before, step_s).ok()?;
            let slope = self.residual_derivative(motion, &base, before, step_s).ok()?;
            let step = slope.lu().solve(&residual_wrench).filter(|step| step.iter().all(|x| x.is_finite()))?;
            base = displaced(&base, &-step);
            if step.amax() < STEP_TOLERANCE {
                return Some(base);
            }
        }
        None
    }

    /// The residual wrench about the centre of mass: required by the head's motion minus supplied by the linkage.
    fn residual_wrench(
        &mut self,
        motion: &HeadMotion,
        base: &Pose,
        before: Option<&Pose>,
        step_s: f64,
    ) -> Result<Vector6, DynamicsError> {
        let base = before.map_or_else(|| Kinematics::at_rest(*base), |before| moving(before, base, step_s));
        let gravity_in_world = gravity_in_world();
        let now = MotionState {
            base: &base,
            world_from_head: &motion.pose,
            twist: &motion.twist,
            body: self.body,
            hold: 0.0,
            gravity_in_world,
        };
        let Forces { wrench, inertia, .. } = self.compliant.law.forces(&mut self.state, &now)?;
        let mass = self.body.mass_matrix(motion.pose.rotation.to_rotation_matrix().matrix());
        let (_, turning) = split(&motion.twist);
        let gyroscopic = turning.cross(&(mass.fixed_view::<3, 3>(3, 3) * turning));
        let weight = stack(&(gravity_in_world * self.body.mass_kg), &-gyroscopic);
        Ok((mass + inertia) * motion.twist_rate
            - wrench
            - weight
            - self.compliant.law.quadratic_forces(&now, &motion.twist))
    }

    /// The derivative of the residual by a displacement of the base, by central differences.
    fn residual_derivative(
        &mut self,
        motion: &HeadMotion,
        base: &Pose,
        before: Option<&Pose>,
        step_s: f64,
    ) -> Result<Matrix6, DynamicsError> {
        let mut slope = Matrix6::zeros();
        for axis in 0..6 {
            let mut step = Vector6::zeros();
            step[axis] = DIFFERENCE;
            let plus = self.residual_wrench(motion, &displaced(base, &step), before, step_s)?;
            let minus = self.residual_wrench(motion, &displaced(base, &-step), before, step_s)?;
            slope.set_column(axis, &((plus - minus) / (2.0 * DIFFERENCE)));
        }
        Ok(slope)
    }
}

/// The kinematics of a base that moves from one pose to another at constant velocity.
fn moving(from: &Pose, to: &Pose, step_s: f64) -> Kinematics {
    let turn = (to.rotation * from.rotation.inverse()).scaled_axis();
    Kinematics {
        velocity_in_world: (to.translation.vector - from.translation.vector) / step_s,
        angular_velocity_in_world: turn / step_s,
        ..Kinematics::at_rest(*to)
    }
}

/// A pose displaced and rotated about its origin, in the axes of the world.
fn displaced(pose: &Pose, by: &Vector6) -> Pose {
    let (shift, turn): (Vector, Vector) = split(by);
    Pose::from_parts((pose.translation.vector + shift).into(), Rotation::from_scaled_axis(turn) * pose.rotation)
}
