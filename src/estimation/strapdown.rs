//! Integration of an IMU whose samples are averages over their intervals.
//!
//! A sample is the mean of rate and force over an interval of length `h`, its slope taken from the neighbouring
//! samples. About the interval's middle, w(s) = w0 + w1 s, f(s) = f0 + f1 s, to third order in `h` (Magnus expansion;
//! Savage, Strapdown Inertial Navigation Integration, 1998):
//!
//! ```text
//! turn       phi = w h + h^3/12 w0 x w1                                            (coning)
//! velocity   R_mid (f h + h^3/12 w0 x f1 + h^3/24 (w1 x f0 + w0 x (w0 x f0)))      (sculling, rotation)
//! ```
//!
//! At 400 degrees/s and 100 Hz the last term alone is 2 mm/s^2: leaving it out would look like a bias.

use crate::geometry::{Matrix, Rotation, Vector};

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
    /// Whether no sample was there: its readings are interpolated.
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

/// By how much an IMU exaggerates: the truth is `(1 - m) reading`, with scale factors on the diagonal of `m` and
/// misalignment beside it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Exaggerates {
    /// The gyroscope.
    pub(super) gyro: Matrix,
    /// The accelerometer.
    pub(super) accel: Matrix,
}

impl Exaggerates {
    /// An IMU that tells what is true.
    pub(super) fn nothing() -> Self {
        Self { gyro: Matrix::zeros(), accel: Matrix::zeros() }
    }

    /// By how much the accelerometer's axes are turned against the gyroscope's, a rotation vector, rad: a misalignment
    /// that is no symmetric matrix is a turn of the whole.
    pub(super) fn accel_against_gyro(&self) -> Vector {
        let m = self.accel - self.gyro;
        Vector::new(m[(2, 1)] - m[(1, 2)], m[(0, 2)] - m[(2, 0)], m[(1, 0)] - m[(0, 1)]) * 0.5
    }

    /// Exaggerates more, by `more`.
    pub(super) fn add(&mut self, more: &Self) {
        self.gyro += more.gyro;
        self.accel += more.accel;
    }
}

impl Interval {
    /// The same interval by an IMU that exaggerates less, by `of`.
    pub(super) fn without(&self, of: &Exaggerates) -> Self {
        Self {
            gyro: self.gyro - of.gyro * self.gyro,
            gyro_slope: self.gyro_slope - of.gyro * self.gyro_slope,
            accel: self.accel - of.accel * self.accel,
            accel_slope: self.accel_slope - of.accel * self.accel_slope,
            ..*self
        }
    }

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
        let velocity = self.velocity + acceleration * h;
        // The trapezium of the velocities, less what a linear acceleration bends the velocity in between.
        let position = self.position + (self.velocity + velocity) * (0.5 * h) - jerk * (h.powi(3) / 12.0);
        let mut rotation = self.rotation * Rotation::from_scaled_axis(interval.turn(biases));
        rotation.renormalize_fast();
        State { rotation, position, velocity }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::gravity_in_world;

    #[test]
    fn an_accelerometer_that_is_turned_is_told_by_how_much() {
        // What it reads are the forces along its own axes: the truth is what turns back, (1 - m) reading.
        let turn = Vector::new(1e-3, -2e-3, 3e-3);
        let back = Rotation::from_scaled_axis(-turn).to_rotation_matrix().into_inner();
        let scale = Matrix::from_diagonal(&Vector::new(1e-3, 2e-3, -3e-3));
        let turned = Exaggerates { accel: Matrix::identity() - back + scale, ..Exaggerates::nothing() };
        assert!((turned.accel_against_gyro() - turn).norm() < 1e-7, "{}", turned.accel_against_gyro());
        let both = Exaggerates { gyro: turned.accel, ..turned };
        assert!(both.accel_against_gyro().norm() < 1e-12);
    }

    /// Body rate and force of a body whose axis cones and whose force turns with it.
    fn signal(t_s: f64) -> (Vector, Vector) {
        let (s, c) = (8.0 * t_s).sin_cos();
        (Vector::new(4.0 * s, 6.0 * c, 1.0), Vector::new(3.0 * c, -2.0 * s, 9.8 + s))
    }

    /// Means over intervals of length `h`, and slopes as a recording gives them: from the neighbouring means.
    fn intervals(h: f64, count: usize) -> Vec<Interval> {
        let mean = |centre: f64| {
            let samples = 200;
            let at = |k: i32| centre + h * ((f64::from(k) + 0.5) / f64::from(samples) - 0.5);
            let sum = (0..samples)
                .map(|k| signal(at(k)))
                .fold((Vector::zeros(), Vector::zeros()), |sum, (w, f)| (sum.0 + w, sum.1 + f));
            (sum.0 / f64::from(samples), sum.1 / f64::from(samples))
        };
        let interval = |k: usize| {
            let centre = (k as f64 + 0.5) * h;
            let ((gyro, accel), before, after) = (mean(centre), mean(centre - h), mean(centre + h));
            let gyro_slope = (after.0 - before.0) / (2.0 * h);
            let accel_slope = (after.1 - before.1) / (2.0 * h);
            Interval { h, gyro, gyro_slope, accel, accel_slope, gyro_sigma: 1.0, accel_sigma: 1.0, bridged: false }
        };
        (0..count).map(interval).collect()
    }

    fn integrate(h: f64, seconds: f64) -> State {
        let none = Biases { gyro: Vector::zeros(), accel: Vector::zeros() };
        let start = State { rotation: Rotation::identity(), position: Vector::zeros(), velocity: Vector::zeros() };
        let count = (seconds / h).round() as usize;
        intervals(h, count).iter().fold(start, |state, i| state.after(i, &none, &gravity_in_world()))
    }

    #[test]
    fn averaged_samples_at_100_hz_integrate_to_the_fine_solution() {
        // Coning of 24 rad^2/s at 8 rad/s: without its correction the axis would drift by h^2/12 w x w' ~ 1.6e-3 rad/s.
        let (coarse, fine) = (integrate(0.01, 2.0), integrate(0.000_5, 2.0));
        assert!(coarse.rotation.angle_to(&fine.rotation) < 2e-5, "{}", coarse.rotation.angle_to(&fine.rotation));
        assert!((coarse.velocity - fine.velocity).norm() < 4e-4, "{}", coarse.velocity - fine.velocity);
        assert!((coarse.position - fine.position).norm() < 4e-4, "{}", coarse.position - fine.position);
    }
}
