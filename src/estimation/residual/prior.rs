//! What is known before the window's own measurements: where it begins, and the border.

use super::{BORDER, Layout};
use crate::estimation::normal_equations::NormalEquations;
use crate::estimation::spline::Basis;
use crate::geometry::Vector;
use nalgebra::{SMatrix, SVector};

/// How firmly the correction is held to zero where the window begins, so that it goes on from the one before.
#[derive(Debug, Clone, Copy)]
pub(in crate::estimation) struct Start {
    /// Where the window begins, IMU time, s.
    pub(in crate::estimation) u_s: f64,
    /// Standard deviations of rotation and translation (rad, m), of their first (1/s) and second derivative (1/s^2).
    pub(in crate::estimation) sigmas: [[f64; 2]; 3],
}

impl Start {
    /// A beginning from which the window goes on smoothly: pose and velocity are those of the window before, and nearly the
    /// acceleration, which a bias that has become better known changes at once.
    pub(in crate::estimation) fn held(u_s: f64) -> Self {
        Self { u_s, sigmas: [[1e-5, 1e-5], [1e-4, 1e-4], [1e-2, 0.3]] }
    }

    /// The very beginning: the pose is the map's origin by definition, the velocity known to `velocity_sigma` (m/s).
    pub(in crate::estimation) fn first(u_s: f64, velocity_sigma: f64) -> Self {
        Self { u_s, sigmas: [[1e-5, 1e-5], [0.1, velocity_sigma], [10.0, 10.0]] }
    }

    /// Adds the conditions, `total` being the coefficients of the corrections made in this window so far.
    pub(in crate::estimation) fn add_to(
        &self,
        equations: &mut NormalEquations,
        layout: &Layout,
        total: &[f64],
        knot_spacing_s: f64,
    ) {
        let basis = Basis::at(self.u_s, knot_spacing_s);
        let first = layout.knot(basis.first);
        for (by, sigmas) in [basis.value, basis.rate, basis.acceleration].iter().zip(self.sigmas) {
            for axis in 0..6 {
                let weight = sigmas[axis / 3].powi(-2);
                let column = |a: usize| first + 6 * a + axis;
                let residual: f64 = (0..4).map(|a| by[a] * total[column(a)]).sum();
                for a in 0..4 {
                    equations.add_right(column(a), -weight * by[a] * residual);
                    for c in 0..=a {
                        equations.add_entry(column(a), column(c), weight * by[a] * by[c]);
                    }
                }
            }
        }
    }
}

impl Start {
    /// The right-hand side that asks for these corrections, turn then shift, and their first derivatives where the window
    /// begins.
    pub(in crate::estimation) fn right_hand_side(
        &self,
        layout: &Layout,
        (value, rate): (&[f64; 6], &[f64; 6]),
        knot_spacing_s: f64,
    ) -> Vec<f64> {
        let basis = Basis::at(self.u_s, knot_spacing_s);
        let first = layout.knot(basis.first);
        let mut right = vec![0.0; layout.size()];
        for (by, asked, sigmas) in [(basis.value, value, self.sigmas[0]), (basis.rate, rate, self.sigmas[1])] {
            for axis in 0..6 {
                let weight = sigmas[axis / 3].powi(-2);
                for a in 0..4 {
                    right[first + 6 * a + axis] += weight * by[a] * asked[axis];
                }
            }
        }
        right
    }
}

/// Adds that the velocity is zero at a node: `v + dt' = 0`, to `sigma` (m/s).
pub(in crate::estimation) fn add_standstill(
    equations: &mut NormalEquations,
    layout: &Layout,
    basis: &Basis,
    velocity: &Vector,
    sigma: f64,
) {
    let first = layout.knot(basis.first);
    let weight = sigma.powi(-2);
    for axis in 0..3 {
        let column = |a: usize| first + 6 * a + 3 + axis;
        for a in 0..4 {
            equations.add_right(column(a), -weight * basis.rate[a] * velocity[axis]);
            for c in 0..=a {
                equations.add_entry(column(a), column(c), weight * basis.rate[a] * basis.rate[c]);
            }
        }
    }
}

/// Adds what is known of the border: `information`, about the values from which it has moved by `moved` in this window.
pub(in crate::estimation) fn add_border(
    equations: &mut NormalEquations,
    layout: &Layout,
    information: &SMatrix<f64, BORDER, BORDER>,
    moved: &SVector<f64, BORDER>,
) {
    let right = information * moved;
    for row in 0..BORDER {
        equations.add_right(layout.border() + row, -right[row]);
        for column in 0..=row {
            equations.add_entry(layout.border() + row, layout.border() + column, information[(row, column)]);
        }
    }
}
