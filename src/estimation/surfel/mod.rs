//! Surfels: small patches of surface, each seen in one passing of the beams; and streaks, which are all that beams draw on a
//! surface while the head hardly turns.
//!
//! A surfel is made once, from points that the trajectory projected when they were new; from then on it moves as one rigid
//! piece with the trajectory at its mean time: all its points were measured within a fraction of a second, over which the
//! shape of the trajectory is left to the IMU.

mod build;
mod moments;

pub(super) use build::SurfelMaker;

use super::Clock;
use super::nominal::Nominal;
use super::spline::Basis;
use super::strapdown::Biases;
use crate::geometry::{Matrix, Vector};

/// A beam that came back.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beam {
    /// When it was fired, lidar time, s.
    pub(super) tau_s: f64,
    /// Where it hit, in the IMU's frame, m.
    pub(super) point_in_imu: nalgebra::Vector3<f32>,
    /// Its length, m.
    pub(super) range_m: f32,
}

/// What a stretch of beams showed.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Surfels {
    /// Patches of surface.
    pub(super) patches: Vec<Surfel>,
    /// Lines in surfaces whose other direction was not seen: matched with patches, never with each other.
    pub(super) streaks: Vec<Surfel>,
}

/// A patch of surface as the IMU saw it at the patch's mean time.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Surfel {
    /// Mean time of its points, lidar time, s.
    pub(super) tau_s: f64,
    /// Mean of its points, m.
    pub(super) centre_in_imu: Vector,
    /// Unit vector from the lidar to that.
    pub(super) beam_in_imu: Vector,
    /// Unit normal, turned to the lidar; of a streak, the unit vector along it.
    pub(super) normal_in_imu: Vector,
    /// Second central moment of its points, m^2.
    pub(super) covariance_in_imu: Matrix,
    /// Number of its points.
    pub(super) points: f64,
    /// Resolution, 0 the finest.
    pub(super) level: usize,
}

/// A patch of surface in the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Patch {
    /// Centre, m.
    pub(super) centre: Vector,
    /// Unit normal, towards the lidar; of a streak, the unit vector along it.
    pub(super) normal: Vector,
    /// Number of its points.
    pub(super) points: f64,
    /// Second central moment, m^2.
    pub(super) covariance: Matrix,
    /// Resolution, 0 the finest.
    pub(super) level: usize,
}

/// A surfel where the trajectory puts it in the map, and how it moves with the window's unknowns.
#[derive(Debug, Clone)]
pub(super) struct Placed {
    /// The surfel in the map.
    pub(super) patch: Patch,
    /// Its mean time, lidar time, s.
    pub(super) tau_s: f64,
    /// From the IMU to the centre, m.
    pub(super) arm: Vector,
    /// Unit vector along its beams, away from the lidar.
    pub(super) beam: Vector,
    /// How the centre would move if the clock offset grew, m/s.
    pub(super) velocity: Vector,
    /// The correction spline's basis at its time.
    pub(super) basis: Basis,
}

impl Patch {
    /// Variance of how far the patch's normal leans to a direction: of a plane fitted to `N` points of thickness `lambda` and
    /// spread `s^2` along it, `lambda / (N s^2)`.
    pub(super) fn variance_of_lean(&self, direction: &Vector) -> f64 {
        let along = direction - self.normal * self.normal.dot(direction);
        let spread = along.dot(&(self.covariance * along)) / along.norm_squared();
        let thin = self.normal.dot(&(self.covariance * self.normal)).max(0.0);
        if spread > 0.0 { thin / (self.points * spread) } else { 0.0 }
    }

    /// Variance of the height above the patch's centre, along its `normal`, of its plane at `within` from there, m^2.
    ///
    /// The prediction of a plane fitted to `N` points of thickness `lambda` and moment `S`: `lambda / N x^T S^-1 x`, the inverse
    /// taken in the plane, where `x` and `n x x` are two directions at right angles.
    pub(super) fn variance_of_extrapolation(&self, normal: &Vector, within: &Vector) -> f64 {
        let beside = normal.cross(within);
        let (by_within, by_beside) = (self.covariance * within, self.covariance * beside);
        let (a, b, c) = (within.dot(&by_within), within.dot(&by_beside), beside.dot(&by_beside));
        let determinant = a * c - b * b;
        if determinant <= 0.0 {
            return 0.0; // seen from its very centre
        }
        let thin = normal.dot(&(self.covariance * normal)).max(0.0);
        thin / self.points * c * within.norm_squared().powi(2) / determinant
    }
}

impl Surfel {
    /// The same beams, longer by `by_m`.
    pub(super) fn lengthen(&mut self, by_m: f64) {
        self.centre_in_imu += self.beam_in_imu * by_m;
    }

    /// The surfel in the map.
    pub(super) fn place(&self, nominal: &Nominal, clock: &Clock, biases: &Biases, knot_spacing_s: f64) -> Placed {
        let u_s = clock.imu_s(self.tau_s);
        let motion = nominal.at(u_s, &biases.gyro);
        let arm = motion.rotation * self.centre_in_imu;
        let patch = Patch {
            centre: motion.position + arm,
            normal: motion.rotation * self.normal_in_imu,
            covariance: motion.rotation * self.covariance_in_imu * motion.rotation.transpose(),
            level: self.level,
            points: self.points,
        };
        let velocity = motion.velocity + motion.angular_velocity.cross(&arm);
        let beam = motion.rotation * self.beam_in_imu;
        Placed { patch, tau_s: self.tau_s, arm, beam, velocity, basis: Basis::at(u_s, knot_spacing_s) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::from_roll_pitch_yaw;
    use approx::assert_relative_eq;

    #[test]
    fn beside_its_points_a_patch_is_as_uncertain_as_the_plane_fitted_to_them() {
        // Of the fit z = a + b x + c y to N points with standard deviation s, spread by sx and sy about their centre, the
        // prediction beside it varies by s^2 / N (x^2 / sx^2 + y^2 / sy^2): 1e-4 / 50 (0.09 / 0.02 + 0.04 / 0.05).
        let turn = from_roll_pitch_yaw(0.4, -0.3, 1.1).to_rotation_matrix().into_inner();
        let covariance = turn * Matrix::from_diagonal(&Vector::new(0.02, 0.05, 1e-4)) * turn.transpose();
        let normal = turn * Vector::z();
        let patch = Patch { centre: Vector::zeros(), normal, points: 50.0, covariance, level: 0 };
        let beside = turn * Vector::new(0.3, -0.2, 0.0);
        assert_relative_eq!(patch.variance_of_extrapolation(&normal, &beside), 1.06e-5, max_relative = 1e-9);
        assert_eq!(patch.variance_of_extrapolation(&normal, &Vector::zeros()), 0.0);
    }
}
