//! The lidar among the unknowns: how its ranges, its attitude and its place on the IMU differ from what the open loop took them
//! for.
//!
//! Common to all that was seen, they stand beside the knots' corrections. With `l` the way from the lidar to a surfel, `u` along
//! it and `R` the attitude of the IMU, a range longer by `r`, a turn `e` and a shift `s` along the axes of the IMU move its
//! centre by `u r + R (e x R^T l + s)`.

use super::equations::Beside;
use crate::estimation::EstimatorSpec;
use crate::estimation::surfel::Patch;
use crate::geometry::{Pose, Rotation, Vector};
use crate::measurement::{Calibration, LidarCorrection};
use nalgebra::SVector;

/// Unknowns of the lidar: range, turn, shift.
pub(super) const SHARED: usize = 7;
/// Those of one residual, or of a step.
pub(super) type Shared = SVector<f64, SHARED>;

/// How the lidar sits on the IMU: as calibrated, and as it is known now.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mount {
    head_from_imu: Pose,
    /// From the IMU to the lidar as calibrated, m.
    laser_in_imu: Vector,
    pub(super) lidar: LidarCorrection,
    /// Standard deviations of the calibration.
    sigmas: Shared,
}

/// From where a surfel was seen.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sight {
    /// Attitude of the IMU.
    map_from_imu: Rotation,
    /// From the lidar to the surfel's centre, m.
    reach: Vector,
}

impl Mount {
    /// As the open loop left it, with the ranges held where nothing tells their offset.
    pub(super) fn new(
        calibration: &Calibration,
        (lidar, ranges_are_held): (&LidarCorrection, bool),
        spec: &EstimatorSpec,
    ) -> Self {
        let imu_from_laser = calibration.head_from_imu.inverse() * calibration.head_from_laser;
        let (turn, shift) = spec.extrinsics.sigmas();
        let range = if ranges_are_held { 0.0 } else { spec.surfels.range_offset_sigma_m };
        let sigmas = [range, turn, turn, turn, shift, shift, shift];
        Self {
            head_from_imu: calibration.head_from_imu,
            laser_in_imu: imu_from_laser.translation.vector,
            lidar: *lidar,
            // What is left at zero is held there.
            sigmas: Shared::from(sigmas.map(|sigma| sigma.max(1e-9))),
        }
    }

    /// From where `patch`, made by the correction `made_by`, was seen by a head at `map_from_head`; the patch becomes what the
    /// lidar as it is known now makes of it.
    pub(super) fn sight(&self, map_from_head: &Pose, patch: &mut Patch, made_by: &LidarCorrection) -> Sight {
        let map_from_imu = map_from_head * self.head_from_imu;
        let attitude = map_from_imu.rotation;
        let lidar_at = |shift: &Vector| map_from_imu.translation.vector + attitude * (self.laser_in_imu + shift);
        let seen = attitude.inverse() * (patch.centre - lidar_at(&made_by.shift));
        let reach = attitude * self.lidar.reach(&made_by.calibrated(&seen));
        patch.centre = lidar_at(&self.lidar.shift) + reach;
        turn_patch(patch, &(attitude * self.lidar.turn * made_by.turn.inverse() * attitude.inverse()));
        Sight { map_from_imu: attitude, reach }
    }

    /// Adds what the calibration says of the corrections so far.
    pub(super) fn add_to(&self, beside: &mut Beside) {
        let (turn, shift) = (self.lidar.turn.scaled_axis(), self.lidar.shift);
        let so_far = [self.lidar.range_m, turn.x, turn.y, turn.z, shift.x, shift.y, shift.z];
        for (k, e) in so_far.into_iter().enumerate() {
            let by = Shared::from_fn(|row, _| if row == k { 1.0 } else { 0.0 });
            beside.add(&by, e, self.sigmas[k].powi(-2));
        }
    }

    /// Takes a step.
    pub(super) fn correct(&mut self, step: &Shared) {
        self.lidar.range_m += step[0];
        self.lidar.turn = Rotation::from_scaled_axis(turn_of(step)) * self.lidar.turn;
        self.lidar.shift += shift_of(step);
    }
}

impl Sight {
    /// By how much the distance along `normal` grows with each unknown.
    pub(super) fn by(&self, normal: &Vector) -> Shared {
        let in_imu = |v: &Vector| self.map_from_imu.inverse_transform_vector(v);
        let (longer, turn, shift) =
            (normal.dot(&self.reach.normalize()), in_imu(&self.reach.cross(normal)), in_imu(normal));
        Shared::from([longer, turn.x, turn.y, turn.z, shift.x, shift.y, shift.z])
    }

    /// The trajectory turns at its time.
    pub(super) fn turn(&mut self, turn: &Rotation) {
        self.map_from_imu = turn * self.map_from_imu;
        self.reach = turn * self.reach;
    }

    /// Moves a patch, seen from here, by a step of the lidar; by how much its centre moves, m.
    pub(super) fn correct(&mut self, step: &Shared, patch: &mut Patch) -> Vector {
        let turn = Rotation::from_scaled_axis(self.map_from_imu * turn_of(step));
        let reach = turn * (self.reach * (1.0 + step[0] / self.reach.norm()));
        let moved = reach - self.reach + self.map_from_imu * shift_of(step);
        patch.centre += moved;
        turn_patch(patch, &turn);
        self.reach = reach;
        moved
    }
}

/// By how much a step moves what is seen, as far as `farthest_m` away, at most, m.
pub(super) fn farthest_moved(step: &Shared, farthest_m: f64) -> f64 {
    step[0].abs() + farthest_m * turn_of(step).norm() + shift_of(step).norm()
}

/// Turns a patch about its centre.
pub(super) fn turn_patch(patch: &mut Patch, turn: &Rotation) {
    let turn = turn.to_rotation_matrix().into_inner();
    patch.normal = turn * patch.normal;
    patch.covariance = turn * patch.covariance * turn.transpose();
}

fn turn_of(step: &Shared) -> Vector {
    Vector::new(step[1], step[2], step[3])
}

fn shift_of(step: &Shared) -> Vector {
    Vector::new(step[4], step[5], step[6])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::load;
    use crate::geometry::{Matrix, from_roll_pitch_yaw};
    use crate::measurement::{ImuNoise, LidarNoise};
    use approx::assert_relative_eq;

    fn mount(lidar: LidarCorrection) -> Mount {
        let calibration = Calibration {
            head_from_laser: Pose::from_parts(Vector::new(0.1, -0.2, 0.3).into(), from_roll_pitch_yaw(0.1, 0.2, 0.3)),
            head_from_imu: Pose::from_parts(Vector::new(0.2, 0.1, -0.1).into(), from_roll_pitch_yaw(-0.4, 0.1, 1.3)),
            imu: ImuNoise {
                gyro_density_rad_per_s_per_sqrt_hz: 1.0,
                accel_density_m_per_s2_per_sqrt_hz: 1.0,
                gyro_bias_walk_rad_per_s_per_sqrt_s: 1.0,
                accel_bias_walk_m_per_s2_per_sqrt_s: 1.0,
                gyro_turn_on_bias_rad_per_s: 1.0,
                accel_turn_on_bias_m_per_s2: 1.0,
                gyro_limit_rad_per_s: 1.0,
                accel_limit_m_per_s2: 1.0,
            },
            lidar: LidarNoise { near_sigma_m: 0.01, near_m: 10.0, far_sigma_m: 0.03, far_m: 30.0 },
        };
        Mount::new(&calibration, (&lidar, false), &load("default").unwrap())
    }

    fn map_from_head() -> Pose {
        Pose::from_parts(Vector::new(3.0, 1.0, 1.5).into(), from_roll_pitch_yaw(0.3, -0.5, 2.0))
    }

    /// Where the head's lidar, by the definition of its correction, puts what it takes to be at `point_in_laser`.
    fn projected(mount: &Mount, point_in_laser: &Vector) -> Vector {
        let laser_in_imu = from_roll_pitch_yaw(-0.4, 0.1, 1.3).inverse() * from_roll_pitch_yaw(0.1, 0.2, 0.3);
        let reach = mount.lidar.reach(&(laser_in_imu * point_in_laser));
        let in_imu = mount.laser_in_imu + mount.lidar.shift + reach;
        map_from_head() * mount.head_from_imu * nalgebra::Point3::from(in_imu) - nalgebra::Point3::origin()
    }

    fn patch(centre: Vector) -> Patch {
        let covariance = Matrix::from_diagonal(&Vector::new(0.02, 0.05, 1e-4));
        Patch { centre, normal: Vector::z(), points: 50.0, covariance, doubt: 0.0, level: 0 }
    }

    fn correction(scale: f64) -> LidarCorrection {
        LidarCorrection {
            range_m: 0.01 * scale,
            turn: from_roll_pitch_yaw(0.02 * scale, -0.01 * scale, 0.03 * scale),
            shift: Vector::new(0.005, -0.01, 0.02) * scale,
        }
    }

    #[test]
    fn a_patch_made_by_an_older_correction_becomes_that_of_the_newer() {
        let (then, now) = (mount(correction(-0.7)), mount(correction(1.0)));
        let point_in_laser = Vector::new(2.0, 3.0, -1.0);
        let mut seen = patch(projected(&then, &point_in_laser));
        now.sight(&map_from_head(), &mut seen, &then.lidar);
        assert_relative_eq!(seen.centre, projected(&now, &point_in_laser), epsilon = 1e-12);
    }

    #[test]
    fn derivatives_are_those_of_differences_and_steps_move_the_patch_by_them() {
        let (start, normal) = (mount(correction(1.0)), Vector::new(0.3, -0.8, 0.5).normalize());
        let point_in_laser = Vector::new(2.0, 3.0, -1.0);
        let centre = projected(&start, &point_in_laser);
        let sight = start.sight(&map_from_head(), &mut patch(centre), &start.lidar);
        for k in 0..SHARED {
            let step = Shared::from_fn(|row, _| if row == k { 1e-6 } else { 0.0 });
            let mut there = start;
            there.correct(&step);
            let moved = projected(&there, &point_in_laser) - centre;
            assert_relative_eq!(sight.by(&normal)[k], normal.dot(&moved) * 1e6, epsilon = 1e-5);
            let by_step = { sight }.correct(&step, &mut patch(centre));
            assert_relative_eq!(by_step, moved, epsilon = 1e-11);
        }
    }
}
