//! The rotation group SO(3): skew matrix, Jacobians, and roll-pitch-yaw.

use super::{Matrix, Rotation, Vector};

/// The cross-product matrix: `skew(a) * b == a.cross(&b)`.
pub fn skew(a: &Vector) -> Matrix {
    a.cross_matrix()
}

/// The left Jacobian of SO(3).
///
/// `exp(theta + d) ~ exp(left_jacobian(theta) d) exp(theta)` to first order in `d`.
///
/// `J_l = I + (1 - cos t)/t^2 [theta]x + (t - sin t)/t^3 [theta]x^2` with `t = |theta|` (Barfoot, State Estimation for
/// Robotics, eq. 7.77b). Below 1e-4 rad a series avoids the cancellation in the closed form.
pub fn left_jacobian(theta: &Vector) -> Matrix {
    let t2 = theta.norm_squared();
    let (a, b) = if t2 < 1e-8 {
        (0.5 - t2 / 24.0, 1.0 / 6.0 - t2 / 120.0)
    } else {
        let t = t2.sqrt();
        ((1.0 - t.cos()) / t2, (t - t.sin()) / (t2 * t))
    };
    let hat = skew(theta);
    Matrix::identity() + hat * a + hat * hat * b
}

/// The right Jacobian of SO(3), equal to the left one at `-theta`.
///
/// `exp(theta + d) ~ exp(theta) exp(right_jacobian(theta) d)` to first order in `d`.
pub fn right_jacobian(theta: &Vector) -> Matrix {
    left_jacobian(&-theta)
}

/// The rotation `Rz(yaw) Ry(pitch) Rx(roll)` about fixed x, then y, then z (REP-103); radians.
pub fn from_roll_pitch_yaw(roll: f64, pitch: f64, yaw: f64) -> Rotation {
    Rotation::from_euler_angles(roll, pitch, yaw)
}

/// Roll, pitch and yaw of a rotation, radians.
///
/// Inverse of [`from_roll_pitch_yaw`] for pitch within +-pi/2.
pub fn roll_pitch_yaw(rotation: &Rotation) -> (f64, f64, f64) {
    rotation.euler_angles()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn jacobians_are_the_derivatives_of_exp() {
        // Central difference of log(exp(theta + d) exp(theta)^-1) by d; truncation ~ h^2 = 1e-10.
        for theta in [Vector::new(0.3, -1.1, 0.7), Vector::new(1e-5, 2e-5, -1e-5), Vector::zeros()] {
            let h = 1e-5;
            for k in 0..3 {
                let d = Vector::ith(k, h);
                let exp = |v: Vector| Rotation::from_scaled_axis(v);
                let left = (exp(theta + d) * exp(theta).inverse()).scaled_axis()
                    - (exp(theta - d) * exp(theta).inverse()).scaled_axis();
                let right = (exp(theta).inverse() * exp(theta + d)).scaled_axis()
                    - (exp(theta).inverse() * exp(theta - d)).scaled_axis();
                assert_relative_eq!(left / (2.0 * h), left_jacobian(&theta).column(k).into_owned(), epsilon = 1e-9);
                assert_relative_eq!(right / (2.0 * h), right_jacobian(&theta).column(k).into_owned(), epsilon = 1e-9);
            }
        }
    }

    #[test]
    fn positive_pitch_points_x_down() {
        // A positive rotation about y turns +x towards -z: in REP-103 a pitch of +30 degrees points the head down.
        let nod = from_roll_pitch_yaw(0.0, 30_f64.to_radians(), 0.0);
        let forward = nod * Vector::x();
        assert_relative_eq!(forward, Vector::new(0.75_f64.sqrt(), 0.0, -0.5), epsilon = 1e-12);
        let (roll, pitch, yaw) = roll_pitch_yaw(&from_roll_pitch_yaw(0.1, -0.2, 3.0));
        assert_relative_eq!(Vector::new(roll, pitch, yaw), Vector::new(0.1, -0.2, 3.0), epsilon = 1e-12);
    }
}
