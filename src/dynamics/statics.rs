//! Where a head rests, and how stiffly.

use super::body::Body;
use super::law::{Instant, Law};
use crate::elasticity::{ElasticityError, Matrix6, SpringState, Vector6, conditioning, split};
use crate::geometry::{Kinematics, Pose, Rotation, Vector};

/// Iterations after which a head has no rest.
const MOST_ITERATIONS: usize = 80;

/// Step of the central differences, m and rad.
const DIFFERENCE: f64 = 1e-5;

/// A head on its spring under a steady pull.
pub(super) struct Statics<'a> {
    pub law: &'a Law,
    pub body: &'a Body,
    /// Acceleration of free fall, m/s^2.
    pub gravity_in_base: Vector,
}

/// Why a head does not rest.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum Unrest {
    #[error(transparent)]
    Spring(#[from] ElasticityError),
    #[error("it falls over")]
    Falls,
}

impl Statics<'_> {
    /// The pose `base_from_head` near `start` in which the head rests, and its stiffness there: minus the derivative of the
    /// wrench about its centre of mass, gravity included, by its displacement, in the base's axes.
    ///
    /// # Errors
    /// When there is none, or the head would leave it at the slightest push.
    pub fn settle(&self, start: &Pose) -> Result<(Pose, Matrix6), Unrest> {
        let mut state = self.law.spring.state();
        let mut pose = *start;
        let scale_m = self.law.spring.length_m();
        for _ in 0..MOST_ITERATIONS {
            let unbalanced = self.wrench(&mut state, &pose)?;
            let stiffness = self.stiffness(&mut state, &pose)?;
            let step = stiffness.lu().solve(&unbalanced).ok_or(Unrest::Falls)?;
            let (shift, turn) = split(&step);
            let size = (shift.norm() / scale_m).max(turn.norm());
            if !size.is_finite() {
                return Err(Unrest::Falls);
            }
            // At most a fifth of a radian, or of the spring's length, at a time.
            let share = (0.2 / size).min(1.0);
            pose = displaced(&pose, self.body, &(step * share));
            if size < 1e-11 {
                let stiffness = self.stiffness(&mut state, &pose)?;
                let stiffness = (stiffness + stiffness.transpose()) * 0.5;
                return if conditioning(&stiffness) > 1e-6 { Ok((pose, stiffness)) } else { Err(Unrest::Falls) };
            }
        }
        Err(Unrest::Falls)
    }

    /// Minus the derivative of the wrench about the centre of mass by the head's displacement.
    fn stiffness(&self, state: &mut SpringState, pose: &Pose) -> Result<Matrix6, ElasticityError> {
        self.law.slope(|law, d| {
            let moved = displaced(pose, self.body, d);
            Statics { law, ..*self }.wrench(state, &moved)
        })
    }

    /// The derivative of the wrench about the centre of mass by the displacement of the base about its origin.
    pub fn stiffness_to_base(&self, pose: &Pose) -> Result<Matrix6, ElasticityError> {
        let mut state = self.law.spring.state();
        let slope = self.law.slope(|law, d| {
            let (shift, turn) = split(d);
            let base = Pose::from_parts(shift.into(), Rotation::from_scaled_axis(turn));
            spring_wrench(law, &mut state, &base, pose)
        })?;
        Ok(-slope)
    }

    /// Force and torque about the centre of mass, gravity included.
    fn wrench(&self, state: &mut SpringState, pose: &Pose) -> Result<Vector6, ElasticityError> {
        let mut wrench = spring_wrench(self.law, state, &Pose::identity(), pose)?;
        let mut force = wrench.fixed_rows_mut::<3>(0);
        force += self.gravity_in_base * self.body.mass_kg;
        Ok(wrench)
    }
}

impl Law {
    /// Minus the derivative of `wrench` by a displacement, by central differences.
    fn slope(
        &self,
        mut wrench: impl FnMut(&Law, &Vector6) -> Result<Vector6, ElasticityError>,
    ) -> Result<Matrix6, ElasticityError> {
        let mut slope = Matrix6::zeros();
        for k in 0..6 {
            let ahead = wrench(self, &Vector6::ith(k, DIFFERENCE))?;
            let behind = wrench(self, &Vector6::ith(k, -DIFFERENCE))?;
            slope.set_column(k, &((behind - ahead) / (2.0 * DIFFERENCE)));
        }
        Ok(slope)
    }
}

fn spring_wrench(law: &Law, state: &mut SpringState, base: &Pose, head: &Pose) -> Result<Vector6, ElasticityError> {
    let now = Instant { base: &Kinematics::at_rest(*base), world_from_head: head, twist: &Vector6::zeros(), hold: 0.0 };
    law.forces(state, &now).map(|forces| forces.wrench)
}

/// A head's pose after a displacement of its centre of mass and a turn about it.
fn displaced(pose: &Pose, body: &Body, displacement: &Vector6) -> Pose {
    let (shift, turn) = split(displacement);
    let turn = Rotation::from_scaled_axis(turn);
    let centre = pose.rotation * body.centre_of_mass_in_head + pose.translation.vector;
    let origin = centre + shift - turn * (pose.rotation * body.centre_of_mass_in_head);
    Pose::from_parts(origin.into(), turn * pose.rotation)
}
