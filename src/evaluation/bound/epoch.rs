//! What was heard and seen about an instant.

use crate::geometry::{Pose, Rotation, Vector};
use crate::measurement::ImuSample;
use crate::time::Stamp;
use nalgebra::{SMatrix, SVector};

/// A beam that met a surface that stands, as it truly was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    /// When it was fired, lidar time.
    pub stamp: Stamp,
    /// Where the head was.
    pub world_from_head: Pose,
    /// Velocity of the head's origin, m/s.
    pub velocity_in_world: Vector,
    /// Angular velocity of the head, rad/s.
    pub angular_velocity_in_world: Vector,
    /// Where it met the surface, m.
    pub hit_in_world: Vector,
    /// Where it went: a unit vector.
    pub direction_in_world: Vector,
    /// The surface's unit normal, of either sign.
    pub normal_in_world: Vector,
    /// Standard deviation of its range, m.
    pub range_sigma_m: f64,
}

/// Beams along a surface to within this cosine say nothing that could be believed to first order.
const GRAZING: f64 = 0.02;

/// Errors that a beam tells of: attitude, position, clock offset now, offset of the ranges.
pub(super) type Seen = SMatrix<f64, 8, 8>;
/// Entries of its lower triangle.
const TOLD: usize = 36;

/// An instant: how the IMU moved, what it said on average, and what the beams about it say together.
#[derive(Debug, Clone)]
pub(super) struct Epoch {
    pub world_from_imu: Rotation,
    pub position_in_world: Vector,
    pub velocity_in_world: Vector,
    /// Sums of what the samples say, and how many there are.
    rate_sum: Vector,
    force_sum: Vector,
    samples: f64,
    /// Fisher information of the beams: its lower triangle, row by row.
    told: [f64; TOLD],
}

impl Epoch {
    /// Nothing heard yet where the IMU was at `world_from_imu`, `dt_s` after `before`.
    pub(super) fn new(world_from_imu: &Pose, before: &Pose, dt_s: f64) -> Self {
        let position_in_world = world_from_imu.translation.vector;
        Self {
            world_from_imu: world_from_imu.rotation,
            position_in_world,
            velocity_in_world: (position_in_world - before.translation.vector) / dt_s,
            rate_sum: Vector::zeros(),
            force_sum: Vector::zeros(),
            samples: 0.0,
            told: [0.0; TOLD],
        }
    }

    pub(super) fn hear(&mut self, sample: &ImuSample) {
        self.rate_sum += sample.angular_velocity_rad_per_s;
        self.force_sum += sample.specific_force_m_per_s2;
        self.samples += 1.0;
    }

    /// Mean angular velocity and specific force, in the IMU's frame; `None` where the IMU was silent.
    pub(super) fn heard(&self) -> Option<(Vector, Vector)> {
        (self.samples > 0.0).then(|| (self.rate_sum / self.samples, self.force_sum / self.samples))
    }

    pub(super) fn see(&mut self, sight: &Sight, head_from_imu: &Pose) {
        let along = sight.normal_in_world.dot(&sight.direction_in_world);
        if along.abs() < GRAZING {
            return;
        }
        let arm = sight.world_from_head.rotation * head_from_imu.translation.vector;
        let imu_in_world = sight.world_from_head.translation.vector + arm;
        let velocity = sight.velocity_in_world + sight.angular_velocity_in_world.cross(&arm);
        let to_hit = sight.hit_in_world - imu_in_world;
        // dr = -n (dp + dtheta x rho) / (n u), and n (dtheta x rho) = dtheta (rho x n).
        let by_position = -sight.normal_in_world / along;
        let by_attitude = to_hit.cross(&by_position);
        let by_clock = by_position.dot(&velocity) + by_attitude.dot(&sight.angular_velocity_in_world);
        let mut row = SVector::<f64, 8>::zeros();
        row.fixed_rows_mut::<3>(0).copy_from(&by_attitude);
        row.fixed_rows_mut::<3>(3).copy_from(&by_position);
        (row[6], row[7]) = (by_clock, 1.0);
        row /= sight.range_sigma_m;
        let products = (0..8).flat_map(|i| (0..=i).map(move |j| row[i] * row[j]));
        self.told.iter_mut().zip(products).for_each(|(sum, product)| *sum += product);
    }

    /// Fisher information of the beams.
    pub(super) fn seen(&self) -> Seen {
        Seen::from_fn(|i, j| {
            let (row, column) = (i.max(j), i.min(j));
            self.told[row * (row + 1) / 2 + column]
        })
    }
}
