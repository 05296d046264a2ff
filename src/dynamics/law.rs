//! What acts on a head in its linkage: the elements' pushes, damping, hand, end stop. Not gravity.

use super::body::Body;
use super::cord::Cord;
use super::float::Float;
use super::joint::UniversalJoint;
use super::mounted::MountedSpring;
use super::push::{Between, Ends, Forces, Instant};
use crate::elasticity::{ElasticityError, Matrix6, SpringState, Vector6, split, stack};
use crate::geometry::{Kinematics, Pose, Vector};

/// The force law of a linkage: the sum of its elements' pushes, and what is said of the linkage as a whole.
///
/// Damping and the hand work in the [`Deformation`](crate::elasticity::Deformation) coordinates e between two frames,
/// the *seat*: a force `C e_dot`, taken to the head by the transposed rate of e. A motion of head and base as one body
/// changes no e, so it meets no damping, and power lost is `e_dot . C e_dot`, never negative.
#[derive(Debug, Clone)]
pub(super) struct Law {
    pub springs: Vec<MountedSpring>,
    pub cords: Vec<Cord>,
    pub floats: Vec<Float>,
    /// Leaves the head two turns and nothing else.
    pub joint: Option<UniversalJoint>,
    /// The frames of a single spring's ends; of several elements, two in the centre of mass that agree at rest.
    pub seat: Ends,
    /// In the seat's coordinates.
    pub damping: Matrix6,
    pub hold: Option<Hold>,
    pub end_stop: Option<EndStop>,
}

/// A hand that pulls the head back to `rest`; all in the seat's coordinates.
#[derive(Debug, Clone)]
pub(super) struct Hold {
    /// Frequency of the head in a firm hand alone.
    pub frequency_hz: f64,
    pub stiffness: Matrix6,
    pub damping: Matrix6,
    pub rest: Vector6,
}

/// A stop, elastic and damped, for the angle between the z axes of the seat's two frames.
#[derive(Debug, Clone, Copy)]
pub(super) struct EndStop {
    pub angle_rad: f64,
    pub stiffness_nm_per_rad: f64,
    pub damping_nm_s_per_rad: f64,
}

/// Where the springs' inner nodes last were.
#[derive(Debug, Clone)]
pub(super) struct LawState(Vec<SpringState>);

impl Law {
    /// Inner nodes that nobody has looked at yet.
    pub fn state(&self) -> LawState {
        LawState(self.springs.iter().map(|mounted| mounted.spring.state()).collect())
    }

    /// Forces at an instant; of a joint those of its torsion springs, not those that hold it together.
    ///
    /// # Errors
    /// When a segmented spring finds no equilibrium.
    pub fn forces(&self, state: &mut LawState, now: &Instant<'_>) -> Result<Forces, ElasticityError> {
        let mut forces = Forces::none();
        for (mounted, state) in self.springs.iter().zip(&mut state.0) {
            mounted.push(state, now, &mut forces)?;
        }
        self.cords.iter().for_each(|cord| cord.push(now, &mut forces));
        self.floats.iter().for_each(|float| float.push(now, &mut forces));
        if let Some(joint) = &self.joint {
            joint.push(now, &mut forces);
        }
        let between = self.seat.at(now);
        self.resist(&between, now, &mut forces);
        if let Some(stop) = &self.end_stop {
            let from = between.axes.column(2).into_owned();
            let to = now.world_from_head.rotation * self.seat.head_from_top.rotation * Vector::z();
            let (_, turning) = split(now.twist);
            stop.press(&from, &to, &(turning - now.base.angular_velocity_in_world), &mut forces);
        }
        forces.turn_rad = forces.turn_rad.max(between.turn_rad());
        Ok(forces)
    }

    /// Adds the modes' damping and the hand.
    fn resist(&self, between: &Between, now: &Instant<'_>, forces: &mut Forces) {
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

    /// Forces of the masses that move along, quadratic in the head's twist.
    pub fn bend(&self, now: &Instant<'_>, twist: &Vector6) -> Vector6 {
        let of_springs = self.springs.iter().map(|mounted| mounted.bend(now, twist)).sum::<Vector6>();
        of_springs + self.floats.iter().map(|float| float.bend(now, twist)).sum::<Vector6>()
    }

    /// Energy in all that gives, J.
    ///
    /// # Errors
    /// When a segmented spring finds no equilibrium.
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
        let lean = Vector::z().angle(&(self.seat.foot_from_top(base_from_head).rotation * Vector::z()));
        let in_stop = self.end_stop.map_or(0.0, |stop| {
            let beyond = (lean - stop.angle_rad).max(0.0);
            0.5 * stop.stiffness_nm_per_rad * beyond * beyond
        });
        Ok(energy_j + in_stop)
    }

    /// The seat's coordinates and their rate by the head's twist about its centre of mass, in the base's axes, at a
    /// pose.
    pub fn rate_matrix(&self, base_from_head: &Pose, body: &Body) -> (Vector6, Matrix6) {
        let now = Instant {
            base: &Kinematics::at_rest(Pose::identity()),
            world_from_head: base_from_head,
            twist: &Vector6::zeros(),
            body,
            hold: 0.0,
            gravity_in_world: Vector::zeros(),
        };
        let between = self.seat.at(&now);
        (between.deformation.coordinates, between.rate_by_twist())
    }
}

impl EndStop {
    /// Adds the stop's torque and damping where the axis `to` leans too far from `from`; `turning` is the relative
    /// angular velocity.
    fn press(&self, from: &Vector, to: &Vector, turning: &Vector, forces: &mut Forces) {
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
