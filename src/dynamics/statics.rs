//! Static equilibrium of a head and the stiffness there.

use super::body::Body;
use super::force_law::{ForceLaw, ForceLawState};
use super::forces::{Forces, MotionState};
use zsim_base::geometry::{Kinematics, Pose, Rotation, Vector};
use zsim_elasticity::{ElasticityError, Matrix6, Vector6, conditioning, split};

/// Maximum Newton iterations for the equilibrium.
const MAX_ITERATIONS: usize = 80;

/// Step of the central differences, m and rad.
const DIFFERENCE: f64 = 1e-5;

/// Indices of displacements that a joint constrains; the two joint rotations use the indices of rotations about x and
/// y.
const CONSTRAINED: [usize; 4] = [0, 1, 2, 5];

/// Squared angular frequency below which a motion counts as unconstrained, (rad/s)^2: a period of about 3 min.
const MIN_SQUARED_FREQUENCY: f64 = 1e-3;

/// Largest displacement (mm) and rotation (degrees) of the equilibrium from the pose in the spec; beyond them, it is
/// another equilibrium than the intended one.
const MAX_SHIFT_MM: f64 = 200.0;
const MAX_TURN_DEG: f64 = 45.0;

/// Names of the six motions, for messages.
const MOTION_NAMES: [&str; 6] =
    ["shift along x", "shift along y", "shift along z", "turn about x", "turn about y", "turn about z"];

/// A head on a linkage under static gravity.
#[derive(Clone, Copy)]
pub(super) struct Statics<'a> {
    pub law: &'a ForceLaw,
    pub body: &'a Body,
    /// Gravitational acceleration, m/s^2.
    pub gravity_in_base: Vector,
    /// Factor on the real weight of the head.
    pub weight: f64,
    /// Displacement that counts as a rotation by 1 rad, m.
    pub scale_m: f64,
}

/// Reasons why there is no stable equilibrium.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum NoEquilibrium {
    #[error(transparent)]
    Spring(#[from] ElasticityError),
    #[error("it falls over")]
    Unstable,
    #[error("there is no equilibrium near base_from_head: the head falls, sinks or turns over")]
    NotFound,
    #[error(
        "the equilibrium is {shift_mm:.0} mm and {turn_deg:.0} degrees away from base_from_head, where the search ends"
    )]
    TooFar { shift_mm: f64, turn_deg: f64 },
    #[error("no spring, rope, joint or buoyancy resists a {0}")]
    Unconstrained(&'static str),
}

/// Linear coefficients of the wrench on the head by accelerations and velocities.
pub(super) struct LinearCoefficients {
    /// Mass matrix of the base's acceleration (Mb).
    pub base_mass: Matrix6,
    pub inertia: Matrix6,
    /// Damping of the elements, without modal damping.
    pub damping: Matrix6,
}

impl Statics<'_> {
    /// Finds the equilibrium pose `base_from_head` near `start`, and the stiffness there.
    ///
    /// The stiffness is minus the derivative of the wrench about the centre of mass, gravity included, by the
    /// displacement of the head, in the axes of the base. With a joint it is the stiffness of the two joint rotations,
    /// at the indices of rotations about x and y, and the identity elsewhere.
    ///
    /// # Errors
    /// When there is no equilibrium or it is unstable.
    pub fn find_equilibrium(&self, start: &Pose) -> Result<(Pose, Matrix6), NoEquilibrium> {
        let mut state = self.law.state();
        let mut pose = *start;
        for _ in 0..MAX_ITERATIONS {
            let unbalanced = self.unbalanced_wrench(&mut state, &pose)?;
            let stiffness = self.stiffness(&mut state, &pose)?;
            let step = stiffness.lu().solve(&unbalanced).ok_or(NoEquilibrium::Unstable)?;
            let size = self.size(&step);
            if !size.is_finite() {
                return Err(NoEquilibrium::Unstable);
            }
            // Limit the step to 0.2 rad or 0.2 of the spring's length.
            let factor = (0.2 / size).min(1.0);
            pose = self.displaced(&pose, &(step * factor));
            if size < 1e-11 {
                let stiffness = self.stiffness(&mut state, &pose)?;
                let stiffness = (stiffness + stiffness.transpose()) * 0.5;
                return if conditioning(&stiffness) > 1e-6 {
                    Ok((pose, stiffness))
                } else {
                    Err(NoEquilibrium::Unstable)
                };
            }
        }
        Err(NoEquilibrium::Unstable)
    }

    /// Finds a pose near the equilibrium by minimising the energy from `start`.
    ///
    /// Newton's method with step halving; negative and vanishing eigenvalues of the stiffness are replaced by positive
    /// ones, since cords may be slack at the start.
    ///
    /// # Errors
    /// When the energy has no minimum or it is far from `start`.
    pub fn minimise_energy(&self, start: &Pose) -> Result<Pose, NoEquilibrium> {
        let mut state = self.law.state();
        let mut pose = *start;
        let mass = self.body.mass_matrix(start.rotation.to_rotation_matrix().matrix());
        let root = mass.cholesky().map(|c| c.l()).and_then(|l| l.try_inverse()).ok_or(NoEquilibrium::NotFound)?;
        let mut energy_j = self.energy_j(&pose)?;
        for _ in 0..4 * MAX_ITERATIONS {
            let unbalanced = self.unbalanced_wrench(&mut state, &pose)?;
            let stiffness = self.stiffness(&mut state, &pose)?;
            let symmetric = (stiffness + stiffness.transpose()) * 0.5;
            let eigen = (root * symmetric * root.transpose()).symmetric_eigen();
            // Lower bound of the squared angular frequency, (rad/s)^2: 0.2 Hz.
            let compliance = eigen.eigenvalues.map(|square| 1.0 / square.abs().max(1.5));
            let along = eigen.eigenvectors.tr_mul(&(root * unbalanced)).component_mul(&compliance);
            let mut step = root.tr_mul(&(eigen.eigenvectors * along));
            let size = self.size(&step);
            if !size.is_finite() {
                return Err(NoEquilibrium::NotFound);
            }
            if size < 1e-7 {
                let turn_deg = start.rotation.angle_to(&pose.rotation).to_degrees();
                let centre = nalgebra::Point3::from(self.body.centre_of_mass_in_head);
                let shift_mm = 1e3 * (pose * centre - start * centre).norm();
                let least = eigen.eigenvalues.imin();
                return match eigen.eigenvalues[least] {
                    square if square.abs() < MIN_SQUARED_FREQUENCY => {
                        Err(NoEquilibrium::Unconstrained(MOTION_NAMES[eigen.eigenvectors.column(least).iamax()]))
                    }
                    square if square < 0.0 => Err(NoEquilibrium::Unstable),
                    _ if turn_deg < MAX_TURN_DEG && (shift_mm < MAX_SHIFT_MM || self.law.joint.is_some()) => Ok(pose),
                    _ => Err(NoEquilibrium::TooFar { shift_mm, turn_deg }),
                };
            }
            step *= (0.2 / size).min(1.0);
            // Halve the step until the energy decreases.
            for _ in 0..30 {
                let next = self.displaced(&pose, &step);
                let below_j = self.energy_j(&next)?;
                if below_j <= energy_j {
                    (pose, energy_j) = (next, below_j);
                    break;
                }
                step *= 0.5;
            }
        }
        Err(NoEquilibrium::NotFound)
    }

    fn size(&self, step: &Vector6) -> f64 {
        let (shift, turn) = split(step);
        (shift.norm() / self.scale_m).max(turn.norm())
    }

    /// The pose after a displacement; with a joint, after the two joint rotations.
    pub fn displaced(&self, pose: &Pose, displacement: &Vector6) -> Pose {
        match &self.law.joint {
            None => self.body.displaced(pose, displacement),
            Some(joint) => joint.rotated(&Pose::identity(), pose, [displacement[3], displacement[4]]),
        }
    }

    /// The unbalanced wrench; with a joint, the torques about the two joint axes.
    fn unbalanced_wrench(&self, state: &mut ForceLawState, pose: &Pose) -> Result<Vector6, ElasticityError> {
        self.unbalanced_wrench_on_base(state, &Pose::identity(), pose)
    }

    fn unbalanced_wrench_on_base(
        &self,
        state: &mut ForceLawState,
        base: &Pose,
        pose: &Pose,
    ) -> Result<Vector6, ElasticityError> {
        let mut wrench = self.forces(state, &Kinematics::at_rest(*base), pose)?.wrench;
        let mut force = wrench.fixed_rows_mut::<3>(0);
        force += self.gravity_in_base * (self.weight * self.body.mass_kg);
        Ok(match &self.law.joint {
            None => wrench,
            Some(joint) => {
                let [first, second] = joint.free_motions(base, pose, self.body);
                Vector6::new(0.0, 0.0, 0.0, first.dot(&wrench), second.dot(&wrench), 0.0)
            }
        })
    }

    fn energy_j(&self, pose: &Pose) -> Result<f64, ElasticityError> {
        let centre = pose * nalgebra::Point3::from(self.body.centre_of_mass_in_head);
        let height_j = -self.weight * self.body.mass_kg * self.gravity_in_base.dot(&centre.coords);
        Ok(height_j + self.law.potential_j(&Pose::identity(), pose, &self.gravity_in_base)?)
    }

    /// Minus the derivative of the unbalanced wrench by the head's displacement.
    fn stiffness(&self, state: &mut ForceLawState, pose: &Pose) -> Result<Matrix6, ElasticityError> {
        let mut stiffness = negative_derivative(|d| self.unbalanced_wrench(state, &self.displaced(pose, d)))?;
        if self.law.joint.is_some() {
            CONSTRAINED.iter().for_each(|k| stiffness[(*k, *k)] = 1.0);
        }
        Ok(stiffness)
    }

    /// The derivative of the wrench about the centre of mass by the displacement of the base about the base's origin.
    pub fn stiffness_to_base(&self, pose: &Pose) -> Result<Matrix6, ElasticityError> {
        let mut state = self.law.state();
        let slope = negative_derivative(|d| {
            Ok(self.forces(&mut state, &Kinematics::at_rest(displaced_base(d)), pose)?.wrench)
        })?;
        Ok(-slope)
    }

    /// The derivative of the unbalanced wrench by a displacement of the base that moves the head rigidly.
    pub fn unbalanced_wrench_by_base(&self, pose: &Pose) -> Result<Matrix6, ElasticityError> {
        let mut state = self.law.state();
        let slope = negative_derivative(|d| {
            let base = displaced_base(d);
            self.unbalanced_wrench_on_base(&mut state, &base, &(base * pose))
        })?;
        Ok(-slope)
    }

    /// The mass and damping matrices with the head at rest at a pose.
    pub fn linear_coefficients(&self, pose: &Pose) -> Result<LinearCoefficients, ElasticityError> {
        let mut state = self.law.state();
        let at_rest = self.forces(&mut state, &Kinematics::at_rest(Pose::identity()), pose)?;
        let slope = negative_derivative(|d| {
            // Finite difference with base accelerations of 1e-3 m/s^2 and rad/s^2.
            let (shift, turn) = split(&(d * 100.0));
            let mut base = Kinematics::at_rest(Pose::identity());
            (base.acceleration_in_world, base.angular_acceleration_in_world) = (shift, turn);
            Ok(self.forces(&mut state, &base, pose)?.wrench / 100.0)
        })?;
        Ok(LinearCoefficients { base_mass: -slope, inertia: at_rest.inertia, damping: at_rest.damping })
    }

    fn forces(&self, state: &mut ForceLawState, base: &Kinematics, head: &Pose) -> Result<Forces, ElasticityError> {
        let now = MotionState {
            base,
            world_from_head: head,
            twist: &Vector6::zeros(),
            body: self.body,
            hold: 0.0,
            gravity_in_world: self.gravity_in_base,
        };
        self.law.forces(state, &now)
    }
}

fn displaced_base(displacement: &Vector6) -> Pose {
    let (shift, turn) = split(displacement);
    Pose::from_parts(shift.into(), Rotation::from_scaled_axis(turn))
}

/// Minus the derivative of `wrench` by a displacement, by central differences.
fn negative_derivative(
    mut wrench: impl FnMut(&Vector6) -> Result<Vector6, ElasticityError>,
) -> Result<Matrix6, ElasticityError> {
    let mut slope = Matrix6::zeros();
    for k in 0..6 {
        let plus = wrench(&Vector6::ith(k, DIFFERENCE))?;
        let minus = wrench(&Vector6::ith(k, -DIFFERENCE))?;
        slope.set_column(k, &((minus - plus) / (2.0 * DIFFERENCE)));
    }
    Ok(slope)
}
