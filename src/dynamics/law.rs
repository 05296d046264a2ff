//! What acts on a sprung head: spring, damping, hand, end stop. Not gravity.

use super::body::Body;
use crate::elasticity::{Deformation, ElasticityError, Matrix6, Spring, SpringState, Vector6, blocks, split, stack};
use crate::geometry::{Kinematics, Matrix, Pose, Vector, skew};

/// The force law of a linkage with a spring.
///
/// Everything but the end stop works in the spring's [`Deformation`] coordinates e: their gradient of potential plus
/// `C e_dot`, taken to the head by the transposed rate of e. A motion of head and base as one body changes no e, so it meets
/// neither force nor damping, and power lost is `e_dot . C e_dot`, never negative.
#[derive(Debug, Clone)]
pub(super) struct Law {
    pub spring: Spring,
    pub base_from_spring: Pose,
    pub head_from_top: Pose,
    /// From the head's centre of mass to the spring's top.
    pub lever_in_head: Vector,
    /// In the deformation's coordinates.
    pub damping: Matrix6,
    pub hold: Option<Hold>,
    pub end_stop: Option<EndStop>,
}

/// A hand that pulls the head back to `rest`; all in the deformation's coordinates.
#[derive(Debug, Clone)]
pub(super) struct Hold {
    /// Frequency of the head in a firm hand alone.
    pub frequency_hz: f64,
    pub stiffness: Matrix6,
    pub damping: Matrix6,
    pub rest: Vector6,
}

/// A stop, elastic and damped, for the angle between the axes of the spring's foot and top.
#[derive(Debug, Clone, Copy)]
pub(super) struct EndStop {
    pub angle_rad: f64,
    pub stiffness_nm_per_rad: f64,
    pub damping_nm_s_per_rad: f64,
}

/// Where head and base are at an instant, and how fast.
pub(super) struct Instant<'a> {
    pub base: &'a Kinematics,
    pub world_from_head: &'a Pose,
    /// Velocity of the head's centre of mass, and angular velocity, in the world.
    pub twist: &'a Vector6,
    /// How firmly the hand holds, 0 to 1.
    pub hold: f64,
}

/// What acts on the head, about its centre of mass, in the world.
pub(super) struct Forces {
    /// Force and torque at the instant's velocities.
    pub wrench: Vector6,
    /// Minus the derivative of the wrench by the head's twist: symmetric, never negative.
    pub damping: Matrix6,
    /// How far the top has turned from the foot, rad.
    pub turn_rad: f64,
}

impl Law {
    /// A spring alone, without damping.
    pub fn undamped(spring: Spring, base_from_spring: Pose, head_from_top: Pose, body: &Body) -> Self {
        let lever_in_head = head_from_top.translation.vector - body.centre_of_mass_in_head;
        let damping = Matrix6::zeros();
        Self { spring, base_from_spring, head_from_top, lever_in_head, damping, hold: None, end_stop: None }
    }

    /// Forces at an instant.
    ///
    /// # Errors
    /// When a segmented spring finds no equilibrium.
    pub fn forces(&self, state: &mut SpringState, now: &Instant<'_>) -> Result<Forces, ElasticityError> {
        let world_from_spring = now.base.world_from_body * self.base_from_spring;
        let world_from_top = now.world_from_head * self.head_from_top;
        let spring_from_top = world_from_spring.inv_mul(&world_from_top);
        let deformation = Deformation::of(&spring_from_top);
        let axes = world_from_spring.rotation.to_rotation_matrix().into_inner();
        let lever = now.world_from_head.rotation * self.lever_in_head;

        let rate = deformation.rate(&self.relative_twist(now, &world_from_top, &lever, &axes));
        let (resist, damping) = self.resistance(&deformation.coordinates, &rate, now.hold);
        let on_top = self.spring.wrench(state, &spring_from_top, &deformation)? - deformation.wrench(&resist);
        let (force, torque) = split(&on_top);
        let force = axes * force;
        let mut wrench = stack(&force, &(axes * torque + lever.cross(&force)));

        let by_twist = rate_by_twist(&deformation, &axes, &lever);
        let mut damping = by_twist.tr_mul(&(damping * by_twist));
        if let Some(stop) = &self.end_stop {
            let from = axes.column(2).into_owned();
            let to = world_from_top.rotation * Vector::z();
            let (_, turning) = split(now.twist);
            stop.press(&from, &to, &(turning - now.base.angular_velocity_in_world), &mut wrench, &mut damping);
        }
        let (_, turn) = split(&deformation.coordinates);
        Ok(Forces { wrench, damping, turn_rad: turn.norm() })
    }

    /// The twist of the spring's top as seen from its foot, in the foot's axes.
    fn relative_twist(&self, now: &Instant<'_>, world_from_top: &Pose, lever: &Vector, axes: &Matrix) -> Vector6 {
        let (velocity, turning) = split(now.twist);
        let base = now.base;
        let arm = world_from_top.translation.vector - base.world_from_body.translation.vector;
        let top = velocity + turning.cross(lever);
        let carried = base.velocity_in_world + base.angular_velocity_in_world.cross(&arm);
        stack(&axes.tr_mul(&(top - carried)), &axes.tr_mul(&(turning - base.angular_velocity_in_world)))
    }

    /// Damping and the hand, as a force in the coordinates, and the damping matrix there.
    fn resistance(&self, coordinates: &Vector6, rate: &Vector6, firmness: f64) -> (Vector6, Matrix6) {
        match &self.hold {
            Some(hand) if firmness > 0.0 => {
                let damping = self.damping + hand.damping * firmness;
                (damping * rate + hand.stiffness * (coordinates - hand.rest) * firmness, damping)
            }
            _ => (self.damping * rate, self.damping),
        }
    }

    /// Energy in spring and end stop, J.
    ///
    /// # Errors
    /// When a segmented spring finds no equilibrium.
    pub fn potential_j(&self, base_from_head: &Pose) -> Result<f64, ElasticityError> {
        let spring_from_top = self.base_from_spring.inv_mul(&(base_from_head * self.head_from_top));
        let in_spring = self.spring.potential_j(&mut self.spring.state(), &spring_from_top)?;
        let lean = Vector::z().angle(&(spring_from_top.rotation * Vector::z()));
        let in_stop = self.end_stop.map_or(0.0, |stop| {
            let beyond = (lean - stop.angle_rad).max(0.0);
            0.5 * stop.stiffness_nm_per_rad * beyond * beyond
        });
        Ok(in_spring + in_stop)
    }

    /// The rate of the coordinates by the head's twist about its centre of mass, in the base's axes, at a pose.
    pub fn rate_matrix(&self, base_from_head: &Pose) -> (Vector6, Matrix6) {
        let deformation = Deformation::of(&self.base_from_spring.inv_mul(&(base_from_head * self.head_from_top)));
        let axes = self.base_from_spring.rotation.to_rotation_matrix().into_inner();
        let lever = base_from_head.rotation * self.lever_in_head;
        (deformation.coordinates, rate_by_twist(&deformation, &axes, &lever))
    }
}

/// The rate of the coordinates by the head's twist about its centre of mass, which is written in axes to which `axes` turns
/// the spring's; `lever` leads from the centre of mass to the top.
fn rate_by_twist(deformation: &Deformation, axes: &Matrix, lever: &Vector) -> Matrix6 {
    let by_velocity = deformation.straight * axes.transpose();
    let by_turning = deformation.mixed * axes.transpose() - by_velocity * skew(lever);
    blocks(&by_velocity, &by_turning, &Matrix::zeros(), &by_velocity)
}

impl EndStop {
    /// Adds the stop's torque and damping where the axis `to` leans too far from `from`; `turning` is the relative angular
    /// velocity.
    fn press(&self, from: &Vector, to: &Vector, turning: &Vector, wrench: &mut Vector6, damping: &mut Matrix6) {
        let across = from.cross(to);
        let sine = across.norm();
        let beyond = sine.atan2(from.dot(to)) - self.angle_rad;
        if beyond <= 0.0 || sine == 0.0 {
            return;
        }
        let axis = across / sine;
        let torque = -(self.stiffness_nm_per_rad * beyond + self.damping_nm_s_per_rad * axis.dot(turning));
        let mut torques = wrench.fixed_rows_mut::<3>(3);
        torques += axis * torque;
        let mut block = damping.fixed_view_mut::<3, 3>(3, 3);
        block += axis * axis.transpose() * self.damping_nm_s_per_rad;
    }
}
