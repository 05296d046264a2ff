//! Kinematics of a rigid body.

use super::{Pose, Rotation, Vector, left_jacobian};

/// Pose, velocity and acceleration of a frame fixed to a rigid body.
///
/// Velocities and accelerations are those of the frame's origin, in the axes of the world: m/s, rad/s, m/s^2, rad/s^2.
/// The acceleration is kinematic: without gravity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kinematics {
    /// Pose `world_from_body`.
    pub world_from_body: Pose,
    /// Velocity of the frame's origin, m/s.
    pub velocity_in_world: Vector,
    /// Angular velocity, rad/s.
    pub angular_velocity_in_world: Vector,
    /// Acceleration of the frame's origin, m/s^2.
    pub acceleration_in_world: Vector,
    /// Angular acceleration, rad/s^2.
    pub angular_acceleration_in_world: Vector,
}

impl Kinematics {
    /// A body at rest.
    pub fn at_rest(world_from_body: Pose) -> Self {
        let zero = Vector::zeros();
        Self {
            world_from_body,
            velocity_in_world: zero,
            angular_velocity_in_world: zero,
            acceleration_in_world: zero,
            angular_acceleration_in_world: zero,
        }
    }

    /// The kinematics of another frame fixed to the same body.
    ///
    /// `a = a0 + alpha x r + omega x (omega x r)` with the arm r.
    pub fn of_frame(&self, body_from_frame: &Pose) -> Self {
        let arm = self.world_from_body.rotation * body_from_frame.translation.vector;
        let omega = self.angular_velocity_in_world;
        Self {
            world_from_body: self.world_from_body * body_from_frame,
            velocity_in_world: self.velocity_in_world + omega.cross(&arm),
            acceleration_in_world: self.acceleration_in_world
                + self.angular_acceleration_in_world.cross(&arm)
                + omega.cross(&omega.cross(&arm)),
            ..*self
        }
    }

    /// The angular velocity in the axes of the body, as an ideal gyroscope measures it, rad/s.
    pub fn angular_velocity_in_body(&self) -> Vector {
        self.world_from_body.rotation.inverse() * self.angular_velocity_in_world
    }

    /// The specific force in the axes of the body, as an ideal accelerometer measures it, m/s^2.
    ///
    /// It is the kinematic acceleration minus the gravitational acceleration.
    pub fn specific_force_in_body(&self) -> Vector {
        self.world_from_body.rotation.inverse() * (self.acceleration_in_world - super::gravity_in_world())
    }

    /// The pose at the fraction `u` (0 to 1) of the step of `dt_s` seconds to `next`.
    ///
    /// Cubic Hermite interpolation of position and rotation vector, so position and angular velocity are continuous
    /// across steps. The error is of fourth order in `dt_s`.
    pub fn pose_towards(&self, next: &Kinematics, dt_s: f64, u: f64) -> Pose {
        let (h10, h01, h11) = (u * (1.0 - u) * (1.0 - u), u * u * (3.0 - 2.0 * u), u * u * (u - 1.0));
        let start = self.world_from_body.translation.vector;
        let end = next.world_from_body.translation.vector;
        let position =
            start + (end - start) * h01 + (self.velocity_in_world * h10 + next.velocity_in_world * h11) * dt_s;

        let turn = (next.world_from_body.rotation * self.world_from_body.rotation.inverse()).scaled_axis();
        // The rate of the rotation vector at the end: J_l(turn)^-1 omega. The rotation of one step is small compared
        // with pi.
        let rate_at_end = left_jacobian(&turn).lu().solve(&next.angular_velocity_in_world);
        let rate_at_end = rate_at_end.unwrap_or(next.angular_velocity_in_world);
        let turned = turn * h01 + (self.angular_velocity_in_world * h10 + rate_at_end * h11) * dt_s;
        Pose::from_parts(position.into(), Rotation::from_scaled_axis(turned) * self.world_from_body.rotation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::from_roll_pitch_yaw;
    use approx::assert_relative_eq;

    /// A circle of radius 2 m at 3 rad/s, x along the tangent.
    fn on_circle(t_s: f64) -> Kinematics {
        let (radius, rate) = (2.0, 3.0);
        let (sin, cos) = (rate * t_s).sin_cos();
        Kinematics {
            world_from_body: Pose::from_parts(
                Vector::new(radius * cos, radius * sin, 0.0).into(),
                from_roll_pitch_yaw(0.0, 0.0, rate * t_s + std::f64::consts::FRAC_PI_2),
            ),
            velocity_in_world: Vector::new(-sin, cos, 0.0) * radius * rate,
            angular_velocity_in_world: Vector::z() * rate,
            acceleration_in_world: Vector::new(-cos, -sin, 0.0) * radius * rate * rate,
            angular_acceleration_in_world: Vector::zeros(),
        }
    }

    #[test]
    fn the_centre_of_rotation_is_at_rest() {
        // The centre of the circle is 2 m to the left of a body that moves counter-clockwise.
        let centre = on_circle(0.4).of_frame(&Pose::translation(0.0, 2.0, 0.0));
        assert_relative_eq!(centre.world_from_body.translation.vector, Vector::zeros(), epsilon = 1e-12);
        assert_relative_eq!(centre.velocity_in_world, Vector::zeros(), epsilon = 1e-12);
        assert_relative_eq!(centre.acceleration_in_world, Vector::zeros(), epsilon = 1e-11);
    }

    #[test]
    fn specific_force_includes_gravity_and_centripetal_acceleration() {
        let g = crate::geometry::STANDARD_GRAVITY_M_PER_S2;
        assert_relative_eq!(on_circle(1.0).specific_force_in_body(), Vector::new(0.0, 18.0, g), epsilon = 1e-11);
        assert_relative_eq!(on_circle(1.0).angular_velocity_in_body(), Vector::z() * 3.0, epsilon = 1e-12);
    }

    #[test]
    fn interpolation_error_is_of_fourth_order() {
        // Cubic Hermite: error <= max|x''''| h^4 / 384 = 2 * 81 * h^4 / 384; halving h divides it by 16.
        let error = |h: f64| {
            let pose = on_circle(0.0).pose_towards(&on_circle(h), h, 0.5);
            (pose.translation.vector - on_circle(h / 2.0).world_from_body.translation.vector).norm()
        };
        assert!(error(0.1) <= 162.0 * 0.1_f64.powi(4) / 384.0);
        assert_relative_eq!(error(0.1) / error(0.05), 16.0, epsilon = 0.5);
        let middle = on_circle(0.0).pose_towards(&on_circle(0.1), 0.1, 0.5);
        assert!(middle.rotation.angle_to(&on_circle(0.05).world_from_body.rotation) < 1e-12);
    }
}
