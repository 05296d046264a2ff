//! The head linearised about its rest.

use super::spec::DampingSpec;
use crate::elasticity::{Matrix6, Vector6};
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
    /// Damping ratio.
    pub damping_ratio: f64,
    /// Displacement of the centre of mass and turn of the head, in the base's axes, scaled to a modal mass of 1: m and rad
    /// over the square root of kg m^2.
    pub shape: Vector6,
}

impl Mode {
    /// Frequency of the free, damped oscillation, Hz; zero for one that creeps back.
    pub fn damped_frequency_hz(&self) -> f64 {
        self.frequency_hz * (1.0 - self.damping_ratio * self.damping_ratio).max(0.0).sqrt()
    }
}

/// `M x'' + C x' + K x = Cb b' + Kb b` for small motions about rest: x the head's displacement and b the base's.
///
/// x is the displacement of the head's centre of mass and its turn, b that of the base's origin and its turn, both as seen
/// in the world, in the axes of the upright base.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearModel {
    /// M: kg, kg m^2.
    pub mass: Matrix6,
    /// C: N s/m, N m s/rad.
    pub damping: Matrix6,
    /// K, gravity included: N/m, N m/rad.
    pub stiffness: Matrix6,
    /// Cb.
    pub base_damping: Matrix6,
    /// Kb.
    pub base_stiffness: Matrix6,
    /// The modes, slowest first.
    pub modes: [Mode; 6],
}

/// The six modes of a mass on a positive-definite stiffness, slowest first.
///
/// `rate` is the deformation's rate by the head's twist (see `Deformation`); it tells stretch and twist from bending.
/// `None` when the mass is not positive definite.
pub(super) fn modes(mass: &Matrix6, stiffness: &Matrix6, rate: &Matrix6, damping: &DampingSpec) -> Option<[Mode; 6]> {
    // With M = L L^T: eigenvectors v of L^-1 K L^-T are L^T times the shapes.
    let root = mass.cholesky()?.l();
    let inverse = root.try_inverse()?;
    let eigen = (inverse * stiffness * inverse.transpose()).symmetric_eigen();
    let mut order = [0, 1, 2, 3, 4, 5];
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let unrate = rate.try_inverse()?;
    let in_coordinates = unrate.tr_mul(&(stiffness * unrate));
    let shapes = order.map(|k| inverse.tr_mul(&eigen.eigenvectors.column(k)));
    let squares = order.map(|k| eigen.eigenvalues[k]);
    // The share of a mode's energy that stretches (2) or twists (5) the spring.
    let share = |mode: usize, coordinate: usize| {
        let moved = (rate * shapes[mode])[coordinate];
        in_coordinates[(coordinate, coordinate)] * moved * moved / squares[mode]
    };
    let most = |coordinate: usize, but: Option<usize>| {
        (0..6).filter(|k| Some(*k) != but).max_by(|a, b| share(*a, coordinate).total_cmp(&share(*b, coordinate)))
    };
    let bounce = most(2, None)?;
    let yaw = most(5, Some(bounce))?;
    let mut bending = 0;
    Some(std::array::from_fn(|k| {
        let (kind, damping_ratio) = if k == bounce {
            (ModeKind::Bounce, damping.bounce)
        } else if k == yaw {
            (ModeKind::Yaw, damping.yaw)
        } else {
            bending += 1;
            if bending <= 2 { (ModeKind::Rocking, damping.rocking) } else { (ModeKind::Sway, damping.sway) }
        };
        Mode { kind, frequency_hz: squares[k].sqrt() / TAU, damping_ratio, shape: shapes[k] }
    }))
}

/// The damping that gives each mode its ratio: `M Phi diag(2 zeta omega) Phi^T M`, Phi the shapes.
pub(super) fn modal_damping(mass: &Matrix6, modes: &[Mode; 6]) -> Matrix6 {
    modes.iter().fold(Matrix6::zeros(), |sum, mode| {
        let momentum = mass * mode.shape;
        sum + momentum * momentum.transpose() * (2.0 * mode.damping_ratio * TAU * mode.frequency_hz)
    })
}
