//! The base under a head whose motion is known: the linkage's law, solved for its other end.

use super::body::Body;
use super::error::DynamicsError;
use super::head::{HeadModel, Linkage};
use super::law::LawState;
use super::push::{Forces, Instant};
use super::sprung::Sprung;
use crate::elasticity::{Matrix6, Vector6, split, stack};
use crate::geometry::{Kinematics, Pose, Rotation, Trajectory, Vector, gravity_in_world};
use crate::time::Stamp;

/// Step of the central differences by the base's pose, m and rad.
const DIFFERENCE: f64 = 1e-6;
/// Newton's steps a pose end when they are this small, m and rad, and at the latest after so many.
const SETTLED: f64 = 1e-7;
const MOST_STEPS: usize = 20;

impl HeadModel {
    /// The poses of the base, were the head screwed to it as it rests: the rigid link of the paper's figures 11 to 13.
    pub fn base_on_rigid_link(&self, world_from_head: &Trajectory) -> Vec<(Stamp, Pose)> {
        let head_from_base = self.rest_pose_base_from_head().inverse();
        world_from_head.iter().map(|(stamp, head)| (stamp, head * head_from_base)).collect()
    }

    /// The poses of the base by the linkage's own law: at each of the head's poses but the first and the last, the base
    /// that pushes the head as it is seen to accelerate. The head's poses are about evenly spaced, as an estimator's or
    /// the truth's are; its world has z up. A hand that holds the head is not known of, and what moves along with a
    /// spring is taken to move as with a base at rest. Where no base explains what the head does, as where it shakes
    /// faster than its poses follow each other, none is told.
    ///
    /// # Errors
    /// When a motor or a joint holds the head, whose pushes its motion does not tell; when no base explains anything.
    pub fn base_under(&self, world_from_head: &Trajectory) -> Result<Vec<(Stamp, Pose)>, DynamicsError> {
        let sprung = match &self.linkage {
            Linkage::Rigid { .. } => return Ok(self.base_on_rigid_link(world_from_head)),
            Linkage::Sprung(sprung) if sprung.law.joint.is_none() => sprung,
            Linkage::Actuated(_) => return Err(DynamicsError::BaseUnknown { holder: "a motor" }),
            Linkage::Sprung(_) => return Err(DynamicsError::BaseUnknown { holder: "a joint" }),
        };
        let mut under = Under::new(&self.body, sprung);
        let (stamps, poses) = (world_from_head.stamps(), world_from_head.poses());
        let mut bases = Vec::new();
        for k in 1..poses.len().saturating_sub(1) {
            let steps_s = [stamps[k].seconds_since(stamps[k - 1]), stamps[k + 1].seconds_since(stamps[k])];
            let seen = Seen::between([&poses[k - 1], &poses[k], &poses[k + 1]], steps_s, &self.body);
            bases.extend(under.follow(&seen, steps_s[0]).map(|base| (stamps[k], base)));
        }
        if bases.is_empty() && poses.len() > 2 {
            return Err(DynamicsError::Diverged { t_s: 0.0, what: "no base explains how the head moves".to_owned() });
        }
        Ok(bases)
    }
}

/// The head's motion at one of its poses.
struct Seen {
    pose: Pose,
    /// Velocity of the centre of mass, and angular velocity.
    twist: Vector6,
    /// Their rates.
    rate: Vector6,
}

impl Seen {
    /// From three poses in a row: differences, of second order in the step.
    fn between([before, now, after]: [&Pose; 3], [first_s, second_s]: [f64; 2], body: &Body) -> Self {
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
            rate: (later - earlier) * (2.0 / whole_s),
        }
    }
}

/// Follows the base from pose to pose.
struct Under<'a> {
    body: &'a Body,
    sprung: &'a Sprung,
    state: LawState,
    /// Head and base at the pose before, where that told its base.
    before: Option<[Pose; 2]>,
}

impl<'a> Under<'a> {
    fn new(body: &'a Body, sprung: &'a Sprung) -> Self {
        Self { body, sprung, state: sprung.law.state(), before: None }
    }

    /// The base under the head as it is `seen`, `step_s` after the pose before.
    fn follow(&mut self, seen: &Seen, step_s: f64) -> Option<Pose> {
        let before = self.before.take();
        // Sought first where it would be, had the spring kept its shape; else where the head rests on it.
        let kept = before.map(|[head, base]| seen.pose * (head.inverse() * base));
        let rest = seen.pose * self.sprung.rest.inverse();
        let base_before = before.map(|[_, base]| base);
        let starts = kept.into_iter().chain([rest]);
        let base = starts.into_iter().find_map(|start| self.sought(seen, start, base_before.as_ref(), step_s))?;
        self.before = Some([seen.pose, base]);
        Some(base)
    }

    /// The base that explains what is `seen`, by Newton's steps from `start`; `None` where they do not settle.
    fn sought(&mut self, seen: &Seen, start: Pose, before: Option<&Pose>, step_s: f64) -> Option<Pose> {
        let mut base = start;
        for _ in 0..MOST_STEPS {
            let missing = self.missing(seen, &base, before, step_s).ok()?;
            let slope = self.slope(seen, &base, before, step_s).ok()?;
            let step = slope.lu().solve(&missing).filter(|step| step.iter().all(|x| x.is_finite()))?;
            base = displaced(&base, &-step);
            if step.amax() < SETTLED {
                return Some(base);
            }
        }
        None
    }

    /// The wrench about the head's centre of mass that its motion asks for and the linkage does not give.
    fn missing(
        &mut self,
        seen: &Seen,
        base: &Pose,
        before: Option<&Pose>,
        step_s: f64,
    ) -> Result<Vector6, DynamicsError> {
        let base = before.map_or_else(|| Kinematics::at_rest(*base), |before| moving(before, base, step_s));
        let gravity_in_world = gravity_in_world();
        let now = Instant {
            base: &base,
            world_from_head: &seen.pose,
            twist: &seen.twist,
            body: self.body,
            hold: 0.0,
            gravity_in_world,
        };
        let Forces { wrench, inertia, .. } = self.sprung.law.forces(&mut self.state, &now)?;
        let mass = self.body.mass_matrix(seen.pose.rotation.to_rotation_matrix().matrix());
        let (_, turning) = split(&seen.twist);
        let gyroscopic = turning.cross(&(mass.fixed_view::<3, 3>(3, 3) * turning));
        let weight = stack(&(gravity_in_world * self.body.mass_kg), &-gyroscopic);
        Ok((mass + inertia) * seen.rate - wrench - weight - self.sprung.law.bend(&now, &seen.twist))
    }

    /// Its derivative by a small shift and turn of the base.
    fn slope(
        &mut self,
        seen: &Seen,
        base: &Pose,
        before: Option<&Pose>,
        step_s: f64,
    ) -> Result<Matrix6, DynamicsError> {
        let mut slope = Matrix6::zeros();
        for axis in 0..6 {
            let mut step = Vector6::zeros();
            step[axis] = DIFFERENCE;
            let ahead = self.missing(seen, &displaced(base, &step), before, step_s)?;
            let behind = self.missing(seen, &displaced(base, &-step), before, step_s)?;
            slope.set_column(axis, &((ahead - behind) / (2.0 * DIFFERENCE)));
        }
        Ok(slope)
    }
}

/// A base on its way from one pose to another.
fn moving(from: &Pose, to: &Pose, step_s: f64) -> Kinematics {
    let turn = (to.rotation * from.rotation.inverse()).scaled_axis();
    Kinematics {
        velocity_in_world: (to.translation.vector - from.translation.vector) / step_s,
        angular_velocity_in_world: turn / step_s,
        ..Kinematics::at_rest(*to)
    }
}

/// A pose shifted and turned about its own origin, in the world's axes.
fn displaced(pose: &Pose, by: &Vector6) -> Pose {
    let (shift, turn): (Vector, Vector) = split(by);
    Pose::from_parts((pose.translation.vector + shift).into(), Rotation::from_scaled_axis(turn) * pose.rotation)
}
