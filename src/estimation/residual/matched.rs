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
