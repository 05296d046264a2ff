//! Surfels: small patches of surface, each seen in one passing of the beams.
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

/// A patch of surface as the IMU saw it at the patch's mean time.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Surfel {
    /// Mean time of its points, lidar time, s.
    pub(super) tau_s: f64,
    /// Mean of its points, m.
    pub(super) centre_in_imu: Vector,
    /// Unit vector from the lidar to that.
    pub(super) beam_in_imu: Vector,
    /// Unit normal, turned to the lidar.
    pub(super) normal_in_imu: Vector,
    /// Second central moment of its points, m^2.
    pub(super) covariance_in_imu: Matrix,
    /// Number of its points.
    pub(super) points: f64,
    /// Resolution, 0 the finest.
    pub(super) level: usize,
}

/// A patch of surface in the map.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    /// Centre, m.
    pub(super) centre: Vector,
    /// Unit normal, towards the lidar.
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
