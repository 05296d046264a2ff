//! How far a spring's top is from its rest, in coordinates that turn with the spring.

use super::{Matrix6, Vector6};
use crate::geometry::{Matrix, Pose, Vector, skew};

/// The logarithm of the top's pose seen from the base, and its rate of change.
///
/// With the top at `p`, turned by the rotation vector `theta`, the six coordinates are `(a, theta)` where `a =
/// J_l(theta)^-1 p`: the logarithm on SE(3). A spring that bends into an arc of constant curvature keeps `a` at its
/// length along z, so bending, shear, stretch and twist stay apart however far the top has turned, and the frame of the
/// strains turns with the spring. Good for turns below pi.
///
/// The rate is `a_dot = A v + W w`, `theta_dot = A w` for the top's velocity `v` and angular velocity `w` in the base,
/// with `A = J_l(theta)^-1` (Barfoot, State Estimation for Robotics, 7.1.5) and `W = (d a / d theta) A`. The power of a
/// force law `g` in the coordinates is `g . rate`, so the wrench on the top is the transposed rate of `-g`: this is
/// what makes a potential's force conservative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deformation {
    /// `(a, theta)`, m and rad.
    pub coordinates: Vector6,
    /// `A`.
    pub straight: Matrix,
    /// `W`.
    pub mixed: Matrix,
}

impl Deformation {
    /// That of a top at `base_from_top`.
    pub fn of(base_from_top: &Pose) -> Self {
        let p = base_from_top.translation.vector;
        let theta = base_from_top.rotation.scaled_axis();
        let (c, c_slope) = cotangent_series(theta.norm_squared());
        let hat = skew(&theta);
        let turned = theta.cross(&p);
        let twice = theta.cross(&turned);
        let straight = Matrix::identity() - hat * 0.5 + hat * hat * c;
        let hat_p = skew(&p);
        let by_theta = hat_p * 0.5 - (skew(&turned) + hat * hat_p) * c + twice * theta.transpose() * c_slope;
        let a = p - turned * 0.5 + twice * c;
        Self { coordinates: stack(&a, &theta), straight, mixed: by_theta * straight }
    }

    /// How fast the coordinates change under a twist of the top, written in the base.
    pub fn rate(&self, twist: &Vector6) -> Vector6 {
        let (v, w) = split(twist);
        stack(&(self.straight * v + self.mixed * w), &(self.straight * w))
    }

    /// The wrench about the top, written in the base, that does the work of `g` in the coordinates: the rate,
    /// transposed.
    pub fn wrench(&self, g: &Vector6) -> Vector6 {
        let (force, torque) = split(g);
        stack(&self.straight.tr_mul(&force), &(self.mixed.tr_mul(&force) + self.straight.tr_mul(&torque)))
    }

    /// The rate as a matrix.
    pub fn rate_matrix(&self) -> Matrix6 {
        blocks(&self.straight, &self.mixed, &Matrix::zeros(), &self.straight)
    }
}

/// `c = (1 - (t/2) cot(t/2)) / t^2` of `J_l^-1 = 1 - [theta]/2 + c [theta]^2`, and `(dc/dt)/t`; of `t` squared.
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

/// Translation (or force) and rotation (or torque) in one column.
pub fn stack(upper: &Vector, lower: &Vector) -> Vector6 {
    Vector6::new(upper.x, upper.y, upper.z, lower.x, lower.y, lower.z)
}

/// A column's translation (or force) and rotation (or torque).
pub fn split(v: &Vector6) -> (Vector, Vector) {
    (Vector::new(v[0], v[1], v[2]), Vector::new(v[3], v[4], v[5]))
}

/// A matrix of four blocks, `a b` over `c d`.
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
    use crate::geometry::{Rotation, left_jacobian};
    use approx::assert_relative_eq;

    #[test]
    fn an_arc_of_constant_curvature_is_bent_and_nothing_else() {
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
            assert_relative_eq!(left_jacobian(&theta) * here.straight, Matrix::identity(), epsilon = 1e-12);
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
            }
        }
    }

    #[test]
    fn the_series_meets_the_closed_form() {
        let (below, above) = (cotangent_series(0.25 - 1e-12), cotangent_series(0.25));
        assert_relative_eq!(below.0, above.0, max_relative = 1e-12);
        assert_relative_eq!(below.1, above.1, max_relative = 1e-10);
    }
}
