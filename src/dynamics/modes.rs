//! The head linearised about the equilibrium: matrices and modes.

use super::spec::DampingSpec;
use nalgebra::{DMatrix, Dyn, OMatrix, U6};
use std::f64::consts::TAU;
use zsim_elasticity::{Matrix6, Vector6};

/// The dominant motion of a mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ModeKind {
    /// One of the two slowest bending modes: the head pitches or rolls.
    Rocking,
    /// One of the other two bending modes: the head shifts sideways and rotates against the shift.
    Sway,
    /// Translation along the spring.
    Bounce,
    /// Rotation about the spring.
    Yaw,
}

impl ModeKind {
    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            ModeKind::Rocking => "rocking",
            ModeKind::Sway => "sway",
            ModeKind::Bounce => "bounce",
            ModeKind::Yaw => "yaw",
        }
    }
}

/// An undamped mode of the head about the equilibrium, with the base fixed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mode {
    /// The dominant motion.
    pub kind: ModeKind,
    /// Undamped natural frequency, Hz.
    pub frequency_hz: f64,
    /// Damping ratio: diagonal term of the modal damping matrix over critical damping. Dampers of the elements also
    /// couple modes; frequency response and simulation include that coupling, this number does not.
    pub damping_ratio: f64,
    /// Mode shape: displacement of the centre of mass and rotation of the head, in the axes of the base, scaled to unit
    /// modal mass; m and rad over the square root of kg m^2.
    pub shape: Vector6,
}

impl Mode {
    /// Damped natural frequency, Hz; zero for an overdamped mode.
    pub fn damped_frequency_hz(&self) -> f64 {
        self.frequency_hz * (1.0 - self.damping_ratio * self.damping_ratio).max(0.0).sqrt()
    }

    /// Decay rate of the free motion, 1/s; the slower one of an overdamped mode.
    pub fn decay_per_s(&self) -> f64 {
        let ratio = self.damping_ratio;
        TAU * self.frequency_hz * if ratio > 1.0 { ratio - (ratio * ratio - 1.0).sqrt() } else { ratio }
    }
}

/// The linear model `M x'' + C x' + K x = Mb b'' + Cb b' + Kb b` about the equilibrium.
///
/// x is the displacement of the head's centre of mass and the rotation of the head, b the displacement of the base's
/// origin and the rotation of the base; both are relative to the world, in the axes of the upright base. With a joint,
/// x is restricted to the rigid motion with the base plus the mode shapes, and K and Kb hold only for those motions.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearModel {
    /// M, including wire and added fluid mass: kg, kg m^2.
    pub mass: Matrix6,
    /// C, modal damping plus dampers of the elements: N s/m, N m s/rad.
    pub damping: Matrix6,
    /// K, gravity included: N/m, N m/rad.
    pub stiffness: Matrix6,
    /// Mb: zero if neither wire nor fluid has mass.
    pub base_mass: Matrix6,
    /// Cb.
    pub base_damping: Matrix6,
    /// Kb.
    pub base_stiffness: Matrix6,
    /// The displacement of the head by that of the base, for head and base as one rigid body.
    pub rigid_motion: Matrix6,
    /// The modes, lowest frequency first: six, or two with a joint.
    pub modes: Vec<Mode>,
}

/// The free motions of a head (columns: displacement and rotation) and the stiffness in them.
pub(super) struct FreeMotions {
    pub directions: OMatrix<f64, U6, Dyn>,
    pub stiffness: DMatrix<f64>,
}

impl FreeMotions {
    /// All six motions are free.
    pub fn all(stiffness: &Matrix6) -> Self {
        let stiffness = DMatrix::from_column_slice(6, 6, stiffness.as_slice());
        Self { directions: OMatrix::identity_generic(U6, Dyn(6)), stiffness }
    }

    /// The two rotations in a joint, whose stiffness is at the indices of rotations about x and y.
    pub fn of_joint(turns: &[Vector6; 2], stiffness: &Matrix6) -> Self {
        let stiffness = DMatrix::from_fn(2, 2, |i, j| stiffness[(3 + i, 3 + j)]);
        Self { directions: OMatrix::<f64, U6, Dyn>::from_columns(turns), stiffness }
    }
}

/// Squared angular frequency and shape of a mode, before classification.
struct UnclassifiedMode {
    square: f64,
    shape: Vector6,
}

/// The modes of a mass with a positive-definite stiffness, lowest frequency first.
///
/// `rate` is the Jacobian of the reference coordinates by the head's twist (see `Deformation`). It separates bounce and
/// yaw from bending; a joint has neither. `None` if the mass matrix is not positive definite.
pub(super) fn modes(mass: &Matrix6, free: &FreeMotions, rate: &Matrix6, damping: &DampingSpec) -> Option<Vec<Mode>> {
    let unclassified = unclassified_modes(mass, free)?;
    let (bounce, yaw) =
        if unclassified.len() < 6 { (None, None) } else { bounce_and_yaw_modes(mass, &unclassified, rate)? };
    let mut bending = 0;
    let named = unclassified.iter().enumerate().map(|(k, UnclassifiedMode { square, shape })| {
        let (kind, damping_ratio) = if Some(k) == bounce {
            (ModeKind::Bounce, damping.bounce)
        } else if Some(k) == yaw {
            (ModeKind::Yaw, damping.yaw)
        } else {
            bending += 1;
            if bending <= 2 { (ModeKind::Rocking, damping.rocking) } else { (ModeKind::Sway, damping.sway) }
        };
        Mode { kind, frequency_hz: square.sqrt() / TAU, damping_ratio, shape: *shape }
    });
    Some(named.collect())
}

fn unclassified_modes(mass: &Matrix6, free: &FreeMotions) -> Option<Vec<UnclassifiedMode>> {
    // With M = L L^T, the eigenvectors of L^-1 K L^-T are L^T times the mode shapes.
    let reduced = free.directions.tr_mul(&(mass * &free.directions));
    let root = reduced.cholesky()?.l();
    let inverse = root.try_inverse()?;
    let eigen = (&inverse * &free.stiffness * inverse.transpose()).symmetric_eigen();
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let unclassified = order.iter().map(|k| UnclassifiedMode {
        square: eigen.eigenvalues[*k],
        shape: &free.directions * inverse.tr_mul(&eigen.eigenvectors.column(*k)),
    });
    Some(unclassified.collect())
}

/// Natural frequencies of a mass with a stiffness, Hz, lowest first.
///
/// `None` if the mass matrix is not positive definite, or the stiffness is negative for a motion.
pub fn natural_frequencies_hz(mass: &Matrix6, stiffness: &Matrix6) -> Option<Vec<f64>> {
    let modes = unclassified_modes(mass, &FreeMotions::all(stiffness))?;
    modes.iter().map(|mode| (mode.square >= 0.0).then(|| mode.square.sqrt() / TAU)).collect()
}

/// The indices of the modes with the largest bounce and the largest yaw content.
fn bounce_and_yaw_modes(
    mass: &Matrix6,
    unclassified: &[UnclassifiedMode],
    rate: &Matrix6,
) -> Option<(Option<usize>, Option<usize>)> {
    let inverse_rate = rate.try_inverse()?;
    let in_coordinates =
        inverse_rate.tr_mul(&(modal_sum(mass, unclassified.iter().map(|b| (b.shape, b.square))) * inverse_rate));
    // Fraction of the mode's strain energy in axial stretch (2) or twist (5) of the linkage.
    let share = |mode: usize, coordinate: usize| {
        let moved = (rate * unclassified[mode].shape)[coordinate];
        in_coordinates[(coordinate, coordinate)] * moved * moved / unclassified[mode].square
    };
    let largest_in = |coordinate: usize, but: Option<usize>| {
        let others = (0..unclassified.len()).filter(|k| Some(*k) != but);
        others.max_by(|a, b| share(*a, coordinate).total_cmp(&share(*b, coordinate)))
    };
    let bounce = largest_in(2, None);
    Some((bounce, largest_in(5, bounce)))
}

/// The matrix `M Phi diag(x) Phi^T M` with mode shapes Phi and one number x for each mode.
pub(super) fn modal_sum(mass: &Matrix6, modes: impl Iterator<Item = (Vector6, f64)>) -> Matrix6 {
    modes.fold(Matrix6::zeros(), |sum, (shape, number)| {
        let momentum = mass * shape;
        sum + momentum * momentum.transpose() * number
    })
}

/// The modal damping matrix `M Phi diag(2 zeta omega) Phi^T M` with mode shapes Phi.
pub(super) fn modal_damping(mass: &Matrix6, modes: &[Mode]) -> Matrix6 {
    modal_sum(mass, modes.iter().map(|mode| (mode.shape, 2.0 * mode.damping_ratio * TAU * mode.frequency_hz)))
}
