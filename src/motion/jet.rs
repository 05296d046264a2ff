//! Forward-mode differentiation: a function of time with first and second derivative.

use std::ops::{Add, AddAssign, Mul, Neg, Sub};
use zsim_base::geometry::{Kinematics, Pose, Rotation, Vector, from_roll_pitch_yaw};

/// Value of a function of time with first and second derivative.
///
/// Sums and products of jets follow the rules of Leibniz, so that a motion computed with jets has exact derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Jet {
    /// Value.
    pub x: f64,
    /// First derivative, per second.
    pub d: f64,
    /// Second derivative, per second squared.
    pub dd: f64,
}

impl Jet {
    /// A constant.
    pub fn constant(x: f64) -> Self {
        Self { x, d: 0.0, dd: 0.0 }
    }

    /// The function `rate t + phase` at the time `t_s`.
    pub fn linear(t_s: f64, rate: f64, phase: f64) -> Self {
        Self { x: rate * t_s + phase, d: rate, dd: 0.0 }
    }

    /// The function `exp(rate t)` times `scale`.
    pub fn exponential(t_s: f64, rate: f64, scale: f64) -> Self {
        let x = scale * (rate * t_s).exp();
        Self { x, d: rate * x, dd: rate * rate * x }
    }

    /// Composition with `argument`: derivatives with respect to the argument become derivatives with respect to time.
    pub fn compose(self, argument: Jet) -> Self {
        Self { x: self.x, d: self.d * argument.d, dd: self.dd * argument.d * argument.d + self.d * argument.dd }
    }

    /// Sine and cosine of this function.
    pub fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.x.sin_cos();
        let squared = self.d * self.d;
        (
            Self { x: sin, d: cos * self.d, dd: cos * self.dd - sin * squared },
            Self { x: cos, d: -sin * self.d, dd: -sin * self.dd - cos * squared },
        )
    }
}

impl Add for Jet {
    type Output = Jet;
    fn add(self, other: Jet) -> Jet {
        Jet { x: self.x + other.x, d: self.d + other.d, dd: self.dd + other.dd }
    }
}

impl AddAssign for Jet {
    fn add_assign(&mut self, other: Jet) {
        *self = *self + other;
    }
}

impl Sub for Jet {
    type Output = Jet;
    fn sub(self, other: Jet) -> Jet {
        self + -other
    }
}

impl Neg for Jet {
    type Output = Jet;
    fn neg(self) -> Jet {
        Jet { x: -self.x, d: -self.d, dd: -self.dd }
    }
}

impl Mul for Jet {
    type Output = Jet;
    fn mul(self, other: Jet) -> Jet {
        Jet {
            x: self.x * other.x,
            d: self.d * other.x + self.x * other.d,
            dd: self.dd * other.x + 2.0 * self.d * other.d + self.x * other.dd,
        }
    }
}

impl Mul<f64> for Jet {
    type Output = Jet;
    fn mul(self, factor: f64) -> Jet {
        Jet { x: self.x * factor, d: self.d * factor, dd: self.dd * factor }
    }
}

/// Position and attitude of a frame, each component with derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct PoseJet {
    /// Position in the world, m.
    pub position: [Jet; 3],
    /// Rotation about fixed x, rad.
    pub roll: Jet,
    /// Then about fixed y, rad.
    pub pitch: Jet,
    /// Then about fixed z, rad.
    pub yaw: Jet,
}

impl PoseJet {
    /// A frame at rest.
    pub fn at_rest(position: &Vector, yaw: f64) -> Self {
        let position = [position.x, position.y, position.z].map(Jet::constant);
        Self { position, yaw: Jet::constant(yaw), ..Self::default() }
    }

    /// Pose, velocities and accelerations.
    ///
    /// With `R = Rz(yaw) Ry(pitch) Rx(roll)` the angular velocity is `omega = yaw' z + pitch' b + roll' c`. The axes
    /// `b = Rz y` and `c = Rz Ry x` rotate themselves: `b' = yaw' z x b` and `c' = (yaw' z + pitch' b) x c`.
    pub fn kinematics(&self) -> Kinematics {
        let part = |component: fn(&Jet) -> f64| Vector::from(self.position.each_ref().map(component));
        let (sin_yaw, cos_yaw) = self.yaw.x.sin_cos();
        let (sin_pitch, cos_pitch) = self.pitch.x.sin_cos();
        let pitch_axis = Vector::new(-sin_yaw, cos_yaw, 0.0);
        let roll_axis = Vector::new(cos_pitch * cos_yaw, cos_pitch * sin_yaw, -sin_pitch);
        let yawing = Vector::z() * self.yaw.d;
        let pitching = pitch_axis * self.pitch.d;
        let rolling = roll_axis * self.roll.d;
        let rotation: Rotation = from_roll_pitch_yaw(self.roll.x, self.pitch.x, self.yaw.x);
        Kinematics {
            world_from_body: Pose::from_parts(part(|jet| jet.x).into(), rotation),
            velocity_in_world: part(|jet| jet.d),
            angular_velocity_in_world: yawing + pitching + rolling,
            acceleration_in_world: part(|jet| jet.dd),
            angular_acceleration_in_world: Vector::z() * self.yaw.dd
                + pitch_axis * self.pitch.dd
                + roll_axis * self.roll.dd
                + yawing.cross(&pitching)
                + (yawing + pitching).cross(&rolling),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn products_and_sines_have_exact_derivatives() {
        // f = t^2 sin(3 t): f' = 2 t sin 3t + 3 t^2 cos 3t, f'' = 2 sin 3t + 12 t cos 3t - 9 t^2 sin 3t.
        let t = 0.7;
        let time = Jet::linear(t, 1.0, 0.0);
        let f = time * time * (time * 3.0).sin_cos().0;
        let (sin, cos) = (3.0 * t).sin_cos();
        assert_relative_eq!(f.x, t * t * sin, epsilon = 1e-14);
        assert_relative_eq!(f.d, 2.0 * t * sin + 3.0 * t * t * cos, epsilon = 1e-14);
        assert_relative_eq!(f.dd, 2.0 * sin + 12.0 * t * cos - 9.0 * t * t * sin, epsilon = 1e-13);
    }

    #[test]
    fn a_steady_coning_motion_has_the_angular_acceleration_of_its_roll_axis() {
        // Yaw at rate w with constant pitch: omega = w z, no angular acceleration. With an additional roll rate r, the
        // roll axis c rotates: alpha = w z x r c.
        let (w, r, pitch) = (0.8, 1.7, 0.4);
        let cone = PoseJet {
            yaw: Jet::linear(0.3, w, 0.0),
            pitch: Jet::constant(pitch),
            roll: Jet::linear(0.3, r, 0.0),
            ..PoseJet::default()
        };
        let kinematics = cone.kinematics();
        let axis = kinematics.world_from_body.rotation * Vector::x();
        assert_relative_eq!(kinematics.angular_velocity_in_world, Vector::z() * w + axis * r, epsilon = 1e-14);
        let carried = (Vector::z() * w).cross(&(axis * r));
        assert_relative_eq!(kinematics.angular_acceleration_in_world, carried, epsilon = 1e-14);
    }
}
