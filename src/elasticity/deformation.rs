//! Deformation of a spring in corotational coordinates.

use super::{Matrix6, Vector6};
use zsim_base::geometry::{Matrix, Pose, Vector, skew};

/// The logarithm of the top's pose relative to the base, and the rate of change.
///
/// For a top at `p`, rotated by the rotation vector `theta`, the six coordinates are `(a, theta)` with `a =
/// J_l(theta)^-1 p`, the logarithm on SE(3). A spring bent into an arc of constant curvature keeps `a` equal to the
/// length along z, so bending, shear, stretch and twist remain separate at large rotations, and the frame of the
/// strains rotates with the spring. Valid for rotations below pi.
///
/// The rate is `a_dot = A v + W w`, `theta_dot = A w` for the top's velocity `v` and angular velocity `w` in the base,
/// with `A = J_l(theta)^-1` (Barfoot, State Estimation for Robotics, 7.1.5) and `W = (d a / d theta) A`. The power of a
/// force law `g` in the coordinates is `g . rate`, so the wrench on the top is the transposed Jacobian times `-g`. The
/// force of a potential is therefore conservative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deformation {
    /// The coordinates `(a, theta)`, m and rad.
    pub coordinates: Vector6,
    position: Vector,
    theta: Vector,
    /// The coefficient `c` of `A = 1 - [theta]/2 + c [theta]^2`, and `(dc/dt)/t` for the angle t.
    series: (f64, f64),
    /// `theta x p` and `theta x (theta x p)`.
    turned: (Vector, Vector),
}

impl Deformation {
    /// Computes the deformation for a top at `base_from_top`.
    pub fn of(base_from_top: &Pose) -> Self {
        let position = base_from_top.translation.vector;
        let theta = base_from_top.rotation.scaled_axis();
        let series = cotangent_series(theta.norm_squared());
        let once = theta.cross(&position);
        let turned = (once, theta.cross(&once));
        let a = position - turned.0 * 0.5 + turned.1 * series.0;
        Self { coordinates: stack(&a, &theta), position, theta, series, turned }
    }

    /// The Jacobian block `A`.
    pub fn jacobian(&self) -> Matrix {
        let hat = skew(&self.theta);
        Matrix::identity() - hat * 0.5 + hat * hat * self.series.0
    }

    /// The Jacobian block `W`.
    pub fn coupling(&self) -> Matrix {
        let (c, c_slope) = self.series;
        let hat_p = skew(&self.position);
        let by_theta = hat_p * 0.5 - (skew(&self.turned.0) + skew(&self.theta) * hat_p) * c
            + self.turned.1 * self.theta.transpose() * c_slope;
        by_theta * self.jacobian()
    }

    /// The rate of the coordinates for a twist of the top, in the axes of the base.
    pub fn rate(&self, twist: &Vector6) -> Vector6 {
        let (v, w) = split(twist);
        let jacobian = self.jacobian();
        stack(&(jacobian * v + self.coupling() * w), &(jacobian * w))
    }

    /// The wrench about the top that is equivalent to the generalised force `g`: transposed Jacobian times g.
    ///
    /// In the axes of the base. Products of vectors: it is the innermost part of a simulation.
    pub fn wrench(&self, g: &Vector6) -> Vector6 {
        let (force, torque) = split(g);
        let (c, c_slope) = self.series;
        // A^T f = f + theta x f / 2 + c theta x (theta x f)
        let transposed = |f: &Vector| {
            let once = self.theta.cross(f);
            f + once * 0.5 + self.theta.cross(&once) * c
        };
        // W = B A, and B^T f with the derivative B of a by theta.
        let by_theta = force.cross(&self.position) * 0.5
            + (self.turned.0.cross(&force) - self.position.cross(&self.theta.cross(&force))) * c
            + self.theta * (c_slope * self.turned.1.dot(&force));
        stack(&transposed(&force), &transposed(&(by_theta + torque)))
    }

    /// The Jacobian of the coordinates by the twist of the top.
    pub fn rate_matrix(&self) -> Matrix6 {
        let jacobian = self.jacobian();
        blocks(&jacobian, &self.coupling(), &Matrix::zeros(), &jacobian)
    }
}

/// The coefficient `c = (1 - (t/2) cot(t/2)) / t^2` of `J_l^-1 = 1 - [theta]/2 + c [theta]^2`, and `(dc/dt)/t`.
///
/// The argument is `t` squared.
fn cotangent_series(t2: f64) -> (f64, f64) {
    if t2 < 0.25 {
        // From (x/2) cot(x/2) = 1 - x^2/12 - x^4/720 - ... (Bernoulli numbers); the next terms are below 1e-16.
        const S: [f64; 7] = [
            1.0 / 12.0,
            1.0 / 720.0,
            1.0 / 30_240.0,
            1.0 / 1_209_600.0,
            1.0 / 47_900_160.0,
            691.0 / 1_307_674_368_000.0,
            1.0 / 74_724_249_600.0,
        ];
        let c = S.iter().rev().fold(0.0, |sum, s| sum * t2 + s);
        let slope = (1..S.len()).rev().fold(0.0, |sum, k| sum * t2 + 2.0 * k as f64 * S[k]);
        return (c, slope);
    }
    let half = 0.5 * t2.sqrt();
    let k = half / half.tan();
    let c = (1.0 - k) / t2;
    (c, -((k - k * k - half * half) / t2 + 2.0 * c) / t2)
}

/// Stacks translation (or force) and rotation (or torque) in one column.
pub fn stack(upper: &Vector, lower: &Vector) -> Vector6 {
    Vector6::new(upper.x, upper.y, upper.z, lower.x, lower.y, lower.z)
}

/// Splits a column into translation (or force) and rotation (or torque).
pub fn split(v: &Vector6) -> (Vector, Vector) {
    (Vector::new(v[0], v[1], v[2]), Vector::new(v[3], v[4], v[5]))
}

/// Assembles a matrix from four blocks: `a b` over `c d`.
pub fn blocks(a: &Matrix, b: &Matrix, c: &Matrix, d: &Matrix) -> Matrix6 {
    let mut all = Matrix6::zeros();
    all.fixed_view_mut::<3, 3>(0, 0).copy_from(a);
    all.fixed_view_mut::<3, 3>(0, 3).copy_from(b);
    all.fixed_view_mut::<3, 3>(3, 0).copy_from(c);
    all.fixed_view_mut::<3, 3>(3, 3).copy_from(d);
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::{Rotation, left_jacobian};

    #[test]
    fn an_arc_of_constant_curvature_has_a_bending_coordinate_only() {
        // A spring of length L bent by phi about y ends at L/phi (1 - cos phi, 0, sin phi).
        let (length, phi) = (0.12, 1.3_f64);
        let end = Vector::new(1.0 - phi.cos(), 0.0, phi.sin()) * (length / phi);
        let top = Pose::from_parts(end.into(), Rotation::from_scaled_axis(Vector::y() * phi));
        let expected = Vector6::new(0.0, 0.0, length, 0.0, phi, 0.0);
        assert_relative_eq!(Deformation::of(&top).coordinates, expected, epsilon = 1e-14);
    }

    #[test]
    fn the_rate_is_the_derivative_of_the_coordinates() {
        // Central difference along each of the six displacements; truncation ~ 1e-10.
        for theta in [Vector::new(0.4, -1.9, 0.8), Vector::new(1e-3, -2e-3, 5e-4), Vector::zeros(), Vector::x() * 0.499]
        {
            let p = Vector::new(0.02, -0.03, 0.11);
            let top = Pose::from_parts(p.into(), Rotation::from_scaled_axis(theta));
            let here = Deformation::of(&top);
            assert_relative_eq!(left_jacobian(&theta) * here.jacobian(), Matrix::identity(), epsilon = 1e-12);
            for k in 0..6 {
                let h = 1e-5;
                let moved = |h: f64| {
                    let (dp, dphi) = split(&Vector6::ith(k, h));
                    let rotation = Rotation::from_scaled_axis(dphi) * top.rotation;
                    Deformation::of(&Pose::from_parts((p + dp).into(), rotation)).coordinates
                };
                let numeric = (moved(h) - moved(-h)) / (2.0 * h);
                assert_relative_eq!(numeric, here.rate(&Vector6::ith(k, 1.0)), epsilon = 1e-9);
                assert_relative_eq!(numeric, here.rate_matrix().column(k).into_owned(), epsilon = 1e-9);
                // The wrench is the transposed Jacobian times the generalised force.
                let g = Vector6::new(1.0, -0.4, 2.0, 0.3, -0.7, 0.2);
                assert_relative_eq!(here.wrench(&g)[k], here.rate(&Vector6::ith(k, 1.0)).dot(&g), epsilon = 1e-12);
            }
        }
    }

    #[test]
    fn series_and_closed_form_agree_where_they_meet() {
        let (below, above) = (cotangent_series(0.25 - 1e-12), cotangent_series(0.25));
        assert_relative_eq!(below.0, above.0, max_relative = 1e-12);
        assert_relative_eq!(below.1, above.1, max_relative = 1e-10);
    }
}
