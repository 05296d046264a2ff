//! Surfels: small planar patches of surface, each observed in one pass of the lidar beams.
//!
//! A surfel is built once, when the points are first projected by the trajectory. From then on it moves as a rigid body with
//! the trajectory at the mean time of the points: these span a fraction of a second, over which only the IMU
//! determines the shape of the trajectory.

mod build;
mod flatness;
mod moments;

pub(super) use build::SurfelBuilder;

use super::Clock;
use super::nominal::Nominal;
use super::spline::Basis;
use super::strapdown::Biases;
use crate::geometry::{Matrix, Vector};
use crate::measurement::LidarCorrection;

/// A lidar return in the IMU frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct TimedReturn {
    /// Time of emission, lidar time, s.
    pub(super) tau_s: f64,
    /// Measured point in the IMU frame, m.
    pub(super) point_in_imu: nalgebra::Vector3<f32>,
    /// Measured range, m.
    pub(super) range_m: f32,
}

/// A planar patch as measured by the calibrated lidar at the patch's mean time, in IMU axes.
///
/// The estimated correction of the lidar's calibration is applied when the surfel is placed in the map.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Surfel {
    /// Mean time of the points, lidar time, s.
    pub(super) tau_s: f64,
    /// Vector from the lidar to the mean of the points, by the calibration, m.
    pub(super) ray_in_imu: Vector,
    /// Unit normal towards the lidar, by the calibration.
    pub(super) normal_in_imu: Vector,
    /// Second central moment of the points, by the calibration, m^2.
    pub(super) covariance_in_imu: Matrix,
    /// Additional variance of the position along the normal because the surface is not flat, m^2.
    pub(super) roughness_variance: f64,
    /// Number of points.
    pub(super) points: f64,
    /// Resolution, 0 the finest.
    pub(super) level: usize,
}

/// A planar patch of surface in the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Patch {
    /// Centre, m.
    pub(super) centre: Vector,
    /// Unit normal, towards the lidar.
    pub(super) normal: Vector,
    /// Number of points.
    pub(super) points: f64,
    /// Second central moment, m^2.
    pub(super) covariance: Matrix,
    /// Additional variance of the position along the normal because the surface is not flat, m^2.
    pub(super) roughness_variance: f64,
    /// Resolution, 0 the finest.
    pub(super) level: usize,
}

/// A surfel placed in the map by the trajectory, with derivatives by the window's unknowns.
#[derive(Debug, Clone)]
pub(super) struct PlacedSurfel {
    /// The surfel in the map.
    pub(super) patch: Patch,
    /// Mean time of the points, lidar time, s.
    pub(super) tau_s: f64,
    /// Vector from the IMU to the centre, in map axes, m.
    pub(super) arm: Vector,
    /// Unit vector from the lidar to the centre, in map axes.
    pub(super) beam: Vector,
    /// Distance from the lidar to the centre, m.
    pub(super) range_m: f64,
    /// Attitude of the IMU at that time.
    pub(super) map_from_imu: Matrix,
    /// Derivative of the centre by the clock offset, m/s.
    pub(super) velocity: Vector,
    /// The correction spline's basis at that time.
    pub(super) basis: Basis,
}

impl Patch {
    /// Variance of the normal's tilt towards `direction`, rad^2.
    ///
    /// A plane fitted to `N` points of variance `lambda` along the normal and `s^2` along the direction has `lambda / (N s^2)`.
    pub(super) fn normal_tilt_variance(&self, direction: &Vector) -> f64 {
        let along = direction - self.normal * self.normal.dot(direction);
        let spread = along.dot(&(self.covariance * along)) / along.norm_squared();
        let thin = self.normal.dot(&(self.covariance * self.normal)).max(0.0);
        if spread > 0.0 { thin / (self.points * spread) } else { 0.0 }
    }
}

impl PlacedSurfel {
    /// Vector from the lidar to the centre, in map axes, m.
    pub(super) fn ray(&self) -> Vector {
        self.beam * self.range_m
    }
}

/// Trajectory, clock and calibration that place surfels in the map.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlacementState<'a> {
    pub(super) nominal: &'a Nominal,
    pub(super) clock: &'a Clock,
    pub(super) biases: &'a Biases,
    /// Calibrated position of the lidar in the IMU frame, m.
    pub(super) laser_in_imu: &'a Vector,
    /// Estimated correction of the lidar's calibration.
    pub(super) lidar: &'a LidarCorrection,
    pub(super) knot_spacing_s: f64,
}

impl Surfel {
    /// Places the surfel in the map.
    pub(super) fn place(&self, by: &PlacementState<'_>) -> PlacedSurfel {
        let u_s = by.clock.imu_s(self.tau_s);
        let motion = by.nominal.at(u_s, &by.biases.gyro);
        let ray_in_imu = by.lidar.apply(&self.ray_in_imu);
        let arm = motion.rotation * (by.laser_in_imu + by.lidar.translation + ray_in_imu);
        let map_from_calibrated = motion.rotation * by.lidar.rotation.to_rotation_matrix().matrix();
        let patch = Patch {
            centre: motion.position + arm,
            normal: map_from_calibrated * self.normal_in_imu,
            covariance: map_from_calibrated * self.covariance_in_imu * map_from_calibrated.transpose(),
            roughness_variance: self.roughness_variance,
            level: self.level,
            points: self.points,
        };
        let range_m = ray_in_imu.norm();
        PlacedSurfel {
            patch,
            tau_s: self.tau_s,
            arm,
            beam: motion.rotation * ray_in_imu / range_m,
            range_m,
            map_from_imu: motion.rotation,
            velocity: motion.velocity + motion.angular_velocity.cross(&arm),
            basis: Basis::at(u_s, by.knot_spacing_s),
        }
    }
}
