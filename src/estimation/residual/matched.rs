//! Distance between two matched surfels along the normal of their common surface.
//!
//! `e = n^T (mu_i - mu_j)`, with `n, lambda` the least eigenpair of `S_i + S_j`, weighted by `zeta^2 = 1 / (sigma_r^2 +
//! lambda + d_i + d_j)`, with `d` the extra variance of a patch that is not flat. The centre of a live surfel moves by
//! `dt + dr x arm + v dl + u dr + R (e x R^T l + s)`, with `l` the vector from the lidar, `u` its direction, and the
//! lidar rotated by `e` and translated by `s` along the IMU axes. A surfel of a fixed view moves with the calibration
//! of the lidar only.
//!
//! The unknowns common to all surfels are in the border. `B` of them are used: [`COMMON`], or only the first
//! [`COMMON_WITHOUT_EXTRINSICS`] if the lidar extrinsics are not estimated.

use super::knot_span::{SPAN_UNKNOWNS, add_scaled, over_knots};
use crate::layout::{CLOCK, Layout, RANGE};
use crate::spline::Basis;
use crate::surfel::{Patch, PlacedSurfel, Sighting};
use zsim_base::geometry::{Matrix, Vector};

/// The common plane of two matched surfels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plane {
    /// Unit normal of the surface.
    pub(crate) normal: Vector,
    /// From the second centre to the first, m.
    offset: Vector,
    /// Distance along the normal, m.
    pub(crate) distance_m: f64,
    /// Variance of that distance, m^2.
    pub(crate) variance: f64,
}

impl Plane {
    /// The common plane of two patches; `sigma_m` is the match error in addition to the variances of the patches.
    pub(crate) fn of(a: &Patch, b: &Patch, sigma_m: f64) -> Self {
        let both = a.covariance + b.covariance;
        let start = a.normal + b.normal;
        // One step of inverse iteration from the mean normal. The adjugate is proportional to the inverse, and also
        // exists for a patch of zero thickness.
        let normal = adjugate(&both) * start;
        let normal = normal.try_normalize(0.0).or_else(|| start.try_normalize(0.0)).unwrap_or(b.normal);
        let lambda = normal.dot(&(both * normal));
        let offset = a.centre - b.centre;
        let distance_m = normal.dot(&offset);
        Self {
            normal,
            offset,
            distance_m,
            variance: sigma_m * sigma_m + lambda.max(0.0) + a.roughness_variance + b.roughness_variance,
        }
    }

    /// Removes the component of the normal along `direction`, a unit vector.
    pub(crate) fn remove_component(&mut self, direction: &Vector) {
        let remainder = self.normal - direction * self.normal.dot(direction);
        self.normal = remainder.try_normalize(1e-3).unwrap_or(self.normal);
        self.distance_m = self.normal.dot(&self.offset);
    }
}

fn adjugate(m: &Matrix) -> Matrix {
    let (a, b, c) = (m.column(0), m.column(1), m.column(2));
    Matrix::from_rows(&[b.cross(&c).transpose(), c.cross(&a).transpose(), a.cross(&b).transpose()])
}

/// Sine of the tilt of a normal towards a direction below which the tilt may be measurement error.
pub(crate) const MIN_SIGNIFICANT_TILT: f64 = 0.3;

/// Common unknowns without extrinsics: clock offset, clock rate and range bias.
pub(crate) const COMMON_WITHOUT_EXTRINSICS: usize = 3;
/// Index of the range bias in them.
const RANGE_BIAS: usize = RANGE - CLOCK;
/// Common unknowns with extrinsics: also rotation and translation of the lidar.
pub(crate) const COMMON: usize = 9;

/// The derivatives of `e` by the unknowns of one matched surfel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SurfelJacobian<const B: usize> {
    /// By rotation and translation of the surfel.
    pub(super) own: [f64; 6],
    /// By the common unknowns, which are contiguous in the border.
    pub(super) common: [f64; B],
}

impl<const B: usize> SurfelJacobian<B> {
    /// The derivatives for `surfel`, with `normal` pointing towards it.
    #[inline(always)]
    pub(crate) fn of(surfel: &PlacedSurfel, normal: &Vector, clock_reference_s: f64) -> Self {
        let rotation = surfel.arm.cross(normal);
        let later = normal.dot(&surfel.velocity);
        let mut common = [0.0; B];
        common[..COMMON_WITHOUT_EXTRINSICS].copy_from_slice(&[
            later,
            later * (surfel.tau_s - clock_reference_s),
            normal.dot(&surfel.sighting.beam),
        ]);
        if B == COMMON {
            common[COMMON_WITHOUT_EXTRINSICS..].copy_from_slice(&surfel.sighting.by_extrinsics(normal));
        }
        Self { own: [rotation.x, rotation.y, rotation.z, normal.x, normal.y, normal.z], common }
    }

    /// Adds the derivatives of a patch of a fixed view, seen as in `sighting`, by the calibration of the lidar.
    #[inline(always)]
    pub(crate) fn against_fixed(mut self, normal: &Vector, sighting: &Sighting) -> Self {
        self.common[RANGE_BIAS] -= normal.dot(&sighting.beam);
        if B == COMMON {
            let extrinsics = sighting.by_extrinsics(normal);
            self.common[COMMON_WITHOUT_EXTRINSICS..].iter_mut().zip(extrinsics).for_each(|(sum, by)| *sum -= by);
        }
        self
    }

    /// Adds the other surfel's derivatives by the common unknowns.
    #[inline(always)]
    pub(crate) fn together_with(mut self, other: &Self) -> Self {
        self.common.iter_mut().zip(other.common).for_each(|(sum, term)| *sum += term);
        self
    }
}

/// Adds the Jacobian row of a match, scaled by `scales[k]`, to column `k` of six; `side` are its derivatives by the motion of
/// a surfel with the spline basis `basis`.
#[inline(always)]
pub(crate) fn add_scaled_row(
    columns: &mut [Vec<f64>; 6],
    layout: &Layout,
    side: &SurfelJacobian<COMMON>,
    basis: &Basis,
    scales: &[f64; 6],
) {
    let (first, common, knots) = (layout.knot(basis.first), layout.border() + CLOCK, over_knots(&side.own, basis));
    for (column, scale) in columns.iter_mut().zip(scales) {
        add_scaled(&mut column[first..first + SPAN_UNKNOWNS], &knots, *scale);
        add_scaled(&mut column[common..common + COMMON], &side.common, *scale);
    }
}

#[cfg(test)]
mod tests {
    use super::super::sums::{Coupling, SpanSums, SurfelSums};
    use super::*;
    use crate::layout::{BORDER, LIDAR_ROTATION, LIDAR_TRANSLATION};
    use crate::nominal::Correction;
    use crate::normal_equations::NormalEquations;
    use crate::spline::Basis;
    use approx::assert_relative_eq;
    use nalgebra::{DMatrix, DVector, DVectorView};
    use zsim_base::geometry::{Rotation, from_roll_pitch_yaw};

    const AT_S: f64 = 0.5;

    /// A thin patch close to a common plane, measured at `tau_s`.
    fn surfel(tau_s: f64, seed: f64) -> PlacedSurfel {
        let turn = from_roll_pitch_yaw(0.02 * seed, 0.3, 0.4).to_rotation_matrix().into_inner();
        let covariance = turn * Matrix::from_diagonal(&Vector::new(0.02, 0.05, 1e-4)) * turn.transpose();
        let patch = Patch {
            centre: Vector::new(2.0 + 0.1 * seed, 1.0, 0.5),
            normal: turn * Vector::z(),
            points: 50.0,
            covariance,
            roughness_variance: 0.0,
            level: 0,
        };
        PlacedSurfel {
            patch,
            tau_s,
            arm: Vector::new(1.5, 0.2 * seed, -0.4),
            velocity: Vector::new(3.0, -2.0 * seed, 1.0),
            sighting: Sighting {
                beam: Vector::new(0.8, 0.1 * seed, -0.3).normalize(),
                range_m: 2.5,
                map_from_imu: turn.transpose(),
            },
            basis: Basis::at(tau_s + 0.003, 0.2),
        }
    }

    /// The centre after a step `x`, by the definition of the correction and of the clock.
    fn moved(surfel: &PlacedSurfel, layout: &Layout, x: &DVector<f64>) -> Vector {
        let correction = Correction::of_spline(&surfel.basis, layout.first_knot, x.as_slice());
        let clock = layout.border() + CLOCK;
        let later_s = x[clock] + x[clock + 1] * (surfel.tau_s - AT_S);
        let origin = surfel.patch.centre - surfel.arm;
        let turned = Rotation::from_scaled_axis(correction.rotation) * surfel.arm;
        let border = x.rows(layout.border(), BORDER);
        origin + correction.translation + turned + surfel.velocity * later_s + moved_by_lidar(surfel, &border)
    }

    /// The motion of the centre by a step `border`, by the definition of the calibration.
    fn moved_by_lidar(surfel: &PlacedSurfel, border: &DVectorView<f64>) -> Vector {
        let Sighting { beam, range_m, map_from_imu } = surfel.sighting;
        let turn = Rotation::from_scaled_axis(border.fixed_rows::<3>(LIDAR_ROTATION).into_owned());
        let reach_in_imu = map_from_imu.transpose() * beam * range_m;
        let moved_in_imu = turn * reach_in_imu - reach_in_imu + border.fixed_rows::<3>(LIDAR_TRANSLATION);
        map_from_imu * moved_in_imu + beam * border[RANGE]
    }

    fn check(a: &PlacedSurfel, b: Option<&PlacedSurfel>) {
        let layout = Layout { first_knot: 0, knots: 12 };
        let fixed = surfel(0.0, 0.5);
        let other = b.map_or(fixed.patch, |b| b.patch);
        let plane = Plane::of(&a.patch, &other, 0.01);
        let distance = |x: &DVector<f64>| {
            let of_view = other.centre + moved_by_lidar(&fixed, &x.rows(layout.border(), BORDER));
            let there = b.map_or(of_view, |b| moved(b, &layout, x));
            plane.normal.dot(&(moved(a, &layout, x) - there))
        };
        let jacobian = DMatrix::from_fn(1, layout.size(), |_, k| {
            let step = |h: f64| DVector::from_fn(layout.size(), |i, _| if i == k { h } else { 0.0 });
            (distance(&step(1e-6)) - distance(&step(-1e-6))) / 2e-6
        });
        let mut equations = NormalEquations::new(layout.size());
        let one = SurfelJacobian::<COMMON>::of(a, &plane.normal, AT_S);
        let other = b.map(|b| (b, SurfelJacobian::of(b, &-plane.normal, AT_S)));
        let with_view = one.against_fixed(&plane.normal, &fixed.sighting);
        let both = other.as_ref().map_or(with_view, |(_, other)| one.together_with(other));
        for (surfel, side) in [(a, both)].into_iter().chain(other.map(|(b, side)| (b, side.together_with(&one)))) {
            let (mut own, mut of_span) = (SurfelSums::NONE, SpanSums::NONE);
            own.add(&side, plane.distance_m, 3.0);
            of_span.add(&own, &surfel.basis);
            if std::ptr::eq(surfel, a) {
                of_span.common.add(&side, plane.distance_m, 3.0);
            }
            of_span.add_to(&mut equations, &layout, surfel.basis.first);
        }
        if let Some((b, other)) = other {
            let (early, late) = if a.tau_s < b.tau_s { ((a, &one), (b, &other)) } else { ((b, &other), (a, &one)) };
            let mut coupling = Coupling::NONE;
            coupling.add(early.0, early.1, late.0, late.1, 3.0);
            coupling.add_to(&mut equations, &layout, early.0.basis.first, late.0.basis.first);
        }
        assert_relative_eq!(equations.dense(), jacobian.transpose() * &jacobian * 3.0, epsilon = 1e-7);
        let right = jacobian.transpose() * (-3.0 * distance(&DVector::zeros(layout.size())));
        assert_relative_eq!(equations.right(), right.column(0).into_owned(), epsilon = 1e-7);
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
