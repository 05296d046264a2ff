//! Priors of the window: the start state and the border.

use crate::layout::{BORDER, LIDAR_ROTATION, Layout};
use crate::normal_equations::NormalEquations;
use crate::spline::Basis;
use nalgebra::{Matrix6, SMatrix, SVector};
use zsim_base::geometry::Vector;

/// Prior on the correction at the start of the window, which makes it continuous with the previous window.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Start {
    /// Start of the window, trajectory time, s.
    pub(crate) u_s: f64,
    /// Standard deviations of rotation and translation (rad, m), of their first (1/s) and second derivative (1/s^2).
    pub(crate) sigmas: [[f64; 2]; 3],
    /// Dependence on the lidar extrinsics, if they are estimated.
    pub(crate) by_lidar: Option<ByLidar>,
}

/// Derivative of the start state by the lidar extrinsics.
///
/// Change of the correction (rows: rotation, translation), and of the first and second derivative of it, if the
/// previous window had assumed the lidar rotated and translated on the IMU (columns).
///
/// The lidar measures the motion of the lidar, and constrains the IMU pose only through the extrinsics. So the start
/// pose of the IMU is as uncertain as the extrinsics. A prior without this dependence would freeze the extrinsics at
/// the initial value: each window would add the same information a second time.
pub(crate) type ByLidar = [Matrix6<f64>; 3];

impl Start {
    /// The continuation of the previous window.
    ///
    /// Pose and velocity are continuous. The acceleration is continuous only approximately, because an update of a bias
    /// estimate changes it immediately.
    pub(crate) fn continuing(u_s: f64) -> Self {
        Self { u_s, sigmas: [[1e-5, 1e-5], [1e-4, 1e-4], [1e-2, 0.3]], by_lidar: None }
    }

    /// The first window: the pose is the map origin by definition, the velocity has the sigma `velocity_sigma`, m/s.
    pub(crate) fn first(u_s: f64, velocity_sigma: f64) -> Self {
        Self { u_s, sigmas: [[1e-5, 1e-5], [0.1, velocity_sigma], [10.0, 10.0]], by_lidar: None }
    }

    /// Adds the prior; `total` is the sum of the corrections of this window so far, `moved` that of the border.
    pub(crate) fn add_to(
        &self,
        equations: &mut NormalEquations,
        layout: &Layout,
        total: &[f64],
        moved: &SVector<f64, BORDER>,
        knot_spacing_s: f64,
    ) {
        self.add_orders([1.0; 3], equations, layout, (total, moved), knot_spacing_s);
    }

    /// Removes the part of the prior that [`Self::add_to`] added for the first and second derivatives.
    pub(crate) fn remove_velocity(
        &self,
        equations: &mut NormalEquations,
        layout: &Layout,
        total: &[f64],
        moved: &SVector<f64, BORDER>,
        knot_spacing_s: f64,
    ) {
        self.add_orders([0.0, -1.0, -1.0], equations, layout, (total, moved), knot_spacing_s);
    }

    /// Adds the prior of each order of derivative times a factor, with the corrections as in [`Self::add_to`].
    fn add_orders(
        &self,
        factors: [f64; 3],
        equations: &mut NormalEquations,
        layout: &Layout,
        (total, moved): (&[f64], &SVector<f64, BORDER>),
        knot_spacing_s: f64,
    ) {
        let basis = Basis::at(self.u_s, knot_spacing_s);
        let first = layout.knot(basis.first);
        for (order, by) in [basis.value, basis.rate, basis.acceleration].iter().enumerate() {
            for axis in 0..6 {
                let weight = factors[order] * self.sigmas[order][axis / 3].powi(-2);
                let column = |a: usize| first + 6 * a + axis;
                let by_lidar = self.by_lidar.map(|by_lidar| -by_lidar[order].row(axis));
                let target = by_lidar.map_or(0.0, |by_lidar| (by_lidar * moved.fixed_rows::<6>(LIDAR_ROTATION))[0]);
                let residual = (0..4).map(|a| by[a] * total[column(a)]).sum::<f64>() + target;
                for a in 0..4 {
                    equations.add_right(column(a), -weight * by[a] * residual);
                    for c in 0..=a {
                        equations.add_entry(column(a), column(c), weight * by[a] * by[c]);
                    }
                }
                for (k, by_unknown) in by_lidar.iter().flat_map(|by| by.iter().enumerate()) {
                    let row = layout.border() + LIDAR_ROTATION + k;
                    equations.add_right(row, -weight * by_unknown * residual);
                    (0..4).for_each(|a| equations.add_entry(row, column(a), weight * by_unknown * by[a]));
                    for (other, by_other) in by_lidar.iter().flat_map(|by| by.iter().enumerate()).take(k + 1) {
                        equations.add_entry(
                            row,
                            layout.border() + LIDAR_ROTATION + other,
                            weight * by_unknown * by_other,
                        );
                    }
                }
            }
        }
    }
}

impl Start {
    /// The right-hand side for these corrections, rotation then translation, and their rates at the start.
    pub(crate) fn right_hand_side(
        &self,
        layout: &Layout,
        value: &[f64; 6],
        rate: &[f64; 6],
        knot_spacing_s: f64,
    ) -> Vec<f64> {
        let basis = Basis::at(self.u_s, knot_spacing_s);
        let first = layout.knot(basis.first);
        let mut right = vec![0.0; layout.size()];
        for (order, (by, target)) in [(basis.value, value), (basis.rate, rate)].into_iter().enumerate() {
            for axis in 0..6 {
                let weight = self.sigmas[order][axis / 3].powi(-2);
                for a in 0..4 {
                    right[first + 6 * a + axis] += weight * by[a] * target[axis];
                }
                for (k, by_lidar) in (0..6).filter_map(|k| Some((k, self.by_lidar?[order][(axis, k)]))) {
                    right[layout.border() + LIDAR_ROTATION + k] -= weight * by_lidar * target[axis];
                }
            }
        }
        right
    }
}

/// Adds a zero-velocity measurement at a node: `v + dt' = 0`, to `sigma` (m/s).
pub(crate) fn add_zero_velocity(
    equations: &mut NormalEquations,
    layout: &Layout,
    basis: &Basis,
    velocity: &Vector,
    sigma: f64,
) {
    add_zero_derivative(equations, layout, 3, basis, velocity, sigma);
}

/// Adds a zero-rate measurement at a node with rate `rate` (rad/s, in the map): `w + dr' = 0`, to `sigma`.
pub(crate) fn add_zero_rotation_rate(
    equations: &mut NormalEquations,
    layout: &Layout,
    basis: &Basis,
    rate: &Vector,
    sigma: f64,
) {
    add_zero_derivative(equations, layout, 0, basis, rate, sigma);
}

/// Adds a measurement that `rate` plus the derivative of the correction is zero, from axis `of` of the correction on.
fn add_zero_derivative(
    equations: &mut NormalEquations,
    layout: &Layout,
    of: usize,
    basis: &Basis,
    rate: &Vector,
    sigma: f64,
) {
    let first = layout.knot(basis.first);
    let weight = sigma.powi(-2);
    for axis in 0..3 {
        let column = |a: usize| first + 6 * a + of + axis;
        for a in 0..4 {
            equations.add_right(column(a), -weight * basis.rate[a] * rate[axis]);
            for c in 0..=a {
                equations.add_entry(column(a), column(c), weight * basis.rate[a] * basis.rate[c]);
            }
        }
    }
}

/// Adds the prior of the border: `information`, with the current values `from_mean` away from the mean.
pub(crate) fn add_border(
    equations: &mut NormalEquations,
    layout: &Layout,
    information: &SMatrix<f64, BORDER, BORDER>,
    from_mean: &SVector<f64, BORDER>,
) {
    let right = information * from_mean;
    for row in 0..BORDER {
        equations.add_right(layout.border() + row, -right[row]);
        for column in 0..=row {
            equations.add_entry(layout.border() + row, layout.border() + column, information[(row, column)]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn without_the_velocity_the_start_holds_only_the_pose() {
        const SPACING_S: f64 = 0.2;
        let layout = Layout { first_knot: 2, knots: 6 };
        let total: Vec<f64> = (0..layout.border()).map(|k| 0.01 * (k as f64).sin()).collect();
        let moved = SVector::<f64, BORDER>::zeros();
        let start = Start { u_s: 0.53, sigmas: [[0.1, 0.2], [0.3, 0.5], [0.7, 0.9]], by_lidar: None };
        let mut without = NormalEquations::new(layout.size());
        start.add_to(&mut without, &layout, &total, &moved, SPACING_S);
        start.remove_velocity(&mut without, &layout, &total, &moved, SPACING_S);
        let free = Start { sigmas: [start.sigmas[0], [1e9; 2], [1e9; 2]], ..start };
        let mut expected = NormalEquations::new(layout.size());
        free.add_to(&mut expected, &layout, &total, &moved, SPACING_S);
        assert_relative_eq!(without.dense(), expected.dense(), epsilon = 1e-9);
        assert_relative_eq!(without.right(), expected.right(), epsilon = 1e-9);
    }

    /// Against the definition: residuals of the correction minus the effect of the extrinsics, differentiated
    /// numerically.
    #[test]
    fn a_start_prior_that_depends_on_the_lidar_follows_the_extrinsics() {
        const SPACING_S: f64 = 0.2;
        let layout = Layout { first_knot: 2, knots: 6 };
        let by_lidar: ByLidar =
            std::array::from_fn(|order| Matrix6::from_fn(|r, c| 0.3 * ((7 * order + 3 * r + r * c) as f64).sin()));
        let sigmas = [[0.1, 0.2], [0.3, 0.5], [0.7, 0.9]];
        let start = Start { u_s: 0.53, sigmas, by_lidar: Some(by_lidar) };
        let wave = |size: usize| DVector::from_fn(size, |k, _| 0.01 * (1.3 * k as f64).cos());
        let total = wave(layout.border());
        let moved = SVector::<f64, BORDER>::from_fn(|k, _| 0.02 * (k as f64).sin());
        let basis = Basis::at(start.u_s, SPACING_S);
        let whitened = |x: &DVector<f64>| {
            let mut all = Vec::new();
            for (order, by) in [basis.value, basis.rate, basis.acceleration].iter().enumerate() {
                let lidar = moved.fixed_rows::<6>(LIDAR_ROTATION) + x.rows(layout.border() + LIDAR_ROTATION, 6);
                let target = by_lidar[order] * lidar;
                for axis in 0..6 {
                    let knot = |a: usize| layout.knot(basis.first) + 6 * a + axis;
                    let value: f64 = (0..4).map(|a| by[a] * (total[knot(a)] + x[knot(a)])).sum();
                    all.push((value - target[axis]) / sigmas[order][axis / 3]);
                }
            }
            DVector::from_vec(all)
        };
        let zero = DVector::zeros(layout.size());
        let residual = whitened(&zero);
        let mut jacobian = DMatrix::zeros(residual.len(), layout.size());
        for unknown in 0..layout.size() {
            let mut step = zero.clone();
            step[unknown] = 1.0; // the residual is linear
            jacobian.set_column(unknown, &(whitened(&step) - &residual));
        }
        let mut equations = NormalEquations::new(layout.size());
        start.add_to(&mut equations, &layout, total.as_slice(), &moved, SPACING_S);
        let square = jacobian.transpose() * &jacobian;
        assert_relative_eq!(equations.dense(), square, epsilon = 1e-9 * square.amax());
        let right = jacobian.transpose() * -residual;
        assert_relative_eq!(equations.right(), right, epsilon = 1e-9 * right.amax());
        // The right-hand side for a shifted start.
        let (value, rate) = ([0.1, -0.2, 0.3, 0.5, -0.4, 0.2], [0.3, 0.1, -0.2, 0.6, 0.2, -0.1]);
        let whitened = |k: usize, axis: usize| match k {
            0 => value[axis] / sigmas[0][axis / 3],
            1 => rate[axis] / sigmas[1][axis / 3],
            _ => 0.0,
        };
        let target = jacobian.transpose() * DVector::from_fn(18, |k, _| whitened(k / 6, k % 6));
        let right = DVector::from_vec(start.right_hand_side(&layout, &value, &rate, SPACING_S));
        assert_relative_eq!(right, target, epsilon = 1e-9 * target.amax());
    }
}
