//! Uniform cubic B-splines for the trajectory corrections.
//!
//! With a knot spacing `spacing` and the position `x` in 0..1 between two knots, the spline is
//! `c(u) = sum_a B_a(x) c_(first + a)`, a = 0..3, with the basis of de Boor (A Practical Guide to Splines, 1978):
//!
//! ```text
//! 6 B_0 = (1 - x)^3            6 B_1 = 3 x^3 - 6 x^2 + 4
//! 6 B_2 = -3 x^3 + 3 x^2 + 3 x + 1          6 B_3 = x^3
//! ```
//!
//! The spline is twice continuously differentiable with analytic derivatives, so no differences of noisy poses are
//! needed.

/// The four non-zero basis functions at a time, with two derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Basis {
    /// Index of the first of the four coefficients; index 0 is at time 0.
    pub(super) first: i64,
    /// Values.
    pub(super) value: [f64; 4],
    /// First derivatives, 1/s.
    pub(super) rate: [f64; 4],
    /// Second derivatives, 1/s^2.
    pub(super) acceleration: [f64; 4],
}

impl Basis {
    /// The basis at time `u_s`, s, for a knot spacing of `spacing_s`, s.
    pub(super) fn at(u_s: f64, spacing_s: f64) -> Self {
        let position = u_s / spacing_s;
        let segment = position.floor();
        let x = position - segment;
        let (y, x2) = (1.0 - x, x * x);
        let inverse = 1.0 / spacing_s;
        let value = [y * y * y, (3.0 * x - 6.0) * x2 + 4.0, ((3.0 - 3.0 * x) * x + 3.0) * x + 1.0, x2 * x];
        let rate = [-y * y, (3.0 * x - 4.0) * x, (2.0 - 3.0 * x) * x + 1.0, x2];
        let acceleration = [y, 3.0 * x - 2.0, 1.0 - 3.0 * x, x];
        Self {
            first: segment as i64,
            value: value.map(|b| b / 6.0),
            rate: rate.map(|b| b * (0.5 * inverse)),
            acceleration: acceleration.map(|b| b * (inverse * inverse)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_basis_is_a_partition_of_unity_and_its_derivatives_sum_to_zero() {
        for step in 0..50 {
            let basis = Basis::at(-1.3 + 0.07 * f64::from(step), 0.2);
            assert_relative_eq!(basis.value.iter().sum::<f64>(), 1.0, epsilon = 1e-14);
            assert_relative_eq!(basis.rate.iter().sum::<f64>(), 0.0, epsilon = 1e-12);
            assert_relative_eq!(basis.acceleration.iter().sum::<f64>(), 0.0, epsilon = 1e-10);
        }
    }

    #[test]
    fn coefficients_of_a_parabola_give_the_parabola() {
        // A uniform cubic B-spline reproduces quadratics: for c(u) = u^2 the coefficient of knot k (centre (k - 1) h)
        // is ((k - 1) h)^2 - h^2 / 3, the blossom of u^2.
        let h = 0.15;
        let coefficient = |k: i64| ((k - 1) as f64 * h).powi(2) - h * h / 3.0;
        for u in [-0.4, 0.0, 0.031, 0.15, 1.77] {
            let basis = Basis::at(u, h);
            let sum = |b: &[f64; 4]| (0..4).map(|a| b[a] * coefficient(basis.first + a as i64)).sum::<f64>();
            assert_relative_eq!(sum(&basis.value), u * u, epsilon = 1e-12);
            assert_relative_eq!(sum(&basis.rate), 2.0 * u, epsilon = 1e-11);
            assert_relative_eq!(sum(&basis.acceleration), 2.0, epsilon = 1e-9);
        }
    }

    #[test]
    fn the_spline_and_two_derivatives_are_continuous_at_a_knot() {
        let (before, after) = (Basis::at(0.6 - 1e-12, 0.2), Basis::at(0.6 + 1e-12, 0.2));
        assert_eq!(before.first + 1, after.first);
        for a in 0..3 {
            assert_relative_eq!(before.value[a + 1], after.value[a], epsilon = 1e-9);
            assert_relative_eq!(before.rate[a + 1], after.rate[a], epsilon = 1e-8);
            assert_relative_eq!(before.acceleration[a + 1], after.acceleration[a], epsilon = 1e-6);
        }
    }
}
