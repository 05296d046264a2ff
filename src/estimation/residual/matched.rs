//! How far two matched surfels are apart along the normal of the surface that both belong to.
//!
//! `e = n^T (mu_i - mu_j)`, with `n, lambda` the least eigenpair of `S_i + S_j`, weighted by
//! `zeta^2 = 1 / (sigma_r^2 + lambda)`. A live surfel's centre moves by
//! `dt + dr x arm + v dl + u dr`, `u` along its beams; one of a fixed view does not.
//!
//! A streak takes the patch's plane. It may lie beside the patch's points, where that plane is less certain, so its
//! `zeta^2 = 1 / (sigma_r^2 + lambda + x)`, see `Patch::variance_of_extrapolation`.

use super::{CLOCK, CLOCK_RATE, Layout, RANGE};
use crate::estimation::nominal::Correction;
use crate::estimation::normal_equations::NormalEquations;
use crate::estimation::surfel::{Patch, Placed};
use crate::geometry::{Matrix, Vector};

/// Two surfels of one surface.
#[derive(Debug, Clone, Copy)]
pub(in crate::estimation) struct Plane {
    /// Unit normal of the surface.
    pub(in crate::estimation) normal: Vector,
    /// From the second centre to the first, m.
    apart: Vector,
    /// Distance along the normal, m.
    pub(in crate::estimation) distance_m: f64,
    /// Variance of that distance, m^2.
    pub(in crate::estimation) variance: f64,
}

impl Plane {
    /// The plane common to two patches, `sigma_m` being what a match may be off beside their thickness.
    pub(in crate::estimation) fn of(a: &Patch, b: &Patch, sigma_m: f64) -> Self {
        Self::towards(a.normal + b.normal, a, b, sigma_m)
    }

    /// The plane of a patch, as a streak in it sees it too.
    pub(in crate::estimation) fn around(streak: &Patch, patch: &Patch, sigma_m: f64) -> Self {
        let plane = Self::towards(patch.normal, streak, patch, sigma_m);
        let within = plane.apart - plane.normal * plane.distance_m;
        let extrapolated = patch.variance_of_extrapolation(&plane.normal, &within);
        Self { variance: plane.variance + extrapolated, ..plane }
    }

    /// Says nothing any more along `direction`, a unit vector.
    pub(in crate::estimation) fn forget(&mut self, direction: &Vector) {
        let left = self.normal - direction * self.normal.dot(direction);
        self.normal = left.try_normalize(1e-3).unwrap_or(self.normal);
        self.distance_m = self.normal.dot(&self.apart);
    }

    fn towards(start: Vector, a: &Patch, b: &Patch, sigma_m: f64) -> Self {
        let both = a.covariance + b.covariance;
        // One step of inverse iteration from the mean normal: the adjugate is the inverse but for a factor, and exists
        // for a perfectly thin patch as well.
        let normal = adjugate(&both) * start;
        let normal = normal.try_normalize(0.0).or_else(|| start.try_normalize(0.0)).unwrap_or(b.normal);
        let lambda = normal.dot(&(both * normal));
        let apart = a.centre - b.centre;
        let distance_m = normal.dot(&apart);
        Self { normal, apart, distance_m, variance: sigma_m * sigma_m + lambda.max(0.0) }
    }
}

fn adjugate(m: &Matrix) -> Matrix {
    let (a, b, c) = (m.column(0), m.column(1), m.column(2));
    Matrix::from_rows(&[b.cross(&c).transpose(), c.cross(&a).transpose(), a.cross(&b).transpose()])
}

/// The derivative of `e` by what moves a live surfel: its turn, its shift, the clock offset at its time, the range offset.
fn by_motion(surfel: &Placed, normal: &Vector) -> [f64; OWN] {
    let turn = surfel.arm.cross(normal);
    [turn.x, turn.y, turn.z, normal.x, normal.y, normal.z, normal.dot(&surfel.velocity), normal.dot(&surfel.beam)]
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
    let clock = layout.border() + CLOCK;
    let later_s = x[clock] + x[clock + 1] * (surfel.tau_s - clock_at_s);
    let longer_m = x[layout.border() + RANGE];
    let turned = correction.rotation.cross(&surfel.arm);
    normal.dot(&(correction.translation + turned + surfel.velocity * later_s + surfel.beam * longer_m))
}

/// The motions of a surfel of its own: turn, shift, clock offset, range offset.
const OWN: usize = 8;

/// What all matches of a surfel say about its own motion: `sum w g g^T` and `-sum w e g`, with `g` the derivative of `e`.
///
/// A surfel has several matches, and its motion hangs on many unknowns: summed here first, each match costs little.
#[derive(Debug, Clone, Copy)]
pub(in crate::estimation) struct Own {
    /// Lower triangle by rows.
    square: [f64; OWN * (OWN + 1) / 2],
    right: [f64; OWN],
}

impl Default for Own {
    fn default() -> Self {
        Self { square: [0.0; OWN * (OWN + 1) / 2], right: [0.0; OWN] }
    }
}

impl Own {
    fn add(&mut self, by: &[f64; OWN], distance_m: f64, weight: f64) {
        let mut entries = self.square.iter_mut();
        for i in 0..OWN {
            let scaled = weight * by[i];
            self.right[i] -= scaled * distance_m;
            for (other, entry) in by[..=i].iter().zip(entries.by_ref()) {
                *entry += scaled * other;
            }
        }
    }

    /// Adds what another part of the matches says.
    pub(in crate::estimation) fn merge(&mut self, other: &Self) {
        for (sum, term) in self.square.iter_mut().zip(other.square) {
            *sum += term;
        }
        for (sum, term) in self.right.iter_mut().zip(other.right) {
            *sum += term;
        }
    }

    /// Whether any match said something.
    pub(in crate::estimation) fn has_matches(&self) -> bool {
        self.square.iter().any(|entry| *entry != 0.0)
    }

    fn square(&self, i: usize, j: usize) -> f64 {
        let (i, j) = (i.max(j), i.min(j));
        self.square[i * (i + 1) / 2 + j]
    }

    /// Adds it to the equations of the window's unknowns, by the surfel's place among the knots and its time.
    pub(in crate::estimation) fn add_to(
        &self,
        equations: &mut NormalEquations,
        layout: &Layout,
        surfel: &Placed,
        clock_at_s: f64,
    ) {
        let (first, border) = (layout.knot(surfel.basis.first), layout.border());
        // Of each unknown of the border, which motion it is, and how much of it.
        let beside = [(CLOCK, 6, 1.0), (CLOCK_RATE, 6, surfel.tau_s - clock_at_s), (RANGE, 7, 1.0)];
        for (k, value) in surfel.basis.value.iter().enumerate() {
            for i in 0..6 {
                let row = first + 6 * k + i;
                equations.add_right(row, value * self.right[i]);
                let squares: [f64; 6] = std::array::from_fn(|j| value * self.square(i, j));
                let entries = equations.row_from(row, first);
                for (knot, other) in entries.chunks_mut(6).zip(surfel.basis.value) {
                    for (entry, square) in knot.iter_mut().zip(squares) {
                        *entry += other * square;
                    }
                }
                for (unknown, motion, by) in beside {
                    equations.add_entry(border + unknown, row, by * value * self.square(motion, i));
                }
            }
        }
        for (a, (unknown, motion, by)) in beside.iter().enumerate() {
            equations.add_right(border + unknown, by * self.right[*motion]);
            for (other, other_motion, other_by) in &beside[..=a] {
                let value = by * other_by * self.square(*motion, *other_motion);
                equations.add_entry(border + unknown, border + other, value);
            }
        }
    }
}

/// Adds a match between two live surfels: to what each says by itself, and how they hang together.
pub(in crate::estimation) fn add_pair(
    (equations, own): (&mut NormalEquations, &mut [Own]),
    layout: &Layout,
    (placed, a, b): (&[Placed], usize, usize),
    plane: &Plane,
    (weight, clock_at_s): (f64, f64),
) {
    let by_a = by_motion(&placed[a], &plane.normal);
    let by_b = by_motion(&placed[b], &plane.normal).map(|x| -x);
    own[a].add(&by_a, plane.distance_m, weight);
    own[b].add(&by_b, plane.distance_m, weight);
    let (row_a, row_b) = (Row::of(&placed[a], &by_a, clock_at_s), Row::of(&placed[b], &by_b, clock_at_s));
    let (early, late) = if placed[a].basis.first <= placed[b].basis.first {
        ((&placed[a], row_a), (&placed[b], row_b))
    } else {
        ((&placed[b], row_b), (&placed[a], row_a))
    };
    let starts = (layout.knot(early.0.basis.first), layout.knot(late.0.basis.first));
    equations.add_product((starts.0, &early.1.knots), (starts.1, &late.1.knots), weight);
    let beside = layout.border() + CLOCK;
    equations.add_product((starts.0, &early.1.knots), (beside, &late.1.beside), weight);
    equations.add_product((starts.1, &late.1.knots), (beside, &early.1.beside), weight);
    equations.add_product((beside, &early.1.beside), (beside, &late.1.beside), weight);
}

/// Adds a match between a live surfel and one of a fixed view.
pub(in crate::estimation) fn add_fixed(own: &mut Own, surfel: &Placed, plane: &Plane, weight: f64) {
    own.add(&by_motion(surfel, &plane.normal), plane.distance_m, weight);
}

/// Adds the row of the Jacobian of a match of `surfel`, `scales[k]` times to column `k` of six.
pub(in crate::estimation) fn add_scaled_row(
    columns: &mut [Vec<f64>; 6],
    layout: &Layout,
    (surfel, normal): (&Placed, &Vector),
    scales: &[f64; 6],
    clock_at_s: f64,
) {
    let row = Row::of(surfel, &by_motion(surfel, normal), clock_at_s);
    let (first, beside) = (layout.knot(surfel.basis.first), layout.border() + CLOCK);
    for (column, scale) in columns.iter_mut().zip(scales) {
        for (sum, term) in column[first..first + 24].iter_mut().zip(row.knots) {
            *sum += scale * term;
        }
        for (sum, term) in column[beside..beside + 3].iter_mut().zip(row.beside) {
            *sum += scale * term;
        }
    }
}

/// A row of the Jacobian: the four knots about a surfel; the clock's offset and rate and the range offset, which follow each
/// other in the border.
struct Row {
    knots: [f64; 24],
    beside: [f64; 3],
}

impl Row {
    fn of(surfel: &Placed, by: &[f64; OWN], clock_at_s: f64) -> Self {
        let mut knots = [0.0; 24];
        for (knot, value) in knots.chunks_exact_mut(6).zip(surfel.basis.value) {
            for (entry, derivative) in knot.iter_mut().zip(by) {
                *entry = value * derivative;
            }
        }
        Self { knots, beside: [by[6], by[6] * (surfel.tau_s - clock_at_s), by[7]] }
    }
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
        let patch = Patch {
            centre: Vector::new(2.0 + 0.1 * seed, 1.0, 0.5),
            normal: turn * Vector::z(),
            points: 50.0,
            covariance,
            level: 0,
        };
        Placed {
            patch,
            tau_s,
            arm: Vector::new(1.5, 0.2 * seed, -0.4),
            velocity: Vector::new(3.0, -2.0 * seed, 1.0),
            beam: Vector::new(0.8, 0.1 * seed, -0.3).normalize(),
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
        let longer_m = x[layout.border() + RANGE];
        origin + correction.translation + turned + surfel.velocity * later_s + surfel.beam * longer_m
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
        let placed: Vec<Placed> = std::iter::once(a).chain(b).cloned().collect();
        let mut own = vec![Own::default(); placed.len()];
        match b {
            Some(_) => add_pair((&mut equations, &mut own), &layout, (&placed, 0, 1), &plane, (3.0, AT_S)),
            None => add_fixed(&mut own[0], a, &plane, 3.0),
        }
        for (own, surfel) in own.iter().zip(&placed) {
            own.add_to(&mut equations, &layout, surfel, AT_S);
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
