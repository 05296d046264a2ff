//! The unknowns of the window that all times share: biases, gravity, clock and calibration.

use super::clock::Clock;
use super::strapdown::{Biases, ImuScaleMisalignment};
use crate::layout::{
    ACCEL_BIAS, ACCEL_MATRIX, CLOCK, CLOCK_RATE, GRAVITY, GYRO_BIAS, GYRO_MATRIX, LIDAR_ROTATION, LIDAR_TRANSLATION,
    RANGE,
};
use zsim_base::geometry::{Matrix, Rotation, Vector, gravity_in_world};
use zsim_base::measurement::LidarCorrection;

/// The unknowns in the border of the normal equations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unknowns {
    pub(super) biases: Biases,
    /// Gravity in the map frame, m/s^2.
    pub(super) gravity: Vector,
    pub(super) clock: Clock,
    /// Scale errors and misalignments of the IMU.
    pub(super) scale_misalignment: ImuScaleMisalignment,
    /// Corrections of the lidar calibration.
    pub(super) lidar: LidarCorrection,
}

impl Unknowns {
    /// The values at the start: gravity along -z, and IMU and lidar as calibrated.
    pub(super) fn initial(biases: Biases, clock: Clock) -> Self {
        Self {
            biases,
            gravity: gravity_in_world(),
            clock,
            scale_misalignment: ImuScaleMisalignment::zero(),
            lidar: LidarCorrection::default(),
        }
    }

    /// The values after a `step`, in the order of the border.
    pub(super) fn plus(&self, step: &[f64]) -> Self {
        let three = |at: usize| Vector::new(step[at], step[at + 1], step[at + 2]);
        let tilt = Vector::new(step[GRAVITY], step[GRAVITY + 1], 0.0);
        let Self { biases, gravity, clock, mut scale_misalignment, lidar } = *self;
        scale_misalignment.add(&scale_misalignment_step(step));
        Self {
            biases: Biases { gyro: biases.gyro + three(GYRO_BIAS), accel: biases.accel + three(ACCEL_BIAS) },
            gravity: Rotation::from_scaled_axis(tilt) * gravity,
            clock: Clock { offset_s: clock.offset_s + step[CLOCK], rate: clock.rate + step[CLOCK_RATE], ..clock },
            scale_misalignment,
            lidar: LidarCorrection {
                range_m: lidar.range_m + step[RANGE],
                rotation: Rotation::from_scaled_axis(three(LIDAR_ROTATION)) * lidar.rotation,
                translation: lidar.translation + three(LIDAR_TRANSLATION),
            },
        }
    }
}

/// The change of the scale errors and misalignments of the IMU by a `step` of the border.
pub(super) fn scale_misalignment_step(step: &[f64]) -> ImuScaleMisalignment {
    let matrix = |at: usize| Matrix::from_fn(|r, c| step[at + 3 * r + c]);
    ImuScaleMisalignment { gyro: matrix(GYRO_MATRIX), accel: matrix(ACCEL_MATRIX) }
}
