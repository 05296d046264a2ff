//! How a rigid body moves at an instant.

use super::{Pose, Rotation, Vector, left_jacobian};

/// Pose, velocity and acceleration of a frame fixed in a rigid body.
///
/// Velocities and accelerations are those of the body's frame origin, written in the world: m/s, rad/s, m/s^2, rad/s^2.
/// Acceleration is kinematic: gravity is not in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kinematics {
    /// `world_from_body`.
    pub world_from_body: Pose,
    /// Velocity of the body's origin, m/s.
    pub velocity_in_world: Vector,
    /// Angular velocity, rad/s.
    pub angular_velocity_in_world: Vector,
    /// Acceleration of the body's origin, m/s^2.
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

    /// The motion of another frame fixed in the same body: `a = a0 + alpha x r + omega x (omega x r)`.
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

    /// What an ideal gyroscope reads: the angular velocity in the body's frame, rad/s.
    pub fn angular_velocity_in_body(&self) -> Vector {
        self.world_from_body.rotation.inverse() * self.angular_velocity_in_world
    }

    /// What an ideal accelerometer reads: kinematic acceleration minus free fall, in the body's frame, m/s^2.
    pub fn specific_force_in_body(&self) -> Vector {
        self.world_from_body.rotation.inverse() * (self.acceleration_in_world - super::gravity_in_world())
    }

    /// The pose a fraction `u` in 0..1 of the way to `next`, `dt_s` seconds later.
    ///
    /// Cubic Hermite in position and in the rotation vector from here, so position and angular velocity are continuous
    /// from step to step: the error is of fourth order in `dt_s`.
    pub fn pose_towards(&self, next: &Kinematics, dt_s: f64, u: f64) -> Pose {
        let (h10, h01, h11) = (u * (1.0 - u) * (1.0 - u), u * u * (3.0 - 2.0 * u), u * u * (u - 1.0));
        let start = self.world_from_body.translation.vector;
        let end = next.world_from_body.translation.vector;
        let position =
            start + (end - start) * h01 + (self.velocity_in_world * h10 + next.velocity_in_world * h11) * dt_s;

        let turn = (next.world_from_body.rotation * self.world_from_body.rotation.inverse()).scaled_axis();
        // The rate of the rotation vector at the end: J_l(turn)^-1 omega. `turn` is a step's rotation, far from pi.
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

    /// A circle of radius 2 m at 3 rad/s, facing along the tangent.
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
    fn the_centre_of_a_turn_does_not_move() {
        // The circle's centre lies 2 m to the left of a body that drives counter-clockwise.
        let centre = on_circle(0.4).of_frame(&Pose::translation(0.0, 2.0, 0.0));
        assert_relative_eq!(centre.world_from_body.translation.vector, Vector::zeros(), epsilon = 1e-12);
        assert_relative_eq!(centre.velocity_in_world, Vector::zeros(), epsilon = 1e-12);
        assert_relative_eq!(centre.acceleration_in_world, Vector::zeros(), epsilon = 1e-11);
    }

    #[test]
    fn an_accelerometer_reads_gravity_and_the_centripetal_force() {
        let g = crate::geometry::STANDARD_GRAVITY_M_PER_S2;
        assert_relative_eq!(on_circle(1.0).specific_force_in_body(), Vector::new(0.0, 18.0, g), epsilon = 1e-11);
        assert_relative_eq!(on_circle(1.0).angular_velocity_in_body(), Vector::z() * 3.0, epsilon = 1e-12);
    }

    #[test]
    fn interpolation_is_of_fourth_order() {
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
