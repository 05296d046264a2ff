//! Elastic contact between the coils of an element.
//!
//! An element that is shorter by `s` than its closed length, and bent by `theta`, has the overlap `c = s + R theta cos(phi)` at
//! the angle `phi` around its axis, with the mean radius `R`. The contact has the potential
//!
//! ```text
//! U = k / (2 pi) integral of max(c, 0)^2 / 2 over phi from -pi to pi
//! ```
//!
//! It is smooth, also where the contact of one side becomes that of all coils. With `cos(phi0) = -s / (R theta)`, between 0 and
//! pi, `dU/ds = k / pi (s phi0 + R theta sin(phi0))` and `dU/d(R theta) = k / pi (s sin(phi0) + R theta (phi0 / 2 + sin(2 phi0) / 4))`.

use super::{Coil, Matrix6, Vector6};
use std::f64::consts::PI;

/// Stiffness of the contact relative to the axial stiffness of the open spring.
///
/// Contact of steel is stiffer by far. A mass of 0.5 kg that meets the closed coils at 0.5 m/s on a spring of 500 N/m shortens
/// them by 3 mm in all. The bounce is five times as fast as that of the open spring; a simulation divides its steps there.
const STIFFNESS_RATIO: f64 = 24.0;

/// The contact of the coils of an element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CoilStop {
    /// Shortening of the straight element at which all coils touch, m.
    open_m: f64,
    radius_m: f64,
    stiffness_n_per_m: f64,
}

impl CoilStop {
    /// The contact in one of `segments` elements of a coil under `load_n`, each with the axial stiffness `axial_n_per_m`.
    pub(super) fn new(coil: &Coil, load_n: f64, segments: usize, axial_n_per_m: f64) -> Self {
        Self {
            open_m: coil.straight_gap_m(load_n) * coil.active_coils() / segments as f64,
            radius_m: 0.5 * coil.coil_diameter_m(),
            stiffness_n_per_m: STIFFNESS_RATIO * axial_n_per_m,
        }
    }

    /// The potential at `e`, the coordinates minus those of the straight, loaded element, J.
    pub(super) fn potential_j(&self, e: &Vector6) -> f64 {
        let overlap = self.overlap(e);
        let Overlap { s, bend, phi } = overlap;
        let integral = s * s * phi + 2.0 * s * bend * phi.sin() + bend * bend * overlap.of_cosine_squared();
        self.stiffness_n_per_m / (2.0 * PI) * integral
    }

    /// The gradient of the potential.
    pub(super) fn gradient(&self, e: &Vector6) -> Vector6 {
        let overlap = self.overlap(e);
        let Overlap { s, bend, phi } = overlap;
        if phi == 0.0 {
            return Vector6::zeros();
        }
        let by_s = s * phi + bend * phi.sin();
        let by_bend = s * phi.sin() + bend * overlap.of_cosine_squared();
        // By the angles: R theta_xy / theta times the derivative by R theta.
        let by_angle = if bend > 0.0 { self.radius_m * self.radius_m * by_bend / bend } else { 0.0 };
        Vector6::new(0.0, 0.0, -by_s, by_angle * e[3], by_angle * e[4], 0.0) * (self.stiffness_n_per_m / PI)
    }

    /// The overlap of all coils at the inner side of the bend, m; negative without contact.
    pub(super) fn overlap_m(&self, e: &Vector6) -> f64 {
        let Overlap { s, bend, .. } = self.overlap(e);
        s + bend
    }

    /// The stiffness of the contact when all coils touch, in the coordinates.
    pub(super) fn closed_stiffness(&self) -> Matrix6 {
        let bending = 0.5 * self.radius_m * self.radius_m;
        Matrix6::from_diagonal(&Vector6::new(0.0, 0.0, 1.0, bending, bending, 0.0)) * self.stiffness_n_per_m
    }

    fn overlap(&self, e: &Vector6) -> Overlap {
        let (s, bend) = (-e[2] - self.open_m, self.radius_m * e[3].hypot(e[4]));
        let phi = if s >= bend {
            PI
        } else if s <= -bend {
            0.0
        } else {
            (-s / bend).acos()
        };
        Overlap { s, bend, phi }
    }
}

/// The overlap `s + bend cos(phi)` around the axis, positive up to `phi` on both sides of the inner side of the bend.
struct Overlap {
    s: f64,
    bend: f64,
    phi: f64,
}

impl Overlap {
    /// Half of the integral of the squared cosine where the coils overlap.
    fn of_cosine_squared(&self) -> f64 {
        0.5 * self.phi + 0.25 * (2.0 * self.phi).sin()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Moduli, Spring};
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::{Pose, Rotation, Vector};

    const STOP: CoilStop = CoilStop { open_m: 0.01, radius_m: 0.0125, stiffness_n_per_m: 1e4 };

    fn e(axial: f64, rx: f64, ry: f64) -> Vector6 {
        Vector6::new(1e-3, -2e-3, axial, rx, ry, 0.1)
    }

    /// Compares with a numerical integral around the circumference.
    #[test]
    fn the_potential_is_the_integral_around_the_coil() {
        for (axial, rx, ry) in [(-0.005, 0.3, -0.5), (-0.012, 0.1, 0.05), (-0.009, -0.9, 0.2), (0.004, 1.2, 0.9)] {
            let (bend, s) = (STOP.radius_m * f64::hypot(rx, ry), -axial - STOP.open_m);
            let count = 20_000;
            let mean = (0..count)
                .map(|k| (s + bend * (2.0 * PI * (f64::from(k) + 0.5) / f64::from(count)).cos()).max(0.0).powi(2) / 2.0)
                .sum::<f64>()
                / f64::from(count);
            let expected = STOP.stiffness_n_per_m * mean;
            assert_relative_eq!(STOP.potential_j(&e(axial, rx, ry)), expected, max_relative = 1e-6, epsilon = 1e-12);
        }
    }

    #[test]
    fn the_gradient_is_the_derivative_of_the_potential() {
        for (axial, rx, ry) in
            [(-0.005, 0.3, -0.5), (-0.012, 0.1, 0.05), (-0.009, -0.9, 0.2), (-0.013, 0.0, 0.0), (-0.002, 0.1, 0.1)]
        {
            let at = e(axial, rx, ry);
            let gradient = STOP.gradient(&at);
            for k in 0..6 {
                let step = Vector6::ith(k, 1e-7);
                let slope = (STOP.potential_j(&(at + step)) - STOP.potential_j(&(at - step))) / 2e-7;
                assert_relative_eq!(gradient[k], slope, max_relative = 1e-5, epsilon = 1e-6);
            }
        }
    }

    /// 12 coils of 3 mm in 46 mm are closed after 10 mm.
    fn short_spring(segments: usize) -> (Coil, Spring) {
        let moduli = Moduli { youngs_pa: 206e9, shear_pa: 79.3e9 };
        let coil = Coil::new(0.025, 0.003, 12.0, 0.046, moduli).unwrap();
        let column = coil.under_load(4.0).unwrap();
        (coil, Spring::of_column(&column, segments).unwrap().with_contact(&coil, 4.0))
    }

    #[test]
    fn a_closed_spring_has_25_times_its_stiffness_for_any_number_of_segments() {
        for segments in [1, 2, 8] {
            let (coil, spring) = short_spring(segments);
            let force_n = |length_m: f64| {
                let top = Pose::translation(0.0, 0.0, length_m);
                spring.wrench(&mut spring.state(), &top).unwrap().total()[2]
            };
            let k = coil.axial_n_per_m();
            assert_relative_eq!(force_n(0.037), 0.009 * k, max_relative = 1e-9);
            assert_relative_eq!(force_n(0.035), 0.011 * k + 24.0 * 0.001 * k, max_relative = 1e-9);
        }
    }

    #[test]
    fn a_spring_whose_coils_touch_has_an_equilibrium_in_any_pose() {
        for segments in [2, 4, 8] {
            let (_, spring) = short_spring(segments);
            let mut state = spring.state();
            for k in 0..400_u32 {
                let wave = |rate: f64| (f64::from(k) * rate).sin();
                let turn = Rotation::from_scaled_axis(Vector::new(wave(0.7), wave(1.3), 0.5 * wave(0.4)));
                let shift = Vector::new(0.01 * wave(0.9), 0.01 * wave(1.7), 0.036 + 0.01 * wave(0.23));
                let top = Pose::from_parts(shift.into(), turn);
                let wrench = spring.wrench(&mut state, &top);
                assert!(
                    wrench.is_ok_and(|wrench| wrench.total().iter().all(|x| x.is_finite())),
                    "{segments} segments: {top}"
                );
            }
        }
    }
}
