//! Integration of an IMU whose samples are averages over their intervals.
//!
//! A sample is the mean of rate and force over an interval of length `h`, its slope taken from the neighbouring samples.
//! About the interval's middle, w(s) = w0 + w1 s, f(s) = f0 + f1 s, to third order in `h` (Magnus expansion; Savage,
//! Strapdown Inertial Navigation Integration, 1998):
//!
//! ```text
//! turn       phi = w h + h^3/12 w0 x w1                                            (coning)
//! velocity   R_mid (f h + h^3/12 w0 x f1 + h^3/24 (w1 x f0 + w0 x (w0 x f0)))      (sculling, rotation)
//! ```
//!
//! At 400 degrees/s and 100 Hz the last term alone is 2 mm/s^2: leaving it out would look like a bias.

use crate::geometry::{Rotation, Vector};

/// What the IMU said about one interval of time, in the IMU's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Interval {
    /// Its length, s.
    pub(super) h: f64,
    /// Mean angular velocity, rad/s.
    pub(super) gyro: Vector,
    /// Its slope, rad/s^2.
    pub(super) gyro_slope: Vector,
    /// Mean specific force, m/s^2.
    pub(super) accel: Vector,
    /// Its slope, m/s^3.
    pub(super) accel_slope: Vector,
    /// Standard deviation of `gyro` on each axis, rad/s.
    pub(super) gyro_sigma: f64,
    /// Standard deviation of `accel` on each axis, m/s^2.
    pub(super) accel_sigma: f64,
    /// Whether no sample was there and the velocity is held.
    pub(super) bridged: bool,
}

/// The biases of gyroscope and accelerometer, in the IMU's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Biases {
    /// rad/s.
    pub(super) gyro: Vector,
    /// m/s^2.
    pub(super) accel: Vector,
}

impl Interval {
    /// The rotation vector from the interval's start to its end, in the body.
    pub(super) fn turn(&self, biases: &Biases) -> Vector {
        let rate = self.gyro - biases.gyro;
        rate * self.h + rate.cross(&self.gyro_slope) * (self.h.powi(3) / 12.0)
    }

    /// The rotation vector from the interval's start to its middle.
    pub(super) fn turn_to_middle(&self, biases: &Biases) -> Vector {
        (self.gyro - biases.gyro) * (0.5 * self.h) - self.gyro_slope * (self.h * self.h / 8.0)
    }

    /// The mean specific force as the body's attitude in the middle sees it, without its bias.
    pub(super) fn force_in_middle(&self, biases: &Biases) -> Vector {
        let (rate, force) = (self.gyro - biases.gyro, self.accel - biases.accel);
        let turning = rate.cross(&self.accel_slope) / 12.0
            + (self.gyro_slope.cross(&force) + rate.cross(&rate.cross(&force))) / 24.0;
        force + turning * (self.h * self.h)
    }
}

/// Attitude, position and velocity of the IMU in the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct State {
    /// `map_from_imu`, the rotation.
    pub(super) rotation: Rotation,
    /// Position, m.
    pub(super) position: Vector,
    /// Velocity, m/s.
    pub(super) velocity: Vector,
}

impl State {
    /// The state one interval later, under gravity `gravity` (m/s^2, in the map).
    pub(super) fn after(&self, interval: &Interval, biases: &Biases, gravity: &Vector) -> State {
        let h = interval.h;
        let middle = self.rotation * Rotation::from_scaled_axis(interval.turn_to_middle(biases));
        let force = interval.force_in_middle(biases);
        let acceleration = middle * force + gravity;
        let jerk = middle * (interval.accel_slope + (interval.gyro - biases.gyro).cross(&force));
        let (acceleration, jerk) =
            if interval.bridged { (Vector::zeros(), Vector::zeros()) } else { (acceleration, jerk) };
        let velocity = self.velocity + acceleration * h;
        // The trapezium of the velocities, less what a linear acceleration bends the velocity in between.
        let position = self.position + (self.velocity + velocity) * (0.5 * h) - jerk * (h.powi(3) / 12.0);
        let mut rotation = self.rotation * Rotation::from_scaled_axis(interval.turn(biases));
        rotation.renormalize_fast();
        State { rotation, position, velocity }
    }
}
