//! A spring whose top is guided: it neither tilts nor moves sideways, and is free to turn about the axis.

use super::deformation::split;
use super::{ElasticityError, Matrix6, Spring, SpringState, Vector6};
use nalgebra::{Matrix2, Vector2};
use zsim_base::geometry::{Pose, Rotation, Vector};

/// Maximum Newton iterations.
const MAX_ITERATIONS: usize = 50;
/// Steps from the top of the leaning helix to the guided top: inner nodes follow from step to step.
const GUIDING_STEPS: u32 = 8;
/// Step of the central differences, m and rad.
const DIFFERENCE: f64 = 1e-6;

/// The guided top of a loaded spring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GuidedTop {
    /// The top relative to the base.
    pub base_from_top: Pose,
    /// Derivative of the force (N) and torque (N m) on the top by its displacement (m) and rotation (rad), about the top, in the axes
    /// of the base: order x, y, z, rx, ry, rz. Symmetric except for the turning of the reaction of the guide.
    pub stiffness: Matrix6,
}

impl Spring {
    /// The guided top under `load_n`, compression positive.
    ///
    /// # Errors
    /// When the spring finds no equilibrium under the load.
    pub fn guided(&self, load_n: f64) -> Result<GuidedTop, ElasticityError> {
        let mut state = self.state();
        let mut top = self.base_from_top_at_rest();
        for left in (0..GUIDING_STEPS).rev() {
            top = less_leaned(&top, f64::from(left) / f64::from(left + 1));
            self.wrench(&mut state, &top)?;
        }
        for _ in 0..MAX_ITERATIONS {
            let stiffness = self.tangent(&mut state, &top)?;
            let wrench = self.wrench(&mut state, &top)?.total();
            let free = Matrix2::new(stiffness.m33, stiffness.m36, stiffness.m63, stiffness.m66);
            let unbalanced = Vector2::new(wrench[2] - load_n, wrench[5]);
            let step = free.lu().solve(&unbalanced).ok_or(ElasticityError::NotAHelix { load_n })?;
            top = moved(&top, &Vector6::new(0.0, 0.0, step[0], 0.0, 0.0, step[1]));
            if step[0].abs() < 1e-10 * self.length_m() && step[1].abs() < 1e-10 {
                return Ok(GuidedTop { base_from_top: top, stiffness: self.tangent(&mut state, &top)? });
            }
        }
        Err(ElasticityError::NotAHelix { load_n })
    }

    /// Minus the derivative of the wrench on the top by its displacement.
    fn tangent(&self, state: &mut SpringState, top: &Pose) -> Result<Matrix6, ElasticityError> {
        let mut tangent = Matrix6::zeros();
        for k in 0..6 {
            let d = Vector6::ith(k, DIFFERENCE);
            let change = self.wrench(state, &moved(top, &-d))?.total() - self.wrench(state, &moved(top, &d))?.total();
            tangent.set_column(k, &(change / (2.0 * DIFFERENCE)));
        }
        Ok(tangent)
    }
}

/// A top with `factor` times the tilt and the sideways shift.
fn less_leaned(top: &Pose, factor: f64) -> Pose {
    let (shift, turn) = (top.translation.vector, top.rotation.scaled_axis());
    let less = |v: Vector| Vector::new(v.x * factor, v.y * factor, v.z);
    Pose::from_parts(less(shift).into(), Rotation::from_scaled_axis(less(turn)))
}

fn moved(top: &Pose, by: &Vector6) -> Pose {
    let (shift, turn) = split(by);
    Pose::from_parts((top.translation.vector + shift).into(), Rotation::from_scaled_axis(turn) * top.rotation)
}
