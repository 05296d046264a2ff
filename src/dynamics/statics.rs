//! Where a head rests, and how stiffly.

use super::body::Body;
use super::law::{Law, LawState};
use super::push::{Forces, Instant};
use crate::elasticity::{ElasticityError, Matrix6, Vector6, conditioning, split};
use crate::geometry::{Kinematics, Pose, Rotation, Vector};

/// Iterations after which a head has no rest.
const MOST_ITERATIONS: usize = 80;

/// Step of the central differences, m and rad.
const DIFFERENCE: f64 = 1e-5;

/// Coordinates of a displacement that a joint does not leave free; its two turns take the places of turns about x and
/// y.
const LOCKED: [usize; 4] = [0, 1, 2, 5];

/// Square of the angular frequency below which nothing holds a head, (rad/s)^2: a swing of three minutes.
const LOOSE: f64 = 1e-3;

/// A rest that is farther than these from where the spec puts the head is not the one that is meant.
const FAR_MM: f64 = 200.0;
const FAR_DEG: f64 = 45.0;

/// The head's motions, in order.
const NAMES: [&str; 6] =
    ["shift along x", "shift along y", "shift along z", "turn about x", "turn about y", "turn about z"];

/// A head in its linkage under a steady pull.
#[derive(Clone, Copy)]
pub(super) struct Statics<'a> {
    pub law: &'a Law,
    pub body: &'a Body,
    /// Acceleration of free fall, m/s^2.
    pub gravity_in_base: Vector,
    /// The head's weight, in parts of its own.
    pub weight: f64,
    /// A shift that counts as much as a turn by one radian, m.
    pub scale_m: f64,
}

/// Why a head does not rest.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum Unrest {
    #[error(transparent)]
    Spring(#[from] ElasticityError),
    #[error("it falls over")]
    Falls,
    #[error("it finds no rest near where the spec puts it: it falls, sinks or turns over")]
    Nowhere,
    #[error("it rests only {shift_mm:.0} mm and {turn_deg:.0} degrees from where base_from_head puts it")]
    Elsewhere { shift_mm: f64, turn_deg: f64 },
    #[error("nothing holds it against a {0}")]
    Loose(&'static str),
}

/// The wrench that is left on a head, and what stands against its motion.
pub(super) struct Answer {
    /// By the base's acceleration, Mb, and the mass that moves along with the head.
    pub base_mass: Matrix6,
    pub inertia: Matrix6,
    /// Damping of the elements themselves.
    pub damping: Matrix6,
}

impl Statics<'_> {
    /// The pose `base_from_head` near `start` in which the head rests, and its stiffness there: minus the derivative of
    /// the wrench about its centre of mass, gravity included, by its displacement, in the base's axes. In a joint the
    /// stiffness is against its two turns, in the places of those about x and y, and one elsewhere.
    ///
    /// # Errors
    /// When there is none, or the head would leave it at the slightest push.
    pub fn settle(&self, start: &Pose) -> Result<(Pose, Matrix6), Unrest> {
        let mut state = self.law.state();
        let mut pose = *start;
        for _ in 0..MOST_ITERATIONS {
            let unbalanced = self.effort(&mut state, &pose)?;
            let stiffness = self.stiffness(&mut state, &pose)?;
            let step = stiffness.lu().solve(&unbalanced).ok_or(Unrest::Falls)?;
            let size = self.size(&step);
            if !size.is_finite() {
                return Err(Unrest::Falls);
            }
            // At most a fifth of a radian, or of the spring's length, at a time.
            let share = (0.2 / size).min(1.0);
            pose = self.displaced(&pose, &(step * share));
            if size < 1e-11 {
                let stiffness = self.stiffness(&mut state, &pose)?;
                let stiffness = (stiffness + stiffness.transpose()) * 0.5;
                return if conditioning(&stiffness) > 1e-6 { Ok((pose, stiffness)) } else { Err(Unrest::Falls) };
            }
        }
        Err(Unrest::Falls)
    }

    /// A pose near which the head rests, found by letting it down from `start`: Newton's method downhill, on the
    /// stiffness with its negative and vanishing parts made positive, as cords begin slack.
    ///
    /// # Errors
    /// When it goes down and down, or far away.
    pub fn let_down(&self, start: &Pose) -> Result<Pose, Unrest> {
        let mut state = self.law.state();
        let mut pose = *start;
        let mass = self.body.mass_matrix(start.rotation.to_rotation_matrix().matrix());
        let root = mass.cholesky().map(|c| c.l()).and_then(|l| l.try_inverse()).ok_or(Unrest::Nowhere)?;
        let mut energy_j = self.energy_j(&pose)?;
        for _ in 0..4 * MOST_ITERATIONS {
            let unbalanced = self.effort(&mut state, &pose)?;
            let stiffness = self.stiffness(&mut state, &pose)?;
            let symmetric = (stiffness + stiffness.transpose()) * 0.5;
            let eigen = (root * symmetric * root.transpose()).symmetric_eigen();
            // Whatever is slower than a fifth of a hertz counts as that.
            let gives = eigen.eigenvalues.map(|square| 1.0 / square.abs().max(1.5));
            let along = eigen.eigenvectors.tr_mul(&(root * unbalanced)).component_mul(&gives);
            let mut step = root.tr_mul(&(eigen.eigenvectors * along));
            let size = self.size(&step);
            if !size.is_finite() {
                return Err(Unrest::Nowhere);
            }
            if size < 1e-7 {
                let turn_deg = start.rotation.angle_to(&pose.rotation).to_degrees();
                let centre = nalgebra::Point3::from(self.body.centre_of_mass_in_head);
                let shift_mm = 1e3 * (pose * centre - start * centre).norm();
                let least = eigen.eigenvalues.imin();
                return match eigen.eigenvalues[least] {
                    square if square.abs() < LOOSE => {
                        Err(Unrest::Loose(NAMES[eigen.eigenvectors.column(least).iamax()]))
                    }
                    square if square < 0.0 => Err(Unrest::Falls),
                    _ if turn_deg < FAR_DEG && (shift_mm < FAR_MM || self.law.joint.is_some()) => Ok(pose),
                    _ => Err(Unrest::Elsewhere { shift_mm, turn_deg }),
                };
            }
            step *= (0.2 / size).min(1.0);
            // Downhill in any case: the step is cut until it is.
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
        Err(Unrest::Nowhere)
    }

    fn size(&self, step: &Vector6) -> f64 {
        let (shift, turn) = split(step);
        (shift.norm() / self.scale_m).max(turn.norm())
    }

    /// The pose after a displacement; in a joint, after its two turns.
    pub fn displaced(&self, pose: &Pose, displacement: &Vector6) -> Pose {
        match &self.law.joint {
            None => self.body.displaced(pose, displacement),
            Some(joint) => joint.turned(&Pose::identity(), pose, [displacement[3], displacement[4]]),
        }
    }

    /// The wrench that is left; in a joint, its work on the two turns.
    fn effort(&self, state: &mut LawState, pose: &Pose) -> Result<Vector6, ElasticityError> {
        self.effort_on(state, &Pose::identity(), pose)
    }

    fn effort_on(&self, state: &mut LawState, base: &Pose, pose: &Pose) -> Result<Vector6, ElasticityError> {
        let mut wrench = self.forces(state, &Kinematics::at_rest(*base), pose)?.wrench;
        let mut force = wrench.fixed_rows_mut::<3>(0);
        force += self.gravity_in_base * (self.weight * self.body.mass_kg);
        Ok(match &self.law.joint {
            None => wrench,
            Some(joint) => {
                let [first, second] = joint.directions(base, pose, self.body);
                Vector6::new(0.0, 0.0, 0.0, first.dot(&wrench), second.dot(&wrench), 0.0)
            }
        })
    }

    fn energy_j(&self, pose: &Pose) -> Result<f64, ElasticityError> {
        let centre = pose * nalgebra::Point3::from(self.body.centre_of_mass_in_head);
        let height_j = -self.weight * self.body.mass_kg * self.gravity_in_base.dot(&centre.coords);
        Ok(height_j + self.law.potential_j(&Pose::identity(), pose, &self.gravity_in_base)?)
    }

    /// Minus the derivative of the effort by the head's displacement.
    fn stiffness(&self, state: &mut LawState, pose: &Pose) -> Result<Matrix6, ElasticityError> {
        let mut stiffness = slope(|d| self.effort(state, &self.displaced(pose, d)))?;
        if self.law.joint.is_some() {
            LOCKED.iter().for_each(|k| stiffness[(*k, *k)] = 1.0);
        }
        Ok(stiffness)
    }

    /// The derivative of the wrench about the centre of mass by the displacement of the base about its origin.
    pub fn stiffness_to_base(&self, pose: &Pose) -> Result<Matrix6, ElasticityError> {
        let mut state = self.law.state();
        let slope = slope(|d| Ok(self.forces(&mut state, &Kinematics::at_rest(moved(d)), pose)?.wrench))?;
        Ok(-slope)
    }

    /// The derivative of the effort by the displacement of the base about its origin that takes the head along.
    pub fn effort_by_base(&self, pose: &Pose) -> Result<Matrix6, ElasticityError> {
        let mut state = self.law.state();
        let slope = slope(|d| {
            let base = moved(d);
            self.effort_on(&mut state, &base, &(base * pose))
        })?;
        Ok(-slope)
    }

    /// The masses and the damping with the head at rest in a pose.
    pub fn answer(&self, pose: &Pose) -> Result<Answer, ElasticityError> {
        let mut state = self.law.state();
        let at_rest = self.forces(&mut state, &Kinematics::at_rest(Pose::identity()), pose)?;
        let slope = slope(|d| {
            // A hundred metres per second squared for each unit: a thousandth of one in all.
            let (shift, turn) = split(&(d * 100.0));
            let mut base = Kinematics::at_rest(Pose::identity());
            (base.acceleration_in_world, base.angular_acceleration_in_world) = (shift, turn);
            Ok(self.forces(&mut state, &base, pose)?.wrench / 100.0)
        })?;
        Ok(Answer { base_mass: -slope, inertia: at_rest.inertia, damping: at_rest.damping })
    }

    fn forces(&self, state: &mut LawState, base: &Kinematics, head: &Pose) -> Result<Forces, ElasticityError> {
        let now = Instant {
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

fn moved(displacement: &Vector6) -> Pose {
    let (shift, turn) = split(displacement);
    Pose::from_parts(shift.into(), Rotation::from_scaled_axis(turn))
}

/// Minus the derivative of `wrench` by a displacement, by central differences.
fn slope(mut wrench: impl FnMut(&Vector6) -> Result<Vector6, ElasticityError>) -> Result<Matrix6, ElasticityError> {
    let mut slope = Matrix6::zeros();
    for k in 0..6 {
        let ahead = wrench(&Vector6::ith(k, DIFFERENCE))?;
        let behind = wrench(&Vector6::ith(k, -DIFFERENCE))?;
        slope.set_column(k, &((behind - ahead) / (2.0 * DIFFERENCE)));
    }
    Ok(slope)
}
