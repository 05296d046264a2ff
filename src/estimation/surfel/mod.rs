//! Surfels: small patches of surface, each seen in one passing of the beams.
//!
//! A surfel is made once, from points that the trajectory projected when they were new; from then on it moves as one
//! rigid piece with the trajectory at its mean time: all its points were measured within a fraction of a second, over
//! which the shape of the trajectory is left to the IMU.

mod build;
mod flat;
mod moments;

pub(super) use build::SurfelMaker;

use super::Clock;
use super::nominal::Nominal;
use super::spline::Basis;
use super::strapdown::Biases;
use crate::geometry::{Matrix, Vector};
use crate::measurement::LidarCorrection;

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

/// A patch of surface as the lidar saw it at the patch's mean time, along the axes of the IMU; what is known of the
/// lidar beyond its calibration is applied where it is placed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Surfel {
    /// Mean time of its points, lidar time, s.
    pub(super) tau_s: f64,
    /// From the lidar to the mean of its points, as calibrated, m.
    pub(super) reach_in_imu: Vector,
    /// Unit normal, turned to the lidar, as calibrated.
    pub(super) normal_in_imu: Vector,
    /// Second central moment of its points, as calibrated, m^2.
    pub(super) covariance_in_imu: Matrix,
    /// What its place along the normal is in doubt by because it is not flat: a variance, m^2.
    pub(super) doubt: f64,
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
    /// Unit normal, towards the lidar.
    pub(super) normal: Vector,
    /// Number of its points.
    pub(super) points: f64,
    /// Second central moment, m^2.
    pub(super) covariance: Matrix,
    /// What its place along the normal is in doubt by because it is not flat: a variance, m^2.
    pub(super) doubt: f64,
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
    /// Length of its beams, m.
    pub(super) range_m: f64,
    /// Attitude of the IMU at its time.
    pub(super) map_from_imu: Matrix,
    /// How the centre would move if the clock offset grew, m/s.
    pub(super) velocity: Vector,
    /// The correction spline's basis at its time.
    pub(super) basis: Basis,
}

impl Patch {
    /// Variance of how far the patch's normal leans to a direction: of a plane fitted to `N` points of thickness
    /// `lambda` and spread `s^2` along it, `lambda / (N s^2)`.
    pub(super) fn variance_of_lean(&self, direction: &Vector) -> f64 {
        let along = direction - self.normal * self.normal.dot(direction);
        let spread = along.dot(&(self.covariance * along)) / along.norm_squared();
        let thin = self.normal.dot(&(self.covariance * self.normal)).max(0.0);
        if spread > 0.0 { thin / (self.points * spread) } else { 0.0 }
    }
}

impl Placed {
    /// From the lidar to the centre, m.
    pub(super) fn reach(&self) -> Vector {
        self.beam * self.range_m
    }
}

/// By what surfels are placed in the map.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placing<'a> {
    pub(super) nominal: &'a Nominal,
    pub(super) clock: &'a Clock,
    pub(super) biases: &'a Biases,
    /// Where the lidar is calibrated to be, m.
    pub(super) laser_in_imu: &'a Vector,
    pub(super) lidar: &'a LidarCorrection,
    pub(super) knot_spacing_s: f64,
}

impl Surfel {
    /// The surfel in the map.
    pub(super) fn place(&self, by: &Placing<'_>) -> Placed {
        let u_s = by.clock.imu_s(self.tau_s);
        let motion = by.nominal.at(u_s, &by.biases.gyro);
        let reach_in_imu = by.lidar.reach(&self.reach_in_imu);
        let arm = motion.rotation * (by.laser_in_imu + by.lidar.shift + reach_in_imu);
        let map_from_calibrated = motion.rotation * by.lidar.turn.to_rotation_matrix().matrix();
        let patch = Patch {
            centre: motion.position + arm,
            normal: map_from_calibrated * self.normal_in_imu,
            covariance: map_from_calibrated * self.covariance_in_imu * map_from_calibrated.transpose(),
            doubt: self.doubt,
            level: self.level,
            points: self.points,
        };
        let range_m = reach_in_imu.norm();
        Placed {
            patch,
            tau_s: self.tau_s,
            arm,
            beam: motion.rotation * reach_in_imu / range_m,
            range_m,
            map_from_imu: motion.rotation,
            velocity: motion.velocity + motion.angular_velocity.cross(&arm),
            basis: Basis::at(u_s, by.knot_spacing_s),
        }
    }
}
