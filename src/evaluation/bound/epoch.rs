//! The measurements of one epoch.

use nalgebra::{SMatrix, SVector};
use zsim_base::geometry::{Pose, Rotation, Vector};
use zsim_base::measurement::ImuSample;
use zsim_base::time::Stamp;

/// A beam that hit a static surface, without noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamObservation {
    /// Time of emission, lidar time.
    pub stamp: Stamp,
    /// True pose of the head.
    pub world_from_head: Pose,
    /// Velocity of the head's origin, m/s.
    pub velocity_in_world: Vector,
    /// Angular velocity of the head, rad/s.
    pub angular_velocity_in_world: Vector,
    /// Point on the surface, m.
    pub hit_in_world: Vector,
    /// Direction of the beam, unit vector.
    pub direction_in_world: Vector,
    /// Unit normal of the surface, of either sign.
    pub normal_in_world: Vector,
    /// Standard deviation of the range, m.
    pub range_sigma_m: f64,
    /// Number of the plane that the surface is part of; used if the map is unknown.
    pub plane: u32,
}

/// Minimum cosine of the incidence angle; the first-order model does not apply at grazing incidence.
const MIN_INCIDENCE_COSINE: f64 = 0.02;

/// Information of beams on attitude, position, current clock offset and range offset.
pub(super) type BeamInformation = SMatrix<f64, 8, 8>;

/// An epoch: the motion of the IMU, the mean of the IMU samples, and the information of the beams.
#[derive(Debug, Clone)]
pub(super) struct Epoch {
    pub world_from_imu: Rotation,
    pub position_in_world: Vector,
    pub velocity_in_world: Vector,
    /// Sums and count of the samples.
    rate_sum: Vector,
    force_sum: Vector,
    samples: f64,
    /// Fisher information of the beams.
    pub beam_information: BeamInformation,
}

impl Epoch {
    /// An epoch without measurements, with the IMU at `world_from_imu`, `dt_s` after `before`.
    pub(super) fn new(world_from_imu: &Pose, before: &Pose, dt_s: f64) -> Self {
        let position_in_world = world_from_imu.translation.vector;
        Self {
            world_from_imu: world_from_imu.rotation,
            position_in_world,
            velocity_in_world: (position_in_world - before.translation.vector) / dt_s,
            rate_sum: Vector::zeros(),
            force_sum: Vector::zeros(),
            samples: 0.0,
            beam_information: BeamInformation::zeros(),
        }
    }

    pub(super) fn add_imu_sample(&mut self, sample: &ImuSample) {
        self.rate_sum += sample.angular_velocity_rad_per_s;
        self.force_sum += sample.specific_force_m_per_s2;
        self.samples += 1.0;
    }

    /// Mean angular velocity and specific force in the IMU frame; `None` without IMU samples.
    pub(super) fn mean_imu(&self) -> Option<(Vector, Vector)> {
        (self.samples > 0.0).then(|| (self.rate_sum / self.samples, self.force_sum / self.samples))
    }

    /// Adds a beam. Returns the derivative of its range with respect to the clock offset, m/s; `None` if the beam grazes the
    /// surface and is not used.
    pub(super) fn add_beam(&mut self, beam: &BeamObservation, head_from_imu: &Pose) -> Option<f64> {
        let along = beam.normal_in_world.dot(&beam.direction_in_world);
        if along.abs() < MIN_INCIDENCE_COSINE {
            return None;
        }
        let arm = beam.world_from_head.rotation * head_from_imu.translation.vector;
        let imu_in_world = beam.world_from_head.translation.vector + arm;
        let velocity = beam.velocity_in_world + beam.angular_velocity_in_world.cross(&arm);
        let to_hit = beam.hit_in_world - imu_in_world;
        // dr = -n (dp + dtheta x rho) / (n u), and n (dtheta x rho) = dtheta (rho x n).
        let by_position = -beam.normal_in_world / along;
        let by_attitude = to_hit.cross(&by_position);
        let by_clock = by_position.dot(&velocity) + by_attitude.dot(&beam.angular_velocity_in_world);
        let mut row = SVector::<f64, 8>::zeros();
        row.fixed_rows_mut::<3>(0).copy_from(&by_attitude);
        row.fixed_rows_mut::<3>(3).copy_from(&by_position);
        (row[6], row[7]) = (by_clock, 1.0);
        row /= beam.range_sigma_m;
        self.beam_information += row * row.transpose();
        Some(by_clock)
    }
}
