//! Strapdown integration of IMU readings over intervals.
//!
//! Let `w` and `f` be the means of angular velocity and specific force over an interval of length `h`, in the axes of the
//! body; the slopes are from the neighbouring readings. About the middle of the interval, w(s) = w + w1 s and f(s) = f +
//! f1 s. To third order in `h`, with `R_mid` half-way along the rotation `phi` (Magnus expansion; Savage, Strapdown
//! Inertial Navigation Integration, 1998):
//!
//! ```text
//! turn       phi = w h + h^3/12 w x w1                                                   (coning)
//! velocity   R_mid (f h + h^3/12 (w x f1 - w1 x f) + h^3/24 w x (w x f)) + g h           (sculling, rotation)
//! ```
//!
//! At 400 degrees/s and 100 Hz the last term is 2 mm/s^2; without it, the error would look like a bias. An IMU that
//! compensates for coning and sculling delivers these sums divided by `h`: the terms must not be added again.

use zsim_base::geometry::{Matrix, Rotation, Vector};
use zsim_base::measurement::ImuNoise;

/// IMU readings over an interval, in the IMU frame; see the module for their relation to the motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Interval {
    /// Length, s.
    pub(super) h: f64,
    /// Angular velocity, rad/s.
    pub(super) gyro: Vector,
    /// Slope of the angular velocity, rad/s^2.
    pub(super) gyro_slope: Vector,
    /// Specific force, m/s^2.
    pub(super) accel: Vector,
    /// Slope of the specific force, m/s^3.
    pub(super) accel_slope: Vector,
    /// Fraction of the coning, sculling and rotation terms that the readings do not include: 1 for means in body axes, 0 if
    /// the IMU compensates for them.
    pub(super) uncompensated: f64,
    /// Standard deviation of `gyro` on each axis, rad/s.
    pub(super) gyro_sigma: f64,
    /// Standard deviation of `accel` on each axis, m/s^2.
    pub(super) accel_sigma: f64,
    /// Whether the readings are interpolated because samples are missing.
    pub(super) bridged: bool,
}

/// Biases of gyroscope and accelerometer, in the IMU frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Biases {
    /// Gyroscope bias, rad/s.
    pub(super) gyro: Vector,
    /// Accelerometer bias, m/s^2.
    pub(super) accel: Vector,
}

/// Scale errors and misalignments of an IMU: the true value is `(1 - m) reading`.
///
/// The diagonal of `m` has the scale errors, the other entries have the misalignments, rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ImuScaleMisalignment {
    /// `m` of the gyroscope.
    pub(super) gyro: Matrix,
    /// `m` of the accelerometer.
    pub(super) accel: Matrix,
}

impl ImuScaleMisalignment {
    /// No scale error or misalignment.
    pub(super) fn zero() -> Self {
        Self { gyro: Matrix::zeros(), accel: Matrix::zeros() }
    }

    /// Standard deviations of the entries, according to the model of the IMU.
    pub(super) fn sigmas_of(model: &ImuNoise) -> Self {
        let of = |scale, misalignment| Matrix::from_fn(|i, j| if i == j { scale } else { misalignment });
        Self {
            gyro: of(model.gyro_scale_error, model.gyro_misalignment_rad),
            accel: of(model.accel_scale_error, model.accel_misalignment_rad),
        }
    }

    /// The entries of both matrices, those of the gyroscope first.
    pub(super) fn entries(&self) -> impl Iterator<Item = f64> {
        self.gyro.iter().chain(&self.accel).copied()
    }

    /// Rotation of the accelerometer axes relative to the gyroscope axes, a rotation vector, rad.
    ///
    /// It is the antisymmetric part of the difference of the matrices.
    pub(super) fn accel_against_gyro(&self) -> Vector {
        let m = self.accel - self.gyro;
        Vector::new(m[(2, 1)] - m[(1, 2)], m[(0, 2)] - m[(2, 0)], m[(1, 0)] - m[(0, 1)]) * 0.5
    }

    /// Adds `more` to both matrices.
    pub(super) fn add(&mut self, more: &Self) {
        self.gyro += more.gyro;
        self.accel += more.accel;
    }
}

impl Interval {
    /// The interval with readings corrected for `errors`.
    pub(super) fn corrected_by(&self, errors: &ImuScaleMisalignment) -> Self {
        Self {
            gyro: self.gyro - errors.gyro * self.gyro,
            gyro_slope: self.gyro_slope - errors.gyro * self.gyro_slope,
            accel: self.accel - errors.accel * self.accel,
            accel_slope: self.accel_slope - errors.accel * self.accel_slope,
            ..*self
        }
    }

    /// Slope of the specific force in the axes of the body half-way along [`Self::turn`], not rotating, m/s^3; `force` is the
    /// mean.
    pub(super) fn force_slope(&self, biases: &Biases, force: &Vector) -> Vector {
        self.accel_slope + (self.gyro - biases.gyro).cross(force)
    }

    /// Rotation vector from the start to the end of the interval, in the body frame, rad.
    pub(super) fn turn(&self, biases: &Biases) -> Vector {
        let rate = self.gyro - biases.gyro;
        rate * self.h + rate.cross(&self.gyro_slope) * (self.uncompensated * self.h.powi(3) / 12.0)
    }

    /// Bias-corrected mean specific force in the axes of the body half-way along [`Self::turn`], m/s^2.
    pub(super) fn force_in_middle(&self, biases: &Biases) -> Vector {
        let (rate, force) = (self.gyro - biases.gyro, self.accel - biases.accel);
        let sculling = (rate.cross(&self.accel_slope) - self.gyro_slope.cross(&force)) / 12.0;
        let rotation = rate.cross(&rate.cross(&force)) / 24.0;
        force + (sculling + rotation) * (self.uncompensated * self.h * self.h)
    }
}

/// Attitude, position and velocity of the IMU in the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct State {
    /// Rotation `map_from_imu`.
    pub(super) rotation: Rotation,
    /// Position, m.
    pub(super) position: Vector,
    /// Velocity, m/s.
    pub(super) velocity: Vector,
}

impl State {
    /// The state after an interval; `gravity` is in the map frame, m/s^2.
    pub(super) fn after(&self, interval: &Interval, biases: &Biases, gravity: &Vector) -> State {
        let h = interval.h;
        let turn = interval.turn(biases);
        let middle = self.rotation * Rotation::from_scaled_axis(turn * 0.5);
        let force = interval.force_in_middle(biases);
        let acceleration = middle * force + gravity;
        let jerk = middle * interval.force_slope(biases, &force);
        let velocity = self.velocity + acceleration * h;
        // Trapezoidal rule for the velocity, with the correction for a linear acceleration.
        let position = self.position + (self.velocity + velocity) * (0.5 * h) - jerk * (h.powi(3) / 12.0);
        let mut rotation = self.rotation * Rotation::from_scaled_axis(turn);
        rotation.renormalize_fast();
        State { rotation, position, velocity }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::geometry::gravity_in_world;

    #[test]
    fn the_rotation_between_accelerometer_and_gyroscope_axes_is_recovered() {
        // The readings are along the rotated axes: the true value is the reading rotated back, (1 - m) reading.
        let turn = Vector::new(1e-3, -2e-3, 3e-3);
        let back = Rotation::from_scaled_axis(-turn).to_rotation_matrix().into_inner();
        let scale = Matrix::from_diagonal(&Vector::new(1e-3, 2e-3, -3e-3));
        let turned = ImuScaleMisalignment { accel: Matrix::identity() - back + scale, ..ImuScaleMisalignment::zero() };
        assert!((turned.accel_against_gyro() - turn).norm() < 1e-7, "{}", turned.accel_against_gyro());
        let both = ImuScaleMisalignment { gyro: turned.accel, ..turned };
        assert!(both.accel_against_gyro().norm() < 1e-12);
    }

    /// Angular velocity and specific force of a body in coning motion.
    fn signal(t_s: f64) -> (Vector, Vector) {
        let (s, c) = (8.0 * t_s).sin_cos();
        (Vector::new(4.0 * s, 6.0 * c, 1.0), Vector::new(3.0 * c, -2.0 * s, 9.8 + s))
    }

    /// Means over intervals of length `h`, with slopes from the neighbouring means.
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
            let (uncompensated, gyro_sigma, accel_sigma, bridged) = (1.0, 1.0, 1.0, false);
            Interval { h, gyro, gyro_slope, accel, accel_slope, uncompensated, gyro_sigma, accel_sigma, bridged }
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
        // Coning of 24 rad^2/s at 8 rad/s: without the coning correction the attitude would drift by h^2/12 w x w' ~ 1.6e-3
        // rad/s.
        let (coarse, fine) = (integrate(0.01, 2.0), integrate(0.000_5, 2.0));
        assert!(coarse.rotation.angle_to(&fine.rotation) < 2e-5, "{}", coarse.rotation.angle_to(&fine.rotation));
        assert!((coarse.velocity - fine.velocity).norm() < 4e-4, "{}", coarse.velocity - fine.velocity);
        assert!((coarse.position - fine.position).norm() < 4e-4, "{}", coarse.position - fine.position);
    }
}
