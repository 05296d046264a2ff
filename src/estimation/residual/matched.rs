//! How far two matched surfels are apart along the normal of the surface that both belong to.
//!
//! `e = n^T (mu_i - mu_j)`, with `n, lambda` the least eigenpair of `S_i + S_j`, weighted by
//! `zeta^2 = 1 / (sigma_r^2 + lambda)`. A live surfel's centre moves by `dt + dr x arm + v dl`; one of a fixed view does not.

use super::{CLOCK, CLOCK_RATE, Layout};
use crate::estimation::nominal::Correction;
use crate::estimation::normal_equations::{NormalEquations, Segment};
use crate::estimation::surfel::{Patch, Placed};
use crate::geometry::{Matrix, Vector};

/// Two surfels of one surface.
#[derive(Debug, Clone, Copy)]
pub(in crate::estimation) struct Plane {
    /// Unit normal of the surface.
    pub(in crate::estimation) normal: Vector,
    /// Distance along it, m.
    pub(in crate::estimation) distance_m: f64,
    /// Variance of that distance, m^2.
    pub(in crate::estimation) variance: f64,
}

impl Plane {
    /// The plane common to two patches, `sigma_m` being what a match may be off beside their thickness.
    pub(in crate::estimation) fn of(a: &Patch, b: &Patch, sigma_m: f64) -> Self {
        let both = a.covariance + b.covariance;
        // One step of inverse iteration from the mean normal: the adjugate is the inverse but for a factor, and exists
        // for a perfectly thin patch as well.
        let start = a.normal + b.normal;
        let normal = adjugate(&both) * start;
        let normal = normal.try_normalize(0.0).or_else(|| start.try_normalize(0.0)).unwrap_or(a.normal);
        let lambda = normal.dot(&(both * normal));
        let distance_m = normal.dot(&(a.centre - b.centre));
        Self { normal, distance_m, variance: sigma_m * sigma_m + lambda.max(0.0) }
    }
}

fn adjugate(m: &Matrix) -> Matrix {
    let (a, b, c) = (m.column(0), m.column(1), m.column(2));
    Matrix::from_rows(&[b.cross(&c).transpose(), c.cross(&a).transpose(), a.cross(&b).transpose()])
}

/// The derivative of `e` by the knots about a live surfel, as a row of 24.
pub(in crate::estimation) fn by_knots(surfel: &Placed, normal: &Vector, sign: f64) -> [f64; 24] {
    let turn = surfel.arm.cross(normal) * sign;
    let shift = normal * sign;
    let mut row = [0.0; 24];
    for (knot, value) in row.chunks_exact_mut(6).zip(surfel.basis.value) {
        let entries = [turn.x, turn.y, turn.z, shift.x, shift.y, shift.z];
        for (entry, derivative) in knot.iter_mut().zip(entries) {
            *entry = value * derivative;
        }
    }
    row
}

/// The derivative of `e` by clock offset and clock rate.
pub(in crate::estimation) fn by_clock(surfel: &Placed, normal: &Vector, sign: f64, clock_at_s: f64) -> [f64; 2] {
    let by_offset = sign * normal.dot(&surfel.velocity);
    [by_offset, by_offset * (surfel.tau_s - clock_at_s)]
}

/// How far a solution `x` moves a live surfel along `normal`, m.
pub(in crate::estimation) fn moved_m(
    surfel: &Placed,
    normal: &Vector,
    layout: &Layout,
    x: &[f64],
    clock_at_s: f64,
) -> f64 {
    let correction = Correction::of_spline(&surfel.basis, layout.first_knot, x);
    let clock = &x[layout.border() + CLOCK..=layout.border() + CLOCK_RATE];
    let by = by_clock(surfel, normal, 1.0, clock_at_s);
    normal.dot(&(correction.translation + correction.rotation.cross(&surfel.arm))) + by[0] * clock[0] + by[1] * clock[1]
}

/// Adds a match between two live surfels.
pub(in crate::estimation) fn add_pair(
    equations: &mut NormalEquations,
    layout: &Layout,
    (a, b): (&Placed, &Placed),
    plane: &Plane,
    (weight, clock_at_s): (f64, f64),
) {
    let (a, b, sign) = if a.basis.first <= b.basis.first { (a, b, 1.0) } else { (b, a, -1.0) };
    let (row_a, row_b) = (by_knots(a, &plane.normal, sign), by_knots(b, &plane.normal, -sign));
    let (clock_a, clock_b) =
        (by_clock(a, &plane.normal, sign, clock_at_s), by_clock(b, &plane.normal, -sign, clock_at_s));
    let clock = [clock_a[0] + clock_b[0], clock_a[1] + clock_b[1]];
    let border = Segment { start: layout.border() + CLOCK, values: &clock };
    let (start_a, start_b) = (layout.knot(a.basis.first), layout.knot(b.basis.first));
    let gap = start_b - start_a;
    if gap >= 24 {
        let knots = [Segment { start: start_a, values: &row_a }, Segment { start: start_b, values: &row_b }, border];
        equations.add_row(&knots, plane.distance_m, weight);
    } else {
        let mut row = [0.0; 48];
        row[..24].copy_from_slice(&row_a);
        for (sum, term) in row[gap..gap + 24].iter_mut().zip(row_b) {
            *sum += term;
        }
        let knots = [Segment { start: start_a, values: &row[..gap + 24] }, border];
        equations.add_row(&knots, plane.distance_m, weight);
    }
}

/// Adds a match between a live surfel and one of a fixed view.
pub(in crate::estimation) fn add_fixed(
    equations: &mut NormalEquations,
    layout: &Layout,
    a: &Placed,
    plane: &Plane,
    (weight, clock_at_s): (f64, f64),
) {
    let row = by_knots(a, &plane.normal, 1.0);
    let clock = by_clock(a, &plane.normal, 1.0, clock_at_s);
    let knots = Segment { start: layout.knot(a.basis.first), values: &row };
    let border = Segment { start: layout.border() + CLOCK, values: &clock };
    equations.add_row(&[knots, border], plane.distance_m, weight);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::spline::Basis;
    use crate::geometry::{Rotation, from_roll_pitch_yaw};
    use approx::assert_relative_eq;
    use nalgebra::{DMatrix, DVector};

    const AT_S: f64 = 0.5;

    /// Two thin patches of about one plane, seen at different times.
    fn surfel(tau_s: f64, seed: f64) -> Placed {
        let turn = from_roll_pitch_yaw(0.02 * seed, 0.3, 0.4).to_rotation_matrix().into_inner();
        let covariance = turn * Matrix::from_diagonal(&Vector::new(0.02, 0.05, 1e-4)) * turn.transpose();
        let patch =
            Patch { centre: Vector::new(2.0 + 0.1 * seed, 1.0, 0.5), normal: turn * Vector::z(), covariance, level: 0 };
        Placed {
            patch,
            tau_s,
            arm: Vector::new(1.5, 0.2 * seed, -0.4),
            velocity: Vector::new(3.0, -2.0 * seed, 1.0),
            basis: Basis::at(tau_s + 0.003, 0.2),
        }
    }

    /// The centre after a step `x`, by the definition of the correction and of the clock.
    fn moved(surfel: &Placed, layout: &Layout, x: &DVector<f64>) -> Vector {
        let correction = Correction::of_spline(&surfel.basis, layout.first_knot, x.as_slice());
        let clock = layout.border() + CLOCK;
        let later_s = x[clock] + x[clock + 1] * (surfel.tau_s - AT_S);
        let origin = surfel.patch.centre - surfel.arm;
        let turned = Rotation::from_scaled_axis(correction.rotation) * surfel.arm;
        origin + correction.translation + turned + surfel.velocity * later_s
    }

    fn check(a: &Placed, b: Option<&Placed>) {
        let layout = Layout { first_knot: 0, knots: 12 };
        let other = b.map_or(surfel(0.0, 0.5).patch, |b| b.patch);
        let plane = Plane::of(&a.patch, &other, 0.01);
        let distance = |x: &DVector<f64>| {
            let there = b.map_or(other.centre, |b| moved(b, &layout, x));
            plane.normal.dot(&(moved(a, &layout, x) - there))
        };
        let jacobian = DMatrix::from_fn(1, layout.size(), |_, k| {
            let step = |h: f64| DVector::from_fn(layout.size(), |i, _| if i == k { h } else { 0.0 });
            (distance(&step(1e-6)) - distance(&step(-1e-6))) / 2e-6
        });
        let mut equations = NormalEquations::new(layout.size());
        match b {
            Some(b) => add_pair(&mut equations, &layout, (a, b), &plane, (3.0, AT_S)),
            None => add_fixed(&mut equations, &layout, a, &plane, (3.0, AT_S)),
        }
        assert_relative_eq!(equations.dense(), jacobian.transpose() * &jacobian * 3.0, epsilon = 1e-7);
        let right = jacobian.transpose() * (-3.0 * distance(&DVector::zeros(layout.size())));
        assert_relative_eq!(equations.right(), right.column(0).into_owned(), epsilon = 1e-7);
        // What a solution moves the surfel by is the same derivative.
        let x = DVector::from_fn(layout.size(), |k, _| 1e-3 * (k as f64).sin());
        let by = moved_m(a, &plane.normal, &layout, x.as_slice(), AT_S)
            - b.map_or(0.0, |b| moved_m(b, &plane.normal, &layout, x.as_slice(), AT_S));
        assert_relative_eq!(by, (jacobian * x)[0], epsilon = 1e-8);
    }

    #[test]
    fn the_derivatives_are_those_of_the_distance() {
        let (early, near, late) = (surfel(0.31, 1.0), surfel(0.62, -1.0), surfel(1.43, 2.0));
        check(&early, Some(&late));
        check(&late, Some(&early));
        check(&early, Some(&near));
        check(&early, None);
    }

    #[test]
    fn the_common_normal_is_the_least_eigenvector_of_both() {
        let (a, b) = (surfel(0.3, 1.0).patch, surfel(0.9, -2.0).patch);
        let plane = Plane::of(&a, &b, 0.01);
        let eigen = (a.covariance + b.covariance).symmetric_eigen();
        let least = eigen.eigenvectors.column(eigen.eigenvalues.imin());
        assert!(plane.normal.dot(&least).abs() > 1.0 - 1e-6);
        assert_relative_eq!(plane.variance, 1e-4 + eigen.eigenvalues.min(), max_relative = 1e-2);
        assert_relative_eq!(plane.normal.norm(), 1.0, epsilon = 1e-12);
    }
}
