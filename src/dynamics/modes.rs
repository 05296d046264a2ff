//! The head linearised about its rest.

use super::spec::DampingSpec;
use crate::elasticity::{Matrix6, Vector6};
use nalgebra::{DMatrix, Dyn, OMatrix, U6};
use std::f64::consts::TAU;

/// What a mode mostly is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ModeKind {
    /// One of the two slowest bending modes, in which the head nods or rolls.
    Rocking,
    /// One of the other two bending modes, in which it shifts sideways against its turn.
    Sway,
    /// Along the spring.
    Bounce,
    /// About the spring.
    Yaw,
}

/// A mode of the head about its rest, the base held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mode {
    /// What it mostly is.
    pub kind: ModeKind,
    /// Frequency without damping, Hz.
    pub frequency_hz: f64,
    /// Damping ratio: what damping takes of this mode by itself, over the critical. Where elements have damping of
    /// their own it also couples modes, which frequency response and simulation have and this number has not.
    pub damping_ratio: f64,
    /// Displacement of the centre of mass and turn of the head, in the base's axes, scaled to a modal mass of 1: m and
    /// rad over the square root of kg m^2.
    pub shape: Vector6,
}

impl Mode {
    /// Frequency of the free, damped oscillation, Hz; zero for one that creeps back.
    pub fn damped_frequency_hz(&self) -> f64 {
        self.frequency_hz * (1.0 - self.damping_ratio * self.damping_ratio).max(0.0).sqrt()
    }

    /// Rate at which its free motion dies away, 1/s: of one that creeps back, the slower of its two.
    pub fn decay_per_s(&self) -> f64 {
        let ratio = self.damping_ratio;
        TAU * self.frequency_hz * if ratio > 1.0 { ratio - (ratio * ratio - 1.0).sqrt() } else { ratio }
    }
}

/// `M x'' + C x' + K x = Mb b'' + Cb b' + Kb b` for small motions about rest: x the head's displacement and b the
/// base's.
///
/// x is the displacement of the head's centre of mass and its turn, b that of the base's origin and its turn, both as
/// seen in the world, in the axes of the upright base. In a joint x keeps to what the base's motion and the modes'
/// shapes make of it, and K, Kb say what the linkage does along the shapes alone.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearModel {
    /// M, with the mass of spring and fluid that moves along: kg, kg m^2.
    pub mass: Matrix6,
    /// C, of the modes' ratios and of the elements themselves: N s/m, N m s/rad.
    pub damping: Matrix6,
    /// K, gravity included: N/m, N m/rad.
    pub stiffness: Matrix6,
    /// Mb: nothing where neither spring nor fluid has mass.
    pub base_mass: Matrix6,
    /// Cb.
    pub base_damping: Matrix6,
    /// Kb.
    pub base_stiffness: Matrix6,
    /// The displacement of a head that is stuck to its base, by the base's.
    pub carried: Matrix6,
    /// The modes, slowest first: six, or two in a joint.
    pub modes: Vec<Mode>,
}

/// What is left free of a head, and how it is held there: columns of displacements, and the stiffness in them.
pub(super) struct Freedom {
    pub directions: OMatrix<f64, U6, Dyn>,
    pub stiffness: DMatrix<f64>,
}

impl Freedom {
    /// All six motions.
    pub fn of_all(stiffness: &Matrix6) -> Self {
        let stiffness = DMatrix::from_column_slice(6, 6, stiffness.as_slice());
        Self { directions: OMatrix::identity_generic(U6, Dyn(6)), stiffness }
    }

    /// The two turns in a joint, whose stiffness is in the places of turns about x and y.
    pub fn of_turns(turns: &[Vector6; 2], stiffness: &Matrix6) -> Self {
        let stiffness = DMatrix::from_fn(2, 2, |i, j| stiffness[(3 + i, 3 + j)]);
        Self { directions: OMatrix::<f64, U6, Dyn>::from_columns(turns), stiffness }
    }
}

/// Frequency and shape of a mode that nobody has named yet.
struct Bare {
    square: f64,
    shape: Vector6,
}

/// The modes of a mass on a positive-definite stiffness, slowest first.
///
/// `rate` is the rate of the seat's coordinates by the head's twist (see `Deformation`); it tells stretch and twist
/// from bending. In a joint there are neither. `None` when the mass is not positive definite.
pub(super) fn modes(mass: &Matrix6, free: &Freedom, rate: &Matrix6, damping: &DampingSpec) -> Option<Vec<Mode>> {
    let bare = bare_modes(mass, free)?;
    let (bounce, yaw) = if bare.len() < 6 { (None, None) } else { stretch_and_twist(mass, &bare, rate)? };
    let mut bending = 0;
    let named = bare.iter().enumerate().map(|(k, Bare { square, shape })| {
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

fn bare_modes(mass: &Matrix6, free: &Freedom) -> Option<Vec<Bare>> {
    // With M = L L^T: eigenvectors v of L^-1 K L^-T are L^T times the shapes.
    let reduced = free.directions.tr_mul(&(mass * &free.directions));
    let root = reduced.cholesky()?.l();
    let inverse = root.try_inverse()?;
    let eigen = (&inverse * &free.stiffness * inverse.transpose()).symmetric_eigen();
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let bare = order.iter().map(|k| Bare {
        square: eigen.eigenvalues[*k],
        shape: &free.directions * inverse.tr_mul(&eigen.eigenvectors.column(*k)),
    });
    Some(bare.collect())
}

/// Which of six modes stretches the linkage most, and which of the others twists it.
fn stretch_and_twist(mass: &Matrix6, bare: &[Bare], rate: &Matrix6) -> Option<(Option<usize>, Option<usize>)> {
    let unrate = rate.try_inverse()?;
    let in_coordinates = unrate.tr_mul(&(modal_sum(mass, bare.iter().map(|b| (b.shape, b.square))) * unrate));
    // The share of a mode's energy that stretches (2) or twists (5) the linkage.
    let share = |mode: usize, coordinate: usize| {
        let moved = (rate * bare[mode].shape)[coordinate];
        in_coordinates[(coordinate, coordinate)] * moved * moved / bare[mode].square
    };
    let most = |coordinate: usize, but: Option<usize>| {
        let others = (0..bare.len()).filter(|k| Some(*k) != but);
        others.max_by(|a, b| share(*a, coordinate).total_cmp(&share(*b, coordinate)))
    };
    let bounce = most(2, None);
    Some((bounce, most(5, bounce)))
}

/// `M Phi diag(x) Phi^T M`: the matrix that has the shapes Phi for eigenvectors, and their numbers x.
pub(super) fn modal_sum(mass: &Matrix6, modes: impl Iterator<Item = (Vector6, f64)>) -> Matrix6 {
    modes.fold(Matrix6::zeros(), |sum, (shape, number)| {
        let momentum = mass * shape;
        sum + momentum * momentum.transpose() * number
    })
}

/// The damping that gives each mode its ratio: `M Phi diag(2 zeta omega) Phi^T M`, Phi the shapes.
pub(super) fn modal_damping(mass: &Matrix6, modes: &[Mode]) -> Matrix6 {
    modal_sum(mass, modes.iter().map(|mode| (mode.shape, 2.0 * mode.damping_ratio * TAU * mode.frequency_hz)))
}
